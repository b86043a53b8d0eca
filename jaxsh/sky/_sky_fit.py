"""Fitted skies: coefficients as a closed form of the sun and the sky's parameters."""

import functools
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import check_batches, check_degree, check_vectors
from .._core.known import is_concrete
from .._core.linalg import einsum, matmul
from ._angles import (
    kept,
    over_one_axis,
    row_of_each,
    squared_zenith_angle,
    unit,
    waves,
    zenith_angle,
)
from ._polynomials import FEW, chebyshev

Prefactor = Callable[..., Array]


class Axis(NamedTuple):
    """Variable of a fit: its name, its range, and the scale that it is fitted in.

    `log`: fitted in its logarithm. See `SkyFit.axes`.

    **Example**

    >>> from jaxsh import sky
    >>> axis = sky.Axis("turbidity", 2.0, 8.0, log=True)
    >>> axis.nodes(3).round(3).tolist(), bool(axis.holds(9.0))
    ([2.195, 4.0, 7.291], False)
    """

    name: str
    low: float
    high: float
    log: bool = False

    def scaled(self, value: Float[Array, " n"]) -> Float[Array, " n"]:
        """Maps the range to [-1, 1]. Differentiable."""
        low, high = self._ends()
        bent = jnp.log(value) if self.log else value
        return (2 * bent - (low + high)) / (high - low)

    def nodes(self, count: int) -> Float[np.ndarray, " n"]:
        """Roots of T_count in the scaled variable, back in the range, ascending."""
        low, high = self._ends()
        root = -np.cos(np.pi * (np.arange(count) + 0.5) / count)
        bent = low + (root + 1) * (high - low) / 2
        return np.exp(bent) if self.log else bent

    def holds(self, value):
        """True for values in the range, but for rounding; NumPy or JAX."""
        slack = 1e-6 * (self.high - self.low)
        return (value >= self.low - slack) & (value <= self.high + slack)

    def _ends(self) -> tuple[float, float]:
        return (math.log(self.low), math.log(self.high)) if self.log else (self.low, self.high)


class SkyFit(eqx.Module):
    """Coefficients of a sky as Chebyshev series in the sun's height and the sky's parameters.

    c_lm = w_m Σ_q mix_q p_q Σ_ij a_qlm,ij T_i(u) T_j(v)…, for m ≥ 0 at azimuth 0; eq. 4 of Habel
    et al. 2008 turns it to the sun. With `parity`, u is θ² scaled to [-1, 1] and w_m = sin^m θ,
    so that together with cos mφ it is a polynomial of the sun's x and y: as smooth at the zenith
    as the sky is. Without it u is θ itself and w_m = 1, as in the paper.

    `coefficients` a: (channels, rows, *terms), one row for each (l, m ≥ 0); `mix`: from fitted
    quantities to the sky's channels; `prefactor`: p(sun, *parameters) -> (n, channels), or none;
    `axes`: the variables and their ranges; `solution`: a `Solution`, or none for a stored fit.
    Made by `fit`.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import sky
    >>> stored = sky.preetham_table("small", degree=2)
    >>> stored(np.array([0.6, 0.0, 0.8]), 3.0).shape
    (3, 9)
    """

    coefficients: Float[Array, "channels rows ..."]
    mix: Float[Array, "out channels"]
    axes: tuple[Axis, ...] = eqx.field(static=True)
    parity: bool = eqx.field(static=True)
    prefactor: Prefactor | None = eqx.field(static=True, default=None)
    solution: Any = None

    def __call__(
        self, sun: Float[ArrayLike, "*suns 3"], *parameters: Float[ArrayLike, "..."]
    ) -> Float[Array, "*out channels k"]:
        """Evaluates coefficients (..., C, K) for suns (..., 3), of any length, and parameters.

        A parameter (...) for each of `axes` but the first. Batches broadcast; in the sun's dtype.
        Differentiable in everything; with `parity` and no prefactor that has a kink there, the
        zenith included, and else with the derivative of the kink's terms set to zero there.

        Outside of the fitted range: a `ValueError` where values are known, else NaN. Nothing is
        extrapolated.
        """
        sun = kept(sun, "sun")
        check_vectors("sun", sun)
        if len(parameters) != len(self.axes) - 1:
            names = ", ".join(axis.name for axis in self.axes[1:]) or "none"
            raise ValueError(f"expected as parameters {names}, got {len(parameters)}")
        numbers = tuple(
            kept(value, axis.name).astype(sun.dtype)
            for axis, value in zip(self.axes[1:], parameters, strict=True)
        )
        shapes = {
            axis.name: (*value.shape, 1) for axis, value in zip(self.axes[1:], numbers, strict=True)
        }
        check_batches(sun=sun.shape, **shapes)
        check_range(self.axes, self.parity, sun, numbers)
        return evaluate(self, sun, numbers)

    @property
    def degree(self) -> int:
        """Degree of the harmonics: rows = (degree + 1)(degree + 2)/2."""
        return (int(np.sqrt(8 * self.coefficients.shape[1] + 1)) - 3) // 2

    def truncated(self, degree: int) -> "SkyFit":
        """Leaves out the bands above `degree`, and the work for them."""
        degree = check_degree(degree)
        if degree > self.degree:
            raise ValueError(f"the fit is of degree {self.degree}, got degree {degree}")
        rows = (degree + 1) * (degree + 2) // 2
        return eqx.tree_at(lambda f: f.coefficients, self, self.coefficients[:, :rows])


