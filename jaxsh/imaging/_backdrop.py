"""Lat-long environments seen along directions, and behind what a camera sees."""

import functools

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._core.checks import check_type
from .._core.host import put
from .._core.known import host_known, is_concrete
from .._core.pictures import as_picture, as_radiance, check_values
from .._core.xla import keep_rows, rounded_once
from ._camera import Camera, host_rays


def look_up(
    environment: Float[Array, "height width c"], directions: Float[Array, "*shape 3"]
) -> Float[Array, "*shape c"]:
    """Look up the radiance of a lat-long picture along directions: bilinear, wrapped in φ.

    `environment` (height, width, c) and directions (..., 3) give (..., c) in the dtype of
    `environment`. Directions need no unit length, if their squares stay in range; zero is taken
    for +z. Between the outermost pixel centers and a pole the look-up runs to the mean of the
    outermost row, so that the pole has one value from all sides. Raises `ValueError` for wrong
    shapes, also of a picture that is less than 1.5 times as wide as high, for integers, and, on a
    CPU, for a picture with NaN or infinite values, at which it looks once.

    Linear and differentiable in `environment`; in the directions too, with kinks between pixels,
    where a slope is that of one side, and zero slope at the poles. Runs under `jit` and `vmap`;
    shards over the leading axis of the directions, where `environment` is whole on each device.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import imaging
    >>> up_and_front = jnp.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    >>> imaging.look_up(imaging.studio(16, 32), up_and_front).shape
    (2, 3)
    """
    environment = as_picture("environment", environment, lat_long=True)
    check_values("environment", environment)
    directions = as_radiance("directions", directions)
    if directions.ndim == 0 or directions.shape[-1] != 3:
        raise ValueError(
            f"expected directions (..., 3) with x, y, z last, got shape {directions.shape}"
        )
    return keep_rows(_look_up, environment, directions, like=directions, axis=0, out=0)


def backdrop(environment: Float[Array, "height width c"], camera: Camera) -> Float[Array, "h w c"]:
    """Show the environment as the camera sees it through its pixel centers, for `interpolate`.

    Gives (camera.height, camera.width, c) in the dtype of `environment`. Differentiable as
    `look_up`, in the environment and in the camera. Raises `ValueError` as it does.

    **Example**

    >>> from jaxsh import imaging
    >>> camera = imaging.Camera((0.0, -2.0, 0.0), (0.0, 0.0, 0.0), width=6, height=4)
    >>> imaging.backdrop(imaging.studio(16, 32), camera).shape
    (4, 6, 3)
    """
    check_type("camera", camera, Camera)
    environment = as_picture("environment", environment, lat_long=True)
    check_values("environment", environment)
    known = host_known(environment, camera.position, camera.target, camera.up)
    if known and is_concrete(camera.fov_y):  # a program less to compile
        directions = put(host_rays(camera)[1].reshape(camera.height, camera.width, 3))
    else:
        directions = camera.rays()[1].reshape(camera.height, camera.width, 3)
    return look_up(environment, directions)


@jax.jit
def _look_up(environment, directions):
    height, width, _ = environment.shape
    row, column = rounded_once(functools.partial(_place, height, width), directions)
    i, j = jnp.floor(row), jnp.floor(column)
    down = (row - i).astype(environment.dtype)[..., None]
    right = (column - j).astype(environment.dtype)[..., None]
    i = jnp.clip(i.astype(jnp.int32), -1, height - 1)
    left = j.astype(jnp.int32) % width
    upper, lower = (
        environment[k, left] * (1 - right) + environment[k, (left + 1) % width] * right
        for k in (jnp.maximum(i, 0), jnp.minimum(i + 1, height - 1))
    )
    # Beyond the edge so much that half-way, on the pole, all columns meet in their mean.
    edges = jnp.stack([environment[0], environment[-1]])
    ends = 2 * jnp.mean(edges, axis=1).reshape(2, *(1,) * (lower.ndim - 1), edges.shape[-1])
    i = i[..., None]
    upper = jnp.where(i < 0, ends[0] - lower, upper)
    lower = jnp.where(i == height - 1, ends[1] - upper, lower)
    return upper * (1 - down) + lower * down


def _place(height: int, width: int, directions):
    """Row and column of each direction, counted in pixels from the center of the first."""
    dtype = directions.dtype
    x, y, z = (directions[..., axis] for axis in range(3))
    squared = x * x + y * y
    aside = squared > 0  # on the poles the angles have no derivative
    safe = jnp.where(aside, squared, 1)
    theta = jnp.arctan2(jnp.where(aside, jnp.sqrt(safe), 0), jnp.where(aside, z, 1))
    theta = jnp.where(aside, theta, jnp.where(z < 0, jnp.asarray(jnp.pi, dtype), 0))
    phi = jnp.arctan2(jnp.where(aside, y, 0), jnp.where(aside, x, 1))
    return jnp.clip(theta / jnp.pi, 0, 1) * height - 0.5, (phi / (2 * jnp.pi)) % 1 * width - 0.5
