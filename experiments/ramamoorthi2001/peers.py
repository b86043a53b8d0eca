"""The peers of `harmonics.dering`, in NumPy: windows of Sloan 2008 and 2017 and how each is found.

Both give one window for all channels, the weakest of its kind that does what is asked.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import harmonics, sphere

_HALVINGS = 40

Functions = Float[Array | np.ndarray, "channels k"]


def sloan2008(functions: Functions) -> Float[np.ndarray, " k"]:
    """`harmonics.damping` of the least strength that leaves nothing negative on a grid."""
    functions = np.asarray(functions, np.float64)
    degree = harmonics.degree_of(functions.shape[-1])
    grid = sphere.gauss_legendre(6 * degree + 8).directions
    values = np.asarray(harmonics.evaluate(grid, degree), np.float64)
    l = harmonics.degrees(degree)

    def window(strength: float) -> Float[np.ndarray, " k"]:
        return 1 / (1 + strength * (l * (l + 1.0)) ** 2)

    def enough(strength: float) -> bool:
        return bool(((functions * window(strength)) @ values.T).min() >= 0)

    if enough(0.0):
        return window(0.0)
    low, high = -6.0, 9.0  # decades
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        low, high = (low, middle) if enough(10**middle) else (middle, high)
    return window(10**high)


def sloan2017(functions: Functions) -> Float[np.ndarray, " k"]:
    """A window of "Deringing Spherical Harmonics" (SIGGRAPH Asia 2017, technical briefs).

    A function is turned so that its band 1 points along z. There each order m > 0 is bounded from
    below by its amplitude around the axis, which leaves a function of z alone; a sinc window is
    found by bisection, as wide as leaves that function's minimum not negative. The bound is
    conservative: the true minimum or below it.

    The paper has degree 2, where band 1 has no other order after the turn; the same bound at any
    degree is ours. The window's fourth power is that of Filament's `cmgen`, which cites the paper.
    Where nothing is negative there is no window, and a window may be narrower than the light's
    bands, which `cmgen`'s may not.
    """
    functions = np.asarray(functions, np.float64)
    degree = harmonics.degree_of(functions.shape[-1])
    bounds = [Bound(function, degree) for function in functions]

    def enough(narrowness: float) -> bool:
        return all(bound.least(sinc4(narrowness, degree)) >= 0 for bound in bounds)

    low, high = 0.0, 1.0  # reciprocals of the window's width: no window, and only the mean
    if enough(low):
        return sinc4(low, degree)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        low, high = (low, middle) if enough(middle) else (middle, high)
    return sinc4(high, degree)


def sinc4(narrowness: float, degree: int) -> Float[np.ndarray, " k"]:
    """sinc⁴(πl/w) where l < w, for w = 1/narrowness, in bands."""
    x = harmonics.degrees(degree) * narrowness
    return np.where(x < 1, np.sinc(x) ** 4, 0)


class Bound:
    """A lower bound of one function of degree L, under any window that is constant over bands."""

    def __init__(self, function: Float[np.ndarray, " k"], degree: int):
        # Denser than the function's own detail by far: what is missed between is below 1e-4 of it.
        z = np.cos(np.linspace(0, np.pi, 64 * degree + 65))
        l, m = harmonics.degrees(degree), harmonics.orders(degree)
        # Row m: times cos(mφ) for m > 0 and sin(|m|φ) for m < 0, which are at the end.
        self.terms = np.zeros((2 * degree + 1, degree + 1, len(z)))
        self.terms[m, l] = upright(function)[:, None] * np.asarray(harmonics.legendre(z, degree))
        self.degree = degree

    def least(self, window: Float[np.ndarray, " k"]) -> float:
        bands = window[np.arange(self.degree + 1) ** 2]
        around = np.einsum("l,mlz->mz", bands, self.terms)
        cosines, sines = around[1 : self.degree + 1], around[: self.degree : -1]
        return float((around[0] - np.hypot(cosines, sines).sum(axis=0)).min())


def upright(function: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
    """Turned so that its optimal linear direction, that of band 1, is z."""
    if len(function) < 4 or not (axis := function[[3, 1, 2]]).any():
        return function
    axis = axis / np.linalg.norm(axis)
    side = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    side /= np.linalg.norm(side)
    rotation = np.stack([side, np.cross(axis, side), axis])
    turned = harmonics.rotate(jnp.asarray(function), jnp.asarray(rotation, jnp.result_type(float)))
    return np.asarray(turned, np.float64)
