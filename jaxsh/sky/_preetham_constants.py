"""Preetham, Shirley and Smits 1999, appendix A.2: as printed, and as most programs have it."""

from typing import Literal, NamedTuple, get_args

Constants = Literal["paper", "code"]
Coefficients = tuple[tuple[float, float], ...]  # A to E, each slope·τ + intercept
Matrix = tuple[tuple[float, float, float, float], ...]  # rows τ², τ, 1; columns θ³, θ², θ, 1


class PreethamConstants(NamedTuple):
    luminance: Coefficients
    x: Coefficients
    y: Coefficients
    zenith_x: Matrix
    zenith_y: Matrix


_PAPER = PreethamConstants(
    luminance=(
        (0.1787, -1.4630),
        (-0.3554, 0.4275),
        (-0.0227, 5.3251),
        (0.1206, -2.5771),
        (-0.0670, 0.3703),
    ),
    x=(
        (-0.0193, -0.2592),
        (-0.0665, 0.0008),
        (-0.0004, 0.2125),
        (-0.0641, -0.8989),
        (-0.0033, 0.0452),
    ),
    y=(
        (-0.0167, -0.2608),
        (-0.0950, 0.0092),
        (-0.0079, 0.2102),
        (-0.0441, -1.6537),
        (-0.0109, 0.0529),
    ),
    zenith_x=(
        (0.00166, -0.00375, 0.00209, 0.0),
        (-0.02903, 0.06377, -0.03202, 0.00394),
        (0.11693, -0.21196, 0.06052, 0.25886),
    ),
    zenith_y=(
        (0.00275, -0.00610, 0.00317, 0.0),
        (-0.04214, 0.08970, -0.04153, 0.00516),
        (0.15346, -0.26756, 0.06670, 0.26688),
    ),
)

_CODE = PreethamConstants(
    luminance=(
        (0.17872, -1.46303),
        (-0.35540, 0.42749),
        (-0.02266, 5.32505),
        (0.12064, -2.57705),
        (-0.06696, 0.37027),
    ),
    x=(
        (-0.01925, -0.25922),
        (-0.06651, 0.00081),
        (-0.00041, 0.21247),
        (-0.06409, -0.89887),
        (-0.00325, 0.04517),
    ),
    y=(
        (-0.01669, -0.26078),
        (-0.09495, 0.00921),
        (-0.00792, 0.21023),
        (-0.04405, -1.65369),
        (-0.01092, 0.05291),
    ),
    zenith_x=(
        (0.00165, -0.00374, 0.00208, 0.0),
        (-0.02902, 0.06377, -0.03202, 0.00394),
        (0.11693, -0.21196, 0.06052, 0.25885),
    ),
    zenith_y=(
        (0.00275, -0.00610, 0.00316, 0.0),
        (-0.04214, 0.08970, -0.04153, 0.00515),
        (0.15346, -0.26756, 0.06669, 0.26688),
    ),
)


def preetham_constants(name: str) -> PreethamConstants:
    if name not in get_args(Constants):
        raise ValueError(f"constants must be one of {', '.join(get_args(Constants))}, got {name!r}")
    return _PAPER if name == "paper" else _CODE
