"""The conventions that are known by name: one table of facts."""

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType

from .._core.checks import described, nearest
from ._convention import Convention


def conventions() -> Mapping[str, Convention]:
    """List the conventions that `convert` knows by name, with their facts.

    **Returns** a mapping that cannot be changed, from name to `Convention`.

    **Example**

    >>> from jaxsh import harmonics
    >>> harmonics.conventions()["three.js"].axes  # its y, up, is our z
    ('+x', '+z', '-y')
    """
    return _CONVENTIONS


def look_up(name: str, convention: str | Convention) -> Convention:
    """Find a convention by its name; raises `ValueError` that says the nearest."""
    if isinstance(convention, Convention):
        return convention
    if isinstance(convention, str) and convention in _CONVENTIONS:
        return _CONVENTIONS[convention]
    raise ValueError(
        f"expected {name} as a Convention or a name of harmonics.conventions(), got "
        f"{described(convention)}{nearest(convention, _CONVENTIONS)}"
    )


def _named() -> dict[str, Convention]:
    signed = Convention(phase="condon-shortley")
    folded = Convention(normalization="polynomial", quantity="irradiance/pi", degree=2)
    replace = dataclasses.replace
    return {
        "jaxsh": Convention(about="this package"),
        "irradiance": Convention(
            quantity="irradiance", about="this package, convolved with the clamped cosine"
        ),
        "sphericart": Convention(about="sphericart.SphericalHarmonics"),
        "three.js": Convention(
            axes="y-up",
            layout="channels-last",
            degree=2,
            about="SphericalHarmonics3 of a LightProbe, nine Vector3",
        ),
        "condon-shortley": replace(signed, about="real harmonics with the sign (-1)^m"),
        "directxmath": replace(signed, degree=5, about="DirectXMath, XMSHEvalDirection"),
        "kaolin": replace(signed, degree=2, about="kaolin.render.lighting, sh9"),
        "gaussian-splatting": replace(
            signed,
            layout="channels-last",
            degree=4,
            about="3D Gaussian splatting, eval_sh of features (N, K, 3); the color is ½ more, and "
            "the direction is from the eye to the splat",
        ),
        "habel": replace(
            signed, layout="channels-last", about="the published tables of Habel et al. 2008"
        ),
        "unreal": replace(signed, axes=("+x", "-y", "+z"), about="TSHVector; left-handed, z up"),
        "babylon.js": replace(
            signed,
            axes=("-x", "+z", "-y"),
            layout="channels-last",
            degree=2,
            about="SphericalHarmonics of radiance, as addLight gives; left-handed, y up",
        ),
        "gltf": replace(
            signed,
            axes="y-up",
            layout="channels-last",
            quantity="irradiance",
            degree=2,
            about="EXT_lights_image_based, irradianceCoefficients as Babylon.js reads them",
        ),
        "filament-sh": replace(signed, axes="y-up", layout="channels-last", about="cmgen --sh"),
        "filament-irradiance": replace(
            signed,
            axes="y-up",
            layout="channels-last",
            quantity="irradiance",
            about="cmgen --sh-irradiance",
        ),
        "filament": replace(
            folded,
            axes="y-up",
            layout="channels-last",
            about="cmgen --sh-shader, sh.txt of --deploy, IndirectLight::Builder::irradiance",
        ),
        "unity": replace(
            folded,
            axes=("-x", "+z", "-y"),
            layout="by-channel",
            about="SphericalHarmonicsL2, 27 floats [channel, coefficient]; left-handed, y up",
        ),
        "alicevision": replace(
            folded,
            order=((1, 1), (1, -1), (1, 0), (0, 0), (2, -2), (2, 1), (2, -1), (2, 2), (2, 0)),
            layout="channels-last",
            about="lightingEstimation, AugmentedNormal: x, y, z, 1, xy, xz, yz, x²-y², 3z²-1",
        ),
        **{
            f"pyshtools-{name}": Convention(
                normalization=normalization,
                layout="cosine-sine",
                about=f"SHCoeffs, normalization='{name}', csphase=1",
            )
            for name, normalization in (
                ("4pi", "4pi"),
                ("ortho", "orthonormal"),
                ("schmidt", "schmidt"),
                ("unnorm", "unnormalized"),
            )
        },
        **{
            f"e3nn-{name}": Convention(
                normalization=normalization,
                basis_axes="zxy",
                about=f"spherical_harmonics, normalization='{name}'; the polar axis is y",
            )
            for name, normalization in (
                ("component", "4pi"),
                ("integral", "orthonormal"),
                ("norm", "schmidt"),
            )
        },
    }


_CONVENTIONS: Mapping[str, Convention] = MappingProxyType(_named())
