"""Rectangular lights, and how they move."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._core.checks import check_type
from .._core.linalg import dot, matmul
from ..midrange import Polygon


class Rectangle(eqx.Module):
    """Rectangular light: center ± ½ width·(first axis) ± ½ height·(second axis).

    It emits `radiance` towards first × second axis. In a `Confidence` the deviations of each
    number; those of `axes` (2, 3) are of the rotation, in radians along the axes' own components.
    `vertices` (4, 3) run counter-clockwise seen from the side that emits; `polygon` is the same
    light for `midrange`. Differentiable in everything.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import inverse
    >>> axes = jnp.asarray([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    >>> lamp = inverse.Rectangle(jnp.zeros(3), axes, jnp.asarray([2.0, 4.0]), jnp.ones(3))
    >>> lamp.vertices.tolist()
    [[-1.0, -2.0, 0.0], [1.0, -2.0, 0.0], [1.0, 2.0, 0.0], [-1.0, 2.0, 0.0]]
    """

    center: Float[Array, " 3"]
    axes: Float[Array, "2 3"]
    size: Float[Array, " 2"]
    radiance: Float[Array, " 3"]

    @property
    def vertices(self) -> Float[Array, "4 3"]:
        u, v = self.axes * self.size[:, None] / 2
        corners = -u - v, u - v, u + v, v - u
        return jnp.stack([self.center + corner for corner in corners])

    @property
    def polygon(self) -> Polygon:
        return Polygon(self.vertices, self.radiance)


def rectangle_of(polygon: Polygon) -> Rectangle:
    """Converts a polygon of four vertices to the rectangle that it is, exactly where it is one.

    Elsewhere to a rectangle of the same center, with the mean lengths and directions of the sides.
    Differentiable. Raises `ValueError` for another number of vertices.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import inverse, midrange
    >>> corners = [[0.0, 0.0, 1.0], [0.0, 3.0, 1.0], [2.0, 3.0, 1.0], [2.0, 0.0, 1.0]]
    >>> lamp = inverse.rectangle_of(midrange.Polygon(jnp.asarray(corners), jnp.ones(3)))
    >>> lamp.center.tolist(), lamp.size.tolist()
    ([1.0, 1.5, 1.0], [3.0, 2.0])
    """
    check_type("polygon", polygon, Polygon)
    v = polygon.vertices
    if v.shape != (4, 3):
        raise ValueError(f"a rectangle has 4 vertices, got a polygon of {len(v)}")
    across, up = (v[1] + v[2] - v[0] - v[3]) / 2, (v[2] + v[3] - v[0] - v[1]) / 2
    width, height = jnp.linalg.norm(across), jnp.linalg.norm(up)
    first = across / width
    second = up / height - dot(first, up / height) * first
    axes = jnp.stack([first, second / jnp.linalg.norm(second)])
    return Rectangle(jnp.mean(v, axis=0), axes, jnp.stack([width, height]), polygon.radiance)


def moved(light: Rectangle, p: Float[Array, " p"]) -> Rectangle:
    """Moves a light by p: center in units of its size, logs of size and radiance, rotation."""
    size = light.size * jnp.exp(p[3:5])
    center = light.center + p[:3] * jnp.sqrt(light.size[0] * light.size[1])
    axes = light.axes if p.shape[0] == 8 else rotate(light.axes, p[8:])
    return Rectangle(center, axes, size, light.radiance * jnp.exp(p[5:8]))


def rotate(axes: Float[Array, "2 3"], q: Float[Array, " 3"]) -> Float[Array, "2 3"]:
    """Rotates by Cayley's rotation of the vector q: angle 2 arctan |q|/2, smooth everywhere."""
    half = q / 2
    squared = jnp.sum(half * half)
    crossed = jnp.cross(half[None], axes)
    along = matmul(axes, half)[:, None] * half[None]
    return ((1 - squared) * axes + 2 * along + 2 * crossed) / (1 + squared)