def check_range(axes: tuple[Axis, ...], parity: bool, sun, numbers) -> None:
    """Raises `ValueError` for known values outside of the range that a fit holds in."""
    if is_concrete(sun):
        theta = _zenith_angles(np.asarray(sun, np.float64))
        inside = axes[0].holds(theta * theta if parity else theta)
        if inside is not True and not np.all(inside):
            high = np.sqrt(axes[0].high) if parity else axes[0].high
            raise ValueError(
                f"fitted for suns up to {np.degrees(high):g} degrees from the zenith, got "
                f"{np.degrees(np.asarray(theta)[~np.asarray(inside)].flat[0]):g}"
            )
    for axis, value in zip(axes[1:], numbers, strict=True):
        if is_concrete(value):
            array = np.asarray(value)
            inside = axis.holds(array if array.ndim else array.item())
            if inside is not True and not np.all(inside):
                raise ValueError(
                    f"fitted for {axis.name} in [{axis.low:g}, {axis.high:g}], got "
                    f"{array[~np.asarray(inside)].flat[0]:g}"
                )


def _zenith_angles(suns: Float[np.ndarray, "*suns 3"]) -> Float[np.ndarray, "*suns"] | float:
    if suns.ndim == 1:  # Python's own functions are faster for one
        x, y, z = suns.tolist()
        return math.atan2(math.hypot(x, y), z)
    return np.arctan2(np.hypot(suns[..., 0], suns[..., 1]), suns[..., 2])


@jax.jit
def evaluate(fit: SkyFit, sun, parameters):
    return over_one_axis(functools.partial(_evaluate, fit), unit(sun), *parameters)


def _evaluate(fit: SkyFit, suns: Float[Array, "n 3"], *numbers: Float[Array, " n"]):
    x, y, z = suns.T
    height = (squared_zenith_angle if fit.parity else zenith_angle)(x, y, z)
    variables = [height, *numbers]

    channels, rows, *terms = fit.coefficients.shape
    basis = design(fit.axes, variables, terms)
    series = fit.coefficients.reshape(channels * rows, len(basis)).astype(suns.dtype)
    values = matmul(series, basis).reshape(channels, rows, len(x))
    if fit.prefactor is not None:
        values = values * fit.prefactor(suns, *numbers).T[:, None]
    values = _mixed(fit.mix.astype(suns.dtype), values)
    turned = values[:, row_of_each(fit.degree)] * waves(x, y, fit.degree, smooth=fit.parity)[None]
    inside = jnp.stack([axis.holds(v) for axis, v in zip(fit.axes, variables, strict=True)])
    turned = jnp.where(inside.all(axis=0)[None, None], turned, jnp.nan)
    return jnp.moveaxis(turned, -1, 0)


def _mixed(mix: Float[Array, "out c"], values: Float[Array, "c r n"]) -> Float[Array, "out r n"]:
    if values.shape[-1] > FEW:
        return einsum("oc,crn->orn", mix, values)
    # A part of the kernel that takes it, where a product would be one of its own.
    mix = mix[..., None, None]
    return functools.reduce(jnp.add, (mix[:, i] * values[i][None] for i in range(len(values))))


def design(axes, variables, terms) -> Float[Array, "terms n"]:
    """Tensor Chebyshev basis at given values of the variables: one for all the weights."""
    return tensor(
        [
            chebyshev(axis.scaled(value), count)
            for axis, value, count in zip(axes, variables, terms, strict=True)
        ]
    )


def monomials(x: Float[Array, " n"], count: int) -> Float[Array, "count n"]:
    """Powers 1, x, … x^(count-1) in rows: the paper's basis. Differentiable."""
    rows = [jnp.ones_like(x)]
    while len(rows) < count:
        rows.append(rows[-1] * x)
    return jnp.stack(rows)


def tensor(rows: Sequence[Float[Array, "_ n"]]) -> Float[Array, "terms n"]:
    """Products of one row of each, the last varying fastest."""
    return functools.reduce(
        lambda a, b: (a[:, None] * b[None]).reshape(len(a) * len(b), a.shape[-1]), rows
    )
