"""What gathers light: points off the surface and their normals, with what is wrong about them."""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from ..geometry import Mesh
from ..harmonics import clamped_cosine, convolve, evaluate, num_coefficients

# Faces cancel where the sum of their area vectors is but the rounding of its terms.
_CANCELLED = 8 * np.finfo(np.float32).eps
_UP, _BLOCK = np.array([0, 0, 1]), 1024


class Receivers(NamedTuple):
    """V points that light may reach, with the way they face (NumPy arrays)."""

    origins: Float[np.ndarray, "v 3"]  # of rays, a little off the surface; float32
    normals: Float[np.ndarray, "v 3"]  # unit, zero where undefined


class Surface(NamedTuple):
    """What light bounces off."""

    faces: Int[np.ndarray, "f 3"]
    outward: Float[np.ndarray, "f 3"]  # normals of any length


def surface(mesh: Mesh) -> Surface:
    faces = np.asarray(mesh.faces)
    return Surface(faces, _areas(np.asarray(mesh.vertices, np.float64)[faces]))


def receivers(mesh: Mesh, offset: float) -> Receivers:
    """The mesh's vertices, moved along their normals by `offset` half-extents."""
    vertices, normals = np.asarray(mesh.vertices), unit_normals(mesh)
    half_extent = np.ptp(vertices, axis=0).max() / 2
    return Receivers((vertices + offset * half_extent * normals).astype(np.float32), normals)


def unshadowed(normals: Float[np.ndarray, "v 3"], degree: int) -> Float[np.ndarray, "v k"]:
    """Coefficients λ_l y_lm(n) of the clamped cosine about each normal, zero about a zero one."""
    defined = normals.any(axis=1, keepdims=True)
    basis = basis_at(np.where(defined, normals, _UP.astype(normals.dtype)), degree)
    lambdas = np.asarray(_cosine_lambdas(degree), basis.dtype)
    return np.where(defined, basis * lambdas, 0)


def basis_at(vectors: Float[np.ndarray, "n 3"], degree: int) -> Float[np.ndarray, "n k"]:
    """y_i at each vector, block by block: one compiled program serves any number of them."""
    blocks = -(-len(vectors) // _BLOCK)
    padded = np.tile(_UP.astype(vectors.dtype), (blocks * _BLOCK, 1))
    padded[: len(vectors)] = vectors
    basis = [evaluate(jnp.asarray(block), degree) for block in padded.reshape(blocks, _BLOCK, 3)]
    return np.concatenate(basis)[: len(vectors)]


@functools.partial(jax.jit, static_argnums=0)
def _cosine_lambdas(degree: int) -> Float[Array, " k"]:
    return convolve(jnp.ones(num_coefficients(degree)), clamped_cosine(degree))


def unit_normals(mesh: Mesh) -> Float[np.ndarray, "v 3"]:
    """The mesh's normals at unit length, and zero where they say nothing.

    That is where they are zero, NaN or infinite, and where a vertex's faces cancel, so that the
    mean of their normals is rounding. A vertex in no face keeps the normal that it has.
    """
    normals = np.asarray(mesh.normals)
    with np.errstate(invalid="ignore"):
        length = np.linalg.norm(normals, axis=1, keepdims=True)
    defined = np.isfinite(length) & (length > 0) & ~_cancelled(mesh)[:, None]
    return np.where(defined, normals / np.where(defined, length, 1), 0).astype(normals.dtype)


def _cancelled(mesh: Mesh) -> Bool[np.ndarray, " v"]:
    vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces)
    areas = _areas(vertices[faces])

    def around(values: np.ndarray) -> np.ndarray:
        return np.bincount(faces.ravel(), np.repeat(values, 3), minlength=len(vertices))

    size = around(np.linalg.norm(areas, axis=1))
    total = np.stack([around(areas[:, axis]) for axis in range(3)], axis=1)
    return (size > 0) & (np.linalg.norm(total, axis=1) <= _CANCELLED * size)


def _areas(corners: Float[np.ndarray, "f 3 3"]) -> Float[np.ndarray, "f 3"]:
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
