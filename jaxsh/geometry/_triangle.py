"""Intersection of a ray with a triangle, without a crack between two that share an edge."""

import functools

import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Bool, Float


def meet(
    corners: Float[Array, "n 9"], origin: Float[Array, "3 n"], direction: Float[Array, "3 n"]
) -> tuple[Bool[Array, " n"], Float[Array, " n"], list[Float[Array, " n"]]]:
    """Tell whether each line meets its triangle, at which distance, and the barycentric weights.

    Woop, Benthin & Wald 2013: shear space so that the ray runs along one axis from the origin and
    ask on which side of each edge the origin lies. Signs are comparisons of two products, not
    signs of a difference, for a compiler may round one product of a difference and not the other
    (FMA), and differently for the two faces of an edge. An origin on an edge lies on both sides,
    so that the paper's second test in double precision is not needed.

    The distance may be negative, and is in lengths of the direction. A triangle seen edge-on is
    not met.
    """
    size = jnp.abs(direction)
    x_leads, y_leads = size[0] >= jnp.maximum(size[1], size[2]), size[1] >= size[2]

    def turned(v: list[Array] | Array) -> list[Array]:
        """Coordinates in cyclic order such that the ray runs mostly along the last."""
        orders = [(v[(i + 1) % 3], v[(i + 2) % 3], v[i]) for i in range(3)]
        return [jnp.where(x_leads, x, jnp.where(y_leads, y, z)) for x, y, z in orders]

    dx, dy, dz = turned(direction)
    sheared = []
    for corner in range(3):
        x, y, z = turned([corners[:, 3 * corner + i] - origin[i] for i in range(3)])
        sheared.append((x - dx / dz * z, y - dy / dz * z, z / dz))
    # A corner is rounded once, however many edges use it.
    sheared = lax.optimization_barrier(sheared)

    sides = []  # of the edge across from each corner
    for corner in range(3):
        (x0, y0, _), (x1, y1, _) = sheared[(corner + 1) % 3], sheared[(corner + 2) % 3]
        sides.append((x0 * y1, y0 * x1))
    inside = functools.reduce(jnp.logical_and, [left >= right for left, right in sides])
    inside |= functools.reduce(jnp.logical_and, [left <= right for left, right in sides])
    areas = [jnp.abs(left - right) for left, right in sides]
    total = functools.reduce(jnp.add, areas)
    broad = total > 0
    weights = [area / jnp.where(broad, total, 1) for area in areas]
    distances = [w * z for w, (_, _, z) in zip(weights, sheared, strict=True)]
    return inside & broad, functools.reduce(jnp.add, distances), weights
