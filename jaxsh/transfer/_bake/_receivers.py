"""Receivers of light: points off the surface, their normals, their unshadowed coefficients."""

import math
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from ...geometry import Mesh, Surface
from ...harmonics import clamped_cosine, convolve, evaluate
from ...harmonics._polynomials import solid_rows

# Faces cancel where the sum of their area vectors is but the rounding of its terms.
_CANCELLED = 8 * np.finfo(np.float32).eps
_UP = np.array([0, 0, 1])


class Receivers(NamedTuple):
    """Holds V points that gather light (NumPy arrays)."""

    origins: Float[np.ndarray, "v 3"]  # of rays, a little off the surface
    normals: Float[np.ndarray, "v 3"]  # unit, zero where undefined
    cosine: bool = True  # False: light from all around counts alike


class Faces(NamedTuple):
    """Holds the faces that light bounces off."""

    faces: Int[np.ndarray, "f 3"]
    outward: Float[np.ndarray, "f 3"]  # normals of any length


def faces_of(mesh: Mesh) -> Faces:
    """Take the mesh's faces, with their outward normals."""
    faces = np.asarray(mesh.faces)
    return Faces(faces, areas_of(np.asarray(mesh.vertices), faces).T)


def unshadowed(normals: Float[Array, "m 3"], degree: int, cosine: bool) -> Float[Array, "m k"]:
    """Give the coefficients of points on which nothing casts a shadow; see `expanded`."""
    defined = jnp.any(normals != 0, axis=1, keepdims=True)
    up = jnp.asarray(_UP, normals.dtype)[None]
    return expanded(normals, evaluate(jnp.where(defined, normals, up), degree), cosine=cosine)


def expanded(
    normals: Float[Array, "m 3"], basis: Float[Array, "m k"], *, cosine: bool
) -> Float[Array, "m k"]:
    """Expand the clamped cosine about each unit normal: λ_l y_lm(n), zero about a zero normal.

    `basis` is y_lm(n). Without cosine the whole sphere, whose only coefficient is √4π.
    """
    if cosine:
        exact = convolve(basis, clamped_cosine(math.isqrt(basis.shape[1]) - 1))
    else:
        whole = np.zeros((1, basis.shape[1]))
        whole[0, 0] = math.sqrt(4 * math.pi)
        exact = jnp.asarray(whole, normals.dtype)
    return jnp.where(jnp.any(normals != 0, axis=1, keepdims=True), exact, 0)


def basis_at(vectors: Float[np.ndarray, "n 3"], degree: int) -> Float[np.ndarray, "n k"]:
    """Evaluate y_i at each unit vector, in NumPy and in double precision: no program to compile."""
    x, y, z = vectors.T.astype(np.float64)
    rows = solid_rows(x, y, z, degree)
    return np.stack(rows, axis=-1).astype(vectors.dtype)


def unit_normals(mesh: Mesh) -> Float[np.ndarray, "v 3"]:
    """Scale the mesh's normals to unit length; undefined ones become zero.

    Undefined are those that are zero, NaN or infinite, and those of a vertex whose faces cancel, so
    that the mean of their normals is rounding. A vertex in no face keeps the normal that it has.
    """
    return _at_unit_length(np.asarray(mesh.normals), but=_cancelled(mesh))


def units_of(surface: Surface) -> Float[np.ndarray, "v 3"]:
    """Scale a surface's normals to unit length; any unit vectors stand in for those of a volume."""
    if isinstance(surface, Mesh):
        return unit_normals(surface)
    if surface.normals is None:
        return np.tile(_UP.astype(surface.positions.dtype), (surface.num_points, 1))
    return _at_unit_length(np.asarray(surface.normals), but=np.zeros(surface.num_points, bool))


def _at_unit_length(
    normals: Float[np.ndarray, "v 3"], but: Bool[np.ndarray, " v"]
) -> Float[np.ndarray, "v 3"]:
    with np.errstate(invalid="ignore"):
        # Very long or short ones would leave the range of numbers when squared. By columns, which
        # takes NumPy a fraction of the time of reductions over three.
        x, y, z = np.abs(normals.T)
        largest = np.maximum(np.maximum(x, y), z)[:, None]
        normals = np.ldexp(normals, -np.frexp(largest)[1])
        length = _lengths(normals.T)[:, None]
    defined = np.isfinite(length) & (length > 0) & ~but[:, None]
    return np.where(defined, normals / np.where(defined, length, 1), 0).astype(normals.dtype)


def _cancelled(mesh: Mesh) -> Bool[np.ndarray, " v"]:
    vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces)
    areas = areas_of(unit_size(vertices), faces)

    def around(values: np.ndarray) -> np.ndarray:
        sums = (np.bincount(faces[:, k], values, minlength=len(vertices)) for k in range(3))
        return sum(sums, np.zeros(len(vertices)))

    size = around(_lengths(areas))
    total = np.stack([around(areas[axis]) for axis in range(3)])
    return (size > 0) & (_lengths(total) <= _CANCELLED * size)


def unit_size(vertices: Float[np.ndarray, "v 3"]) -> Float[np.ndarray, "v 3"]:
    """Scale to unit extent, so that no product of three lengths leaves the range of numbers."""
    return vertices / (np.ptp(vertices, axis=0).max(initial=0) or 1)


def areas_of(
    vertices: Float[np.ndarray, "v 3"], faces: Int[np.ndarray, "f 3"]
) -> Float[np.ndarray, "3 f"]:
    """Compute twice the area of each face, along its normal; float64.

    A coordinate's numbers lie side by side, for which NumPy takes a third of the time.
    """
    points = np.ascontiguousarray(vertices.T, np.float64)
    first, *others = (np.take(points, faces[:, corner], axis=1) for corner in range(3))
    (x, y, z), (u, v, w) = (other - first for other in others)
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u])


def _lengths(vectors: Float[np.ndarray, "3 n"]) -> Float[np.ndarray, " n"]:
    x, y, z = vectors
    return np.sqrt(x * x + y * y + z * z)
