"""Coefficients of the light of a sphere, in closed form, and their gradient."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import align, as_finite, check_degree, check_type, check_vectors
from .._core.known import is_concrete
from ..harmonics import degrees, evaluate, evaluate_with_gradient
from ._emitters import Sphere
from ._vectors import inverse_power


def sphere_harmonics(
    sphere: Sphere, point: Float[ArrayLike, "*batch 3"], degree: int
) -> Float[Array, "*batch 3 k"]:
    """Compute the coefficients ∫ L y_i dω of a sphere's light at a point, exactly.

    It is seen as a cap around ω = s/d, s = center - point, with z = cos α = √(1 - R²/d²). By the
    theorem of Funk and Hecke c_lm = L b_l y_lm(ω), where b_l = 2π ∫_z^1 P_l, which is
    2π (1 - z²) P_l'(z)/(l(l+1)), and 2π (1 - z²)/(1 + z) for l = 0: no digit is lost far away.

    `point` is (..., 3), `degree` known at trace time. Returns (..., 3, K) in the dtype of
    `point`. Differentiable in all of the sphere and in the point, forward and reverse; at the
    surface, where the sphere fills half of the sky, the slope is infinite.

    Raises `ValueError` for shapes that do not fit and, where values are known, for a point that
    is not finite or inside the sphere; where they are not known, one inside gives NaN.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> ball = midrange.Sphere(jnp.array([0.0, 0, 2]), jnp.array(0.5), jnp.ones(3))
    >>> c = midrange.sphere_harmonics(ball, jnp.zeros(3), degree=1)
    >>> c.shape, round(float(c[0, 0]), 3)
    ((3, 4), 0.056)
    """
    return _light(sphere, point, degree, False)[0]


def sphere_harmonics_with_gradient(
    sphere: Sphere, point: Float[ArrayLike, "*batch 3"], degree: int
) -> tuple[Float[Array, "*batch 3 k"], Float[Array, "*batch 3 k 3"]]:
    """Compute the coefficients of `sphere_harmonics` and their gradient d/d point, together.

    ∇c = L (y ∇b_l - b_l ∇_s y), where ∇b_l = 2π P_l(z) R²/(d³ z) ω. Returns (..., 3, K) and
    (..., 3, K, 3).

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> ball = midrange.Sphere(jnp.array([0.0, 0, 2]), jnp.array(0.5), jnp.ones(3))
    >>> c, gradient = midrange.sphere_harmonics_with_gradient(ball, jnp.zeros(3), degree=1)
    >>> c.shape, gradient.shape
    ((3, 4), (3, 4, 3))
    """
    return _light(sphere, point, degree, True)


def _light(sphere: Sphere, point, degree, gradient: bool):
    check_type("sphere", sphere, Sphere)
    point = as_finite(point, "point")
    check_vectors("point", point)
    center, radius, radiance = (
        x.astype(point.dtype) for x in (sphere.center, sphere.radius, sphere.radiance)
    )
    if all(is_concrete(x) for x in (point, center, radius)):
        distance = np.linalg.norm(np.asarray(point, np.float64) - np.asarray(center), axis=-1)
        inside = int((distance < np.asarray(radius)).sum())
        if inside:
            raise ValueError(f"{inside} points are inside the sphere, where it emits no light")
    return _compiled(center, radius, radiance, point, check_degree(degree), gradient)


@functools.partial(jax.jit, static_argnums=(4, 5))
def _compiled(center, radius, radiance, point, degree: int, gradient: bool):
    center = center.reshape((1,) * (point.ndim - 1) + (3,))
    inverse = inverse_power(radius)  # no square of a length leaves the range of floats
    s, radius = (center - point) * inverse, radius * inverse
    squared = jnp.sum(s * s, axis=-1)
    sine = radius * radius / squared  # squared
    sine = jnp.where(sine <= 1, sine, jnp.nan)
    z = jnp.sqrt(1 - sine)
    bands, slopes = _bands(z, sine, degree)
    l = degrees(degree)
    if not gradient:
        return (_colored(radiance, bands[..., l] * evaluate(s, degree), -1),)
    basis, turn = evaluate_with_gradient(s, degree)
    # d z/d p = -R²/(d⁴ z) s
    pull = (-sine / (squared * z))[..., None] * s
    rise = (slopes[..., l] * basis)[..., None] * pull[..., None, :]
    change = (rise - bands[..., l][..., None] * turn) * inverse
    return _colored(radiance, bands[..., l] * basis, -1), _colored(radiance, change, -2)


def _colored(radiance: Float[Array, " 3"], light: Array, axis: int) -> Array:
    """An axis of channels before `axis`."""
    color = radiance.reshape(3, *(1,) * -axis)
    return jnp.multiply(*align(color, jnp.expand_dims(light, axis - 1)))


def _bands(z: Float[Array, "*batch"], sine: Float[Array, "*batch"], degree: int):
    """b_l and db_l/dz = -2π P_l(z), (..., degree + 1) each, by Bonnet's recursions."""
    p = [jnp.ones_like(z), z]
    slope = [jnp.zeros_like(z), jnp.ones_like(z)]
    for l in range(2, degree + 1):
        p.append(((2 * l - 1) * z * p[-1] - (l - 1) * p[-2]) / l)
        slope.append(((2 * l - 1) * z * slope[-1] - l * slope[-2]) / (l - 1))
    b = [sine / (1 + z)] + [sine * slope[l] / (l * (l + 1)) for l in range(1, degree + 1)]
    count = degree + 1
    return 2 * np.pi * jnp.stack(b, axis=-1), -2 * np.pi * jnp.stack(p[:count], axis=-1)
