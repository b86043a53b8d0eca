"""Exact projection of a sky: coefficients of the hemisphere's radiance for given suns."""

import functools
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import check_batches, check_degree, check_flag, check_function
from .._core.host import read_only_cache
from .._core.linalg import einsum, in_full
from ..harmonics import degrees, evaluate, orders, rotate_z
from ._angles import directions, each_sun, parameter, unit
from ._color import Space, check_space
from ._preetham import Constants, preetham_constants, preetham_radiance
from ._validity import Check, check_option, check_sun, check_turbidity

Model = Callable[..., Array]

# The quadrature knows where a sky is not smooth. Radiance has a cone at the sun, another at the
# antisolar point, and exp(B/cos θ) cannot be expanded at the horizon. In the frame with the sun at
# azimuth 0 all of these are ends of three intervals: θ in [0, θ_s] and [θ_s, π/2], φ in [0, π].
# Tanh–sinh nodes crowd doubly exponentially towards both ends of each, whatever singularity is
# there, which takes a sixth of the nodes of Gauss–Legendre panels graded to the same points for
# the same error. Steps that reach 1e-13 of the norm for Preetham's sky, and how far the
# trapezoidal rule goes:
_THETA_STEP, _PHI_STEP = 0.06, 0.08
_REACH = 3.3

# Suns in one call on an accelerator: about 18,000 views of each, a few gigabytes of float32.
_MOST = 1024


# The model's own products too.
@in_full
def project(
    model: Model,
    sun: Float[ArrayLike, "*suns 3"],
    *parameters: Float[ArrayLike, "..."],
    degree: int = 6,
    symmetric: bool = False,
) -> Float[Array, "*out channels k"]:
    """Coefficients of any sky, integrated over the upper hemisphere: (..., C, K).

    **Arguments**

    - `model`: `model(view, sun, *parameters)` with view (n, 3) and sun (3,) unit vectors and
      each parameter a scalar gives radiance (n, C). It is traced; pass the same function object
      to have it compiled once.
    - `sun`: (..., 3), of any length; `parameters`: (...) each. Batches broadcast. Differentiable
      in all, the zenith included.
    - `symmetric`: promise that the sky is its own mirror image in the plane of sun and zenith.
      Half of the work, and with the sun at azimuth 0 the coefficients with m < 0 are exactly
      zero. What the model closes over can then not be differentiated: pass it as a parameter.

    The quadrature is graded to the sun, the antisolar point and the horizon (tanh–sinh nodes).
    Preetham's sky is right to 1e-12 of the norm in float64, tested to degree 32; a sky with
    other edges, clouds for one, wants a quadrature of its own. The lower hemisphere is dark: see
    `with_ground`. On the CPU one sun after the other, on an accelerator many at once.

    **Example**

    >>> import jax.numpy as jnp
    >>> import numpy as np
    >>> from jaxsh import sky
    >>> def glow(view, sun, haze):
    ...     return jnp.exp(haze * (view @ sun))[:, None]
    >>> sky.project(glow, np.array([0.6, 0.0, 0.8]), 1.5, degree=1, symmetric=True).shape
    (1, 4)
    """
    check_function("model", model)
    symmetric, sun = check_flag("symmetric", symmetric), directions(sun, "sun")
    numbers = tuple(parameter(p, sun.dtype, f"parameter {i + 1}") for i, p in enumerate(parameters))
    shapes = {f"parameter {i + 1}": (*p.shape, 1) for i, p in enumerate(numbers)}
    check_batches(sun=sun.shape, **shapes)
    return _project(sun, numbers, model, check_degree(degree), symmetric)


def project_preetham(
    sun: Float[ArrayLike, "*suns 3"],
    turbidity: Float[ArrayLike, "*turbidities"],
    degree: int = 6,
    *,
    constants: Constants = "paper",
    space: Space = "srgb",
    check: Check = "raise",
) -> Float[Array, "*out 3 k"]:
    """Coefficients of Preetham's sky without the sun's disc: (..., 3, K), kcd/m².

    Exact: relative error below 1e-12 in float64 (see `project`). Arguments as for
    `preetham_radiance`; `check` looks at sun and turbidity. Batches broadcast; differentiable in
    both, the zenith included, where the model has a kink (see `preetham_radiance`).

    With the sun at azimuth 0 the coefficients with m < 0 are exactly zero.

    **Example**

    >>> import numpy as np
    >>> from jaxsh import sky
    >>> light = sky.project_preetham(np.array([0.6, 0.0, 0.8]), 3.0, 1)
    >>> light.shape, bool((light[:, 1] == 0).all())
    ((3, 4), True)
    """
    preetham_constants(constants)
    check_space(space)
    check_option(check)
    sun = directions(sun, "sun")
    turbidity = parameter(turbidity, sun.dtype, "turbidity")
    check_batches(sun=sun.shape, turbidity=(*turbidity.shape, 1))
    check_turbidity(turbidity, check)
    check_sun(sun, check)
    model = _preetham(constants, space)
    return project(model, sun, turbidity, degree=degree, symmetric=True)


