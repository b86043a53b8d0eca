"""A quadrature of the sky's hemisphere that knows where a sky is not smooth.

Radiance has a cone at the sun, another at the antisolar point, and exp(B/cos θ) cannot be
expanded at the horizon. In the frame with the sun at azimuth 0 all of these are ends of three
intervals: θ in [0, θ_s] and [θ_s, π/2], φ in [0, π]. Tanh–sinh nodes crowd doubly exponentially
towards both ends of each and do not ask what kind of singularity is there, which takes a sixth of
the nodes of Gauss–Legendre panels graded to the same points for the same error.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._core.host import read_only_cache

# Steps that reach 1e-13 of the norm for Preetham's sky, and how far the trapezoidal rule goes.
_THETA_STEP, _PHI_STEP = 0.06, 0.08
_REACH = 3.3


class SkyGrid(NamedTuple):
    """Tensor grid: Σ_t Σ_p theta_weights_t phi_weights_p f(theta_t, phi_p) ≈ ∫ f dω."""

    theta: Float[Array, " t"]
    theta_weights: Float[Array, " t"]  # with the factor sin θ
    phi: Float[np.ndarray, " p"]
    phi_weights: Float[np.ndarray, " p"]


def sky_grid(
    theta_sun: Float[Array, ""], degree: int, *, symmetric: bool, refine: int = 1
) -> SkyGrid:
    """Of the hemisphere z > 0 for a sun at (θ_s, φ = 0) or, for θ_s > π/2, the point opposite.

    Fine enough for a sky times harmonics of `degree`. `symmetric` leaves one half, φ in [0, π],
    with doubled weights. `refine` divides the steps, to measure the error by.
    """
    theta_step = _THETA_STEP / refine * min(1, 30 / max(degree, 1))
    node, weight = (jnp.asarray(t, theta_sun.dtype) for t in tanh_sinh(theta_step))
    split = jnp.minimum(theta_sun, np.pi - theta_sun)
    rest = np.pi / 2 - split
    theta = jnp.concatenate([split * node, split + rest * node])
    theta_weights = jnp.concatenate([split * weight, rest * weight]) * jnp.sin(theta)
    phi, phi_weights = np.pi * np.stack(tanh_sinh(_PHI_STEP / refine * min(1, 10 / max(degree, 1))))
    if symmetric:
        return SkyGrid(theta, theta_weights, phi, 2 * phi_weights)
    both = np.concatenate([phi, -phi]), np.concatenate([phi_weights, phi_weights])
    return SkyGrid(theta, theta_weights, *both)


@read_only_cache(maxsize=16)
def tanh_sinh(step: float) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """Takahasi and Mori's (1974) nodes and weights on [0, 1].

    The trapezoidal rule after x = (1 + tanh(π/2 sinh t))/2, out to where 1 - x is rounding.
    """
    count = round(_REACH / step)
    t = np.arange(-count, count + 1) * step
    bend = np.pi / 2 * np.sinh(t)
    node = 1 / (1 + np.exp(-2 * bend))
    weight = step * np.pi / 4 * np.cosh(t) / np.cosh(bend) ** 2
    return node, weight
