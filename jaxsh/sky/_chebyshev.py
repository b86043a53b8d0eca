"""Chebyshev polynomials on intervals: the basis of the fits, and why it is not θ^i τ^j.

The problem is linear. In the monomials of Habel et al. 2008 (eq. 1) its condition number is
4e19, in Chebyshev polynomials of variables scaled to [-1, 1] it is below 10.
"""

import functools
import math
from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float


class Axis(NamedTuple):
    """One variable of a fit: its name, its range, and the scale that it is fitted in."""

    name: str
    low: float
    high: float
    log: bool = False

    def scaled(self, value: Float[Array, " n"]) -> Float[Array, " n"]:
        """From the range to [-1, 1]. Differentiable."""
        low, high = self._ends()
        bent = jnp.log(value) if self.log else value
        return (2 * bent - (low + high)) / (high - low)

    def nodes(self, count: int) -> Float[np.ndarray, " n"]:
        """The roots of T_count in the scaled variable, back in the range, ascending."""
        low, high = self._ends()
        root = -np.cos(np.pi * (np.arange(count) + 0.5) / count)
        bent = low + (root + 1) * (high - low) / 2
        return np.exp(bent) if self.log else bent

    def holds(self, value):
        """Whether values are in the range, but for rounding; NumPy or JAX."""
        slack = 1e-6 * (self.high - self.low)
        return (value >= self.low - slack) & (value <= self.high + slack)

    def _ends(self) -> tuple[float, float]:
        return (math.log(self.low), math.log(self.high)) if self.log else (self.low, self.high)


def chebyshev(x: Float[Array, " n"], count: int) -> Float[Array, "count n"]:
    """T_0 to T_(count-1) in rows, by the three-term recursion. Differentiable."""
    rows = [jnp.ones_like(x), x]
    while len(rows) < count:
        rows.append(2 * x * rows[-1] - rows[-2])
    return jnp.stack(rows[:count])


def monomials(x: Float[Array, " n"], count: int) -> Float[Array, "count n"]:
    """1, x, … x^(count-1) in rows: the paper's basis. Differentiable."""
    rows = [jnp.ones_like(x)]
    while len(rows) < count:
        rows.append(rows[-1] * x)
    return jnp.stack(rows)


def tensor(rows: Sequence[Float[Array, "_ n"]]) -> Float[Array, "terms n"]:
    """All products of one row of each, the last varying fastest."""
    return functools.reduce(
        lambda a, b: (a[:, None] * b[None]).reshape(len(a) * len(b), a.shape[-1]), rows
    )


def condition(design: Float[Array, "samples terms"]) -> float:
    """2-norm condition number, by singular values in float64 on the host.

    In float64 itself not to be trusted beyond 1e16, where all that is known is that it is large.
    """
    singular = np.linalg.svd(np.asarray(design, np.float64), compute_uv=False)
    return float(singular[0] / singular[-1]) if singular[-1] > 0 else float("inf")