@functools.cache
def _preetham(constants: Constants, space: Space) -> Model:
    return functools.partial(preetham_radiance, constants=constants, space=space, check="allow")


@functools.partial(jax.jit, static_argnums=(2, 3, 4))
def _project(sun, numbers, model: Model, degree: int, symmetric: bool):
    one = functools.partial(_mirrored if symmetric else _whole, model, degree)
    return each_sun(one, sun, *numbers, size=1, most=_MOST)


def _whole(model, degree, sun, *parameters):
    return _integrate(model, degree, sun, parameters, symmetric=False)


@functools.partial(jax.custom_jvp, nondiff_argnums=(0, 1))
def _mirrored(model, degree, sun, *parameters):
    return _integrate(model, degree, sun, parameters, symmetric=True)


@_mirrored.defjvp
def _mirrored_jvp(model, degree, primals, tangents):
    # A sun that leaves the plane breaks the symmetry: derivatives need both halves.
    return jax.jvp(functools.partial(_whole, model, degree), primals, tangents)


def _integrate(model, degree, sun, parameters, *, symmetric: bool, refine: int = 1):
    """Coefficients (C, K) for one sun (3,) and scalar parameters.

    Where the nodes stand is a choice and carries no derivative: that of the integral is the
    integral of the derivative. So the sun's azimuth is never differentiated, which at the zenith
    has no derivative.
    """
    fixed = jax.lax.stop_gradient(sun)
    azimuth = jnp.atan2(fixed[1], fixed[0])
    theta_sun = jnp.atan2(jnp.sqrt(fixed[0] ** 2 + fixed[1] ** 2), fixed[2])
    grid = sky_grid(theta_sun, degree, symmetric=symmetric, refine=refine)
    sin_theta, cos_theta = jnp.sin(grid.theta)[:, None], jnp.cos(grid.theta)[:, None]
    cos_phi, sin_phi = jnp.cos(azimuth), jnp.sin(azimuth)
    ahead, aside = (jnp.asarray(f(grid.phi), sun.dtype)[None] * sin_theta for f in (np.cos, np.sin))
    views = jnp.stack(
        [
            cos_phi * ahead - sin_phi * aside,
            sin_phi * ahead + cos_phi * aside,
            jnp.broadcast_to(cos_theta, ahead.shape),
        ],
        axis=-1,
    )
    views = views.reshape(-1, 3)
    values = model(views, unit(sun), *parameters)
    if values.ndim != 2 or len(values) != len(views):
        raise ValueError(
            f"a model must return radiance (n, channels) for n = {len(views)} views, got shape "
            f"{values.shape}"
        )
    moments = _along_azimuth(values.reshape(*ahead.shape, -1), grid, degree, symmetric)
    profiles = _profiles(grid.theta, degree) * grid.theta_weights[None]
    coefficients = einsum("tck,kt->ck", moments, profiles)
    return rotate_z(coefficients, azimuth)


def _along_azimuth(values, grid, degree: int, symmetric: bool):
    """Moments ∫ f(θ, φ) cos mφ dφ or, for m < 0, sin |m|φ: (T, P, C) -> (T, C, K)."""
    m = np.arange(-degree, degree + 1)[:, None]
    sine = np.zeros_like(grid.phi)[None] if symmetric else np.sin(-m * grid.phi)
    waves = np.where(m < 0, sine, np.cos(m * grid.phi)) * grid.phi_weights
    waves = jnp.asarray(waves, values.dtype)
    moments = einsum("tpc,mp->tcm", values, waves)
    return moments[..., orders(degree) + degree]


def _profiles(theta: Float[Array, " t"], degree: int) -> Float[Array, "k t"]:
    """Values of y_l|m| on the meridian φ = 0, where it is its own amplitude."""
    zero = jnp.zeros_like(theta)
    basis = evaluate(jnp.stack([jnp.sin(theta), zero, jnp.cos(theta)], axis=-1), degree, axis=0)
    l, m = degrees(degree), orders(degree)
    return basis[l * (l + 1) + np.abs(m)]


class SkyGrid(NamedTuple):
    """Tensor grid: Σ_t Σ_p theta_weights_t phi_weights_p f(theta_t, phi_p) ≈ ∫ f dω."""

    theta: Float[Array, " t"]
    theta_weights: Float[Array, " t"]  # with the factor sin θ
    phi: Float[np.ndarray, " p"]
    phi_weights: Float[np.ndarray, " p"]


def sky_grid(
    theta_sun: Float[Array, ""], degree: int, *, symmetric: bool, refine: int = 1
) -> SkyGrid:
    """Grid of the hemisphere z > 0 for a sun at (θ_s, φ = 0) or, for θ_s > π/2, opposite to it.

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
