"""The built-in mesh: a shape that shades itself, and needs no file."""

import math

import numpy as np

from .._core.checks import check_size
from ._make import make_mesh
from ._mesh import Mesh

# The curve winds _TURNS times around the axis of a torus of radius 1 and _COILS times around its
# tube of radius _SWING; a pipe of radius _PIPE follows it. Strands keep a gap between them.
_TURNS, _COILS, _SWING, _PIPE = 2, 3, 0.5, 0.34


def knot(vertices: int = 20_000) -> Mesh:
    """Make a thick trefoil knot: closed, smooth, concave, full of shadows that it casts on itself.

    Around `vertices` vertices (at least 300): the grid of m × n nearly square cells that comes
    closest, so m·n vertices and 2·m·n faces; the default has 20,020 and 40,040. It is one
    watertight surface of genus 1, wound outwards, within the unit ball around the origin. It
    stands upright (z up), flat side towards -y. Raises `ValueError` for fewer than 300.

    **Example**

    >>> from jaxsh import geometry
    >>> print(geometry.topology(geometry.knot(300)))
    300 vertices and 600 faces in 1 piece, closed, genus 1
    """
    if check_size("vertices", vertices) < 300:
        raise ValueError(f"a knot needs at least 300 vertices to be one, got {vertices}")
    # Sample the curve finely, then place rings at equal arc length.
    fine = np.linspace(0, 2 * math.pi, 20_001)
    curve, _ = _curve(fine)
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    around = max(round(math.sqrt(vertices * 2 * math.pi * _PIPE / length[-1])), 3)
    along = round(vertices / around)
    t = np.interp(np.arange(along) / along * length[-1], length, fine)

    # The torus gives a frame that closes: its normal at the curve, and what is square to both.
    center, outward = _curve(t)
    tangent = _unit(_curve(t + 1e-5)[0] - _curve(t - 1e-5)[0])
    outward = _unit(outward - (outward * tangent).sum(axis=1, keepdims=True) * tangent)
    side = np.cross(outward, tangent)
    angle = np.arange(around)[:, None] / around * 2 * math.pi
    ring = np.cos(angle) * outward[:, None] + np.sin(angle) * side[:, None]
    x, y, z = np.moveaxis((center[:, None] + _PIPE * ring).reshape(-1, 3), 1, 0)
    points = np.stack([x, -z, y], axis=1)  # the torus lies flat in x and y; stand it up
    points /= np.linalg.norm(points, axis=1).max() * (1 + 1e-6)

    i, j = np.meshgrid(np.arange(along), np.arange(around), indexing="ij")
    a, b = i * around + j, (i + 1) % along * around + j
    c, d = (i + 1) % along * around + (j + 1) % around, i * around + (j + 1) % around
    faces = np.concatenate([np.stack(f, axis=-1).reshape(-1, 3) for f in ((a, b, c), (a, c, d))])
    return make_mesh(points, faces)


def _curve(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Give points (n, 3) of the knot's center line, and the torus's normals there."""
    u, v = _TURNS * t, _COILS * t
    outward = np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], axis=1)
    ring = np.stack([np.cos(u), np.sin(u), np.zeros_like(u)], axis=1)
    return ring + _SWING * outward, outward


def _unit(x: np.ndarray) -> np.ndarray:
    return x / np.linalg.norm(x, axis=1, keepdims=True)
