"""A knot of tiles, written as a GLB: nothing with a texture is in the data."""

import dataclasses
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from jaxtyping import UInt8

from jaxsh import geometry

_TIMES = (9, 2)  # the picture repeats along the pipe and around it


def write_glb(path: Path, vertices: int, size: int) -> Path:
    """A knot with UV, of about that many vertices, and a texture of size × size."""
    plain = geometry.knot(vertices)
    # Its vertices are a grid, closed both ways; UV need the first row and column a second time.
    around = int(np.asarray(plain.faces)[0, 1])
    along = len(plain.vertices) // around
    i, j = np.meshgrid(np.arange(along + 1), np.arange(around + 1), indexing="ij")
    same = (i % along * around + j % around).ravel()
    uv = np.stack([i / along * _TIMES[0], j / around * _TIMES[1]], axis=-1).reshape(-1, 2)
    corner = (np.arange(along)[:, None] * (around + 1) + np.arange(around)).ravel()
    across = corner + around + 2
    faces = [(corner, corner + around + 1, across), (corner, across, corner + 1)]
    grid = np.concatenate([np.stack(face, axis=1) for face in faces]).astype(np.int32)
    mesh = dataclasses.replace(
        plain,
        vertices=jnp.asarray(np.asarray(plain.vertices)[same]),
        normals=jnp.asarray(np.asarray(plain.normals)[same]),
        faces=jnp.asarray(grid),
        uv=jnp.asarray(uv, jnp.float32),
        face_material=jnp.zeros(len(grid), jnp.int32),
        materials=(geometry.BaseColor("tiles", (0.9, 0.9, 0.9, 1.0), tiles(size)),),
    )
    return geometry.write_mesh(path, mesh)


def tiles(size: int) -> UInt8[np.ndarray, "size size 4"]:
    """Tiles in two glazes: one is blue to green from left to right, one orange, redder below."""
    y, x = (np.mgrid[:size, :size] + 0.5) / size
    orange = (np.floor(4 * x) + np.floor(4 * y)) % 2
    blue = np.stack([0.25 + 0 * x, 0.3 + 0.5 * x, 0.75 - 0.3 * x], axis=-1)
    other = np.stack([0.9 + 0 * x, 0.65 - 0.3 * y, 0.2 + 0.2 * y], axis=-1)
    color = np.where(orange[..., None] == 1, other, blue)
    grout = (np.abs(4 * x % 1 - 0.5) > 0.47) | (np.abs(4 * y % 1 - 0.5) > 0.47)
    color[grout] = 0.85
    return np.round(255 * np.concatenate([color, np.ones((size, size, 1))], axis=-1)).astype("u1")
