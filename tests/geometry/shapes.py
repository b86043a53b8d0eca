"""Shapes with known answers, for the tests of geometry."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from jaxsh.geometry import Mesh, _cast, make_mesh

TETRAHEDRON = (
    np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32),
    np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32),
)
QUAD = (  # the unit square in z = 0, facing +z
    np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32),
    np.array([[0, 1, 2], [0, 2, 3]], np.int32),
)


def square(scale=(1.0, 1.0), offset=(0.0, 0.0)) -> Mesh:
    """The unit square whose UV are x and y, scaled and moved."""
    mesh = make_mesh(*QUAD)
    uv = QUAD[0][:, :2] * np.asarray(scale, np.float32) + np.asarray(offset, np.float32)
    return dataclasses.replace(mesh, uv=jnp.asarray(uv))


def small_chunks():
    """Chunks of 2,048 rays on 256 lanes: less to compile for, and most calls take several.

    For a fixture; all files that use it share the programs.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_cast, "_LANES", {"cpu": 256})
        patch.setattr(_cast, "_CHUNK", 8)
        yield


def soup(rng) -> np.ndarray:
    """The corners of 60 triangles anywhere, each with its own: (180, 3)."""
    return (rng.normal(size=(60, 1, 3)) + 0.5 * rng.normal(size=(60, 3, 3))).reshape(-1, 3)


def sphere(rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """A unit sphere of two poles and a grid between them, wound outwards."""
    theta = np.arange(1, rows)[:, None] * np.pi / rows
    phi = np.arange(columns) * 2 * np.pi / columns
    ring = np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi], axis=-1
    )
    vertices = np.concatenate([[[0, 0, 1]], ring.reshape(-1, 3), [[0, 0, -1]]])
    i, j = np.meshgrid(np.arange(rows - 2), np.arange(columns), indexing="ij")
    a, b = 1 + i * columns + j, 1 + i * columns + (j + 1) % columns
    c, d = a + columns, b + columns
    j, last = np.arange(columns), len(vertices) - 1
    after = (j + 1) % columns
    faces = [
        np.stack(f, axis=-1).reshape(-1, 3)
        for f in (
            (a, c, d),
            (a, d, b),
            (0 * j, 1 + j, 1 + after),
            (last + 0 * j, last - columns + after, last - columns + j),
        )
    ]
    return vertices.astype(np.float32), np.concatenate(faces).astype(np.int32)


def first_hits(vertices, faces, origins, directions):
    """Möller–Trumbore in float64, every ray with every face: distance, face, barycentrics."""
    corners = np.asarray(vertices, np.float64)[faces]
    origins, directions = np.asarray(origins, np.float64), np.asarray(directions, np.float64)
    directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    edge1, edge2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = np.cross(directions[:, None], edge2)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1 / (p * edge1).sum(-1)
        s = origins[:, None] - corners[:, 0]
        u = (s * p).sum(-1) * inverse
        q = np.cross(s, edge1)
        v = (q * directions[:, None]).sum(-1) * inverse
        t = (q * edge2).sum(-1) * inverse
        t = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), t, np.inf)
    rays = np.arange(len(origins))
    face = t.argmin(axis=1)
    distance, u, v = t[rays, face], u[rays, face], v[rays, face]
    barycentric = np.stack([1 - u - v, u, v], axis=1)
    missed = np.isinf(distance)
    return distance, np.where(missed, -1, face), np.where(missed[:, None], 0, barycentric)
