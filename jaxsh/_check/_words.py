"""Conventions, scales and errors in words."""

import math

import numpy as np

from ..harmonics import Convention
from ..harmonics._convention import axes_rows
from ._space import handmade_orders

_PHASES = {"none": "no Condon–Shortley sign", "condon-shortley": "Condon–Shortley"}
_NORMALIZATIONS = {
    "orthonormal": "orthonormal",
    "4pi": "4π normalized",
    "schmidt": "Schmidt normalized",
    "unnormalized": "unnormalized",
    "polynomial": "pre-multiplied by the constants of the basis",
}
_LAYOUTS = {
    "coefficients-last": "channels first, (C, K)",
    "channels-last": "coefficient-major, (K, C)",
    "by-channel": "channel-major, (3·K,)",
    "by-coefficient": "coefficient-major, (3·K,)",
    "cosine-sine": "cosines and sines apart, (2, L+1, L+1)",
}
_QUANTITIES = {"radiance": "radiance", "irradiance": "irradiance", "irradiance/pi": "irradiance/π"}
# Factors that code leaves out or applies twice.
_FACTORS = {
    "π": math.pi,
    "1/π": 1 / math.pi,
    "2π": 2 * math.pi,
    "1/(2π)": 0.5 / math.pi,
    "4π": 4 * math.pi,
    "1/(4π)": 0.25 / math.pi,
    "√(4π)": math.sqrt(4 * math.pi),
    "1/√(4π)": 1 / math.sqrt(4 * math.pi),
    "√π": math.sqrt(math.pi),
    "1/√π": 1 / math.sqrt(math.pi),
    "√π/2": math.sqrt(math.pi) / 2,
    "2/√π": 2 / math.sqrt(math.pi),
    "√2": math.sqrt(2),
    "1/√2": math.sqrt(0.5),
    "π²": math.pi**2,
    "1/π²": math.pi**-2,
    "2/π": 2 / math.pi,
    "π/2": math.pi / 2,
}


def facts(convention: Convention, *, gray: bool = False, basis: bool = False) -> dict[str, str]:
    """Each fact of a convention in words, by its field."""
    said = {
        "phase": _PHASES[convention.phase],
        "axes": axes(convention),
        "order": "",
        "normalization": _NORMALIZATIONS[convention.normalization],
        "quantity": "" if basis else _QUANTITIES[convention.quantity],
        "layout": _LAYOUTS[convention.layout],
    }
    if convention.order == "descending":
        said["order"] = "order of m reversed"
    elif convention.order != "ascending":
        degree = math.isqrt(len(convention.order)) - 1
        known = handmade_orders(degree).items()
        names = [name for name, order in known if order == convention.order]
        said["order"] = names[0] if names else "an order of its own"
    if basis or (gray and convention.layout != "cosine-sine"):
        said["layout"] = ""
    return {field: words for field, words in said.items() if words}


def axes(convention: Convention) -> str:
    """Say which axis is up, the handedness, and where the axes lie in ours."""
    own = convention.axes
    up = next(i for i, axis in enumerate(own) if axis[1] == "z")
    sign = "" if own[up][0] == "+" else "−"
    words = f"{sign}{'xyz'[up]} up"
    if np.linalg.det(axes_rows(own)) < 0:
        words += ", left-handed"
    if own != ("+x", "+y", "+z"):
        ours = ", ".join(axis.replace("-", "−").replace("+", "") for axis in own)
        words += f" (its x, y, z are our {ours})"
    if convention.basis_axes != "xyz":
        words += f", {convention.basis_axes[2]} polar"
    return words


def factor(value: float, slack: float = 0.01) -> str:
    """A factor with its usual name, where it has one."""
    number = f"{value:.4g}"
    sign = "−" if value < 0 else ""
    for name, known in _FACTORS.items():
        if abs(abs(value) / known - 1) <= slack:
            return f"{number} ({sign}{name})" if name != number else number
    return number


def percent(error: float) -> str:
    """An error in percent."""
    if not math.isfinite(error):
        return "no fit"
    return f"{100 * error:.1f} %" if error >= 5e-4 else "below 0.1 %"
