"""Derivatives against each other: forward, in reverse, and differences, in one program."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np


def check_derivatives(
    function: Callable[..., jax.Array], arguments: tuple[jax.Array, ...], rng: np.random.Generator
) -> None:
    """As JAX's `check_grads` does along random directions, but with one compilation.

    In double precision. In every argument some derivatives are not zero.
    """
    along = tuple(jnp.asarray(rng.normal(size=a.shape)) for a in arguments)
    step = 1e-5

    @jax.jit
    def derivatives():
        def at(t):
            return function(*jax.tree.map(lambda a, d: a + t * d, arguments, along))

        forward = jax.jvp(function, arguments, along)[1]
        weights = jnp.asarray(rng.normal(size=forward.shape))
        slopes = jax.vjp(function, *arguments)[1](weights)
        ends = jax.lax.map(at, jnp.asarray([-step, step]))
        return forward, slopes, jnp.sum(weights * forward), (ends[1] - ends[0]) / (2 * step)

    forward, slopes, summed, difference = derivatives()
    atol = 1e-9 * np.abs(forward).max()  # 6.5e-10 measured, of shade_glossy and fixed_light
    np.testing.assert_allclose(forward, difference, rtol=0, atol=atol)
    backward = sum(float(jnp.sum(s * d)) for s, d in zip(slopes, along, strict=True))
    np.testing.assert_allclose(backward, summed, rtol=1e-10, atol=0)
    assert all(np.abs(slope).max() > 0 for slope in slopes)
