"""Windows: what keeps a truncated light from going negative behind its bright source."""

import functools
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from ._checks import align, as_float
from ._grid import exact_grid
from ._indexing import check_degree, degree_of, degrees, orders

WINDOWS = ("none", "hann", "lanczos", "zonal-sinc")

# Halvings of the search for the least strength: past a float64's digits.
_HALVINGS = 60


def window(
    kind: Literal["none", "hann", "lanczos", "zonal-sinc"], degree: int
) -> Float[Array, " k"]:
    """Fixed window, shape (K,) in JAX's default float type: multiply coefficients by it.

    With N = degree + 1 bands:

    - `"none"`: ones;
    - `"hann"`: (1 + cos(πl/N))/2;
    - `"lanczos"`: sinc(πl/N) = sin(πl/N)/(πl/N), also called the sinc window or Lanczos σ;
    - `"zonal-sinc"`: the same, but on m = 0 alone (Habel et al. 2008, eq. 5), for an edge along
      the horizon.

    The stronger the window, the less ringing and the more blur: `dering` finds the least that a
    given function needs.
    """
    l, bands = degrees(degree), check_degree(degree) + 1
    match kind:
        case "none":
            values = np.ones(len(l))
        case "hann":
            values = (1 + np.cos(np.pi * l / bands)) / 2
        case "lanczos":
            values = np.sinc(l / bands)
        case "zonal-sinc":
            values = np.where(orders(degree) == 0, np.sinc(l / bands), 1.0)
        case _:
            raise ValueError(f"window must be one of {', '.join(WINDOWS)}, got {kind!r}")
    return jnp.asarray(values, jnp.result_type(float))


def damping(strength: Float[ArrayLike, "*batch"], degree: int) -> Float[Array, "*batch k"]:
    """The window 1 / (1 + strength·l²(l+1)²) that `dering` uses (Sloan 2008), shape (..., K).

    It minimises the squared error plus `strength` times the squared Laplacian. Strength zero is
    no window; infinity leaves the mean alone. Differentiable in the strength.
    """
    strength = as_float(strength)[..., None]
    squared = ((degrees(degree) * (degrees(degree) + 1.0)) ** 2).astype(strength.dtype)
    strength, squared = align(strength, jnp.asarray(squared))
    # The mean is set apart: an infinite strength times its zero would be no number.
    damped = 1 / (1 + strength * jnp.where(squared > 0, squared, 1))
    return jnp.where(squared > 0, damped, jnp.ones_like(damped))


def dering(
    coefficients: Float[ArrayLike, "*batch k"],
) -> tuple[Float[Array, "*batch k"], Float[Array, "*batch"]]:
    """The least `damping` that leaves a function without negative values, and its strength.

    Each function of the batch, each colour channel too, gets a window of its own: for one window
    over the channels, use `damping` with the largest of their strengths.

    The minimum is taken over (2L+1)(4L+1) directions, between which a result can dip below zero
    by about a thousandth of its mean. A function without negative values is returned as it is,
    with strength 0; one whose mean is not positive cannot be helped and keeps nothing but its
    mean, with strength infinity. Differentiable: the strength by the implicit function theorem,
    with a kink where it reaches zero or the darkest direction changes.
    """
    coefficients = as_float(coefficients)
    degree = degree_of(coefficients.shape[-1] if coefficients.ndim else 0)
    rows = coefficients.reshape(-1, coefficients.shape[-1])
    strength = jax.vmap(functools.partial(_least_strength, degree=degree))(rows)
    strength = strength.reshape(coefficients.shape[:-1])
    return coefficients * damping(strength, degree), strength


@functools.partial(jax.jit, static_argnames="degree")
def _least_strength(coefficients: Float[Array, " k"], degree: int) -> Float[Array, ""]:
    basis = jnp.asarray(exact_grid(4 * degree, degree).basis, coefficients.dtype)
    # A window is constant over a band, so a function's bands are enough.
    first = np.arange(degree + 1, dtype=np.int32) ** 2
    bands = jnp.stack(
        [
            jnp.matmul(
                coefficients[i : i + 2 * l + 1], basis[i : i + 2 * l + 1], precision="highest"
            )
            for l, i in enumerate(first)
        ]
    )

    def darkest(strength, bands):
        return jnp.min(damping(strength, degree)[first] @ bands)

    # Where the window is 1/(4·strength) or less on every band above the mean, the mean outweighs
    # their largest sum.
    zero = jnp.zeros((), coefficients.dtype)
    mean, swing = bands[0, 0], jnp.sum(jnp.max(jnp.abs(bands[1:]), axis=-1, initial=0.0))
    enough = jnp.where(mean > 0, swing / (4 * jnp.where(mean > 0, mean, 1.0)), jnp.inf)

    def halve(_, bounds):
        low, high = bounds
        middle = (low + high) / 2
        negative = darkest(middle, bands) < 0
        return jnp.where(negative, middle, low), jnp.where(negative, high, middle)

    _, root = jax.lax.fori_loop(0, _HALVINGS, halve, jax.lax.stop_gradient((zero, enough)))
    # Nothing of the search is differentiated. One Newton step, zero in value, carries the
    # derivative of the root: dλ = -dg / (∂g/∂λ).
    slope = jax.lax.stop_gradient(jax.grad(darkest)(root, bands))
    value = darkest(root, bands)
    step = (value - jax.lax.stop_gradient(value)) / jnp.where(slope > 0, slope, 1.0)
    root = jnp.where((slope > 0) & jnp.isfinite(root), root - step, root)
    return jnp.where(darkest(zero, bands) < 0, root, zero)
