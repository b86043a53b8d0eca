"""Places on a mesh that the texels of a picture show, by its UV."""

import warnings
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._core.checks import (
    as_float,
    check_faces,
    check_flag,
    check_known,
    check_size,
    check_type,
    described,
)
from .._core.host import put
from .._core.known import is_concrete
from .._core.linalg import einsum
from .._core.xla import keep_rows, rows_are_split
from ._atlas import Covered, barycentric, cover, nearest, places
from ._mesh import Mesh
from ._points import Points
from ._unwrap import unwrap as unwrapped

# Texels whose places are computed together.
_BLOCK = 1 << 20
# Largest picture: its texels are numbered in int32.
_MOST = 2**15


class Texels(eqx.Module):
    """Holds the places on a mesh that the texels of a picture show; made by `texels`.

    One row for each texel whose center a face covers, n of them, in the order of the picture: row
    by row, its top (v = 1) first. `face` and `barycentric` hold for the mesh that was given as well
    as for `mesh`: what the former has at its vertices, its own UV for instance, is at the texels
    `einsum("nkc,nk->nc", values[given.faces[texels.face]], texels.barycentric)`.

    **Example**

    >>> import dataclasses
    >>> import jax.numpy as jnp
    >>> import numpy as np
    >>> from jaxsh import geometry
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> square = geometry.make_mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    >>> square = dataclasses.replace(square, uv=square.vertices[:, :2])
    >>> held = geometry.texels(square, (8, 4))
    >>> held.shape, held.num_points
    ((4, 8), 32)
    >>> heights = held.carry(square.vertices[:, 1:2])
    >>> held.image(heights)[:, 0, 0].tolist()
    [0.875, 0.625, 0.375, 0.125]
    """

    positions: Float[Array, "n 3"]
    normals: Float[Array, "n 3"]  # of length 1, between those of the vertices
    uv: Float[Array, "n 2"]  # the texel's center; (0, 0) is the lower left of the picture
    face: Int[Array, " n"]
    barycentric: Float[Array, "n 3"]  # of the face's vertices
    source: Int[Array, "h w"]  # the row that each texel of the picture shows; -1 for none
    mesh: Mesh  # with the UV that were used
    vertex: Int[Array, " v"]  # of the mesh given: the one that each vertex of `mesh` is

    @property
    def num_points(self) -> int:
        """Number of texels that a face covers, n."""
        return self.face.shape[0]

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of the picture."""
        height, width = self.source.shape
        return height, width

    def carry(self, values: Float[Array, "v c"]) -> Float[Array, "n c"]:
        """Carry values at the vertices of `mesh` linearly over the faces to the texels.

        Values (v, c) at the vertices of the mesh given, where that had no UV, are
        `values[texels.vertex]` at those of `mesh`. Has the dtype of `values`.

        Differentiable in the values. Runs under `jit` and `vmap`. Shards over the texels, where
        values are whole on each device; values that are shared out by vertex are brought together.
        Raises `ValueError` for values of another shape or number.

        **Example**

        See `Texels`.
        """
        values = as_float(values, "values")
        count = self.mesh.vertices.shape[0]
        if values.ndim != 2 or values.shape[0] != count:
            raise ValueError(
                f"expected values ({count}, c), one row per vertex of texels.mesh, got shape "
                f"{values.shape}{self._instead(values)}"
            )
        return _carry(values, self.mesh.faces, self.face, self.barycentric)

    def _instead(self, values: Array) -> str:
        """Say how values at the mesh given are taken to `mesh`, where they may be those."""
        if values.ndim != 2 or not is_concrete(self.vertex):
            return ""
        least, most = int(np.max(np.asarray(self.vertex))) + 1, self.mesh.vertices.shape[0]
        given = least <= values.shape[0] < most
        return "; those of the mesh given are values[texels.vertex]" if given else ""

    def image(
        self, values: Float[Array, "n c"], background: float | Float[Array, " c"] = 0.0
    ) -> Float[Array, "h w c"]:
        """Put values at the texels into the picture, with its gutters filled.

        Values (n, c) give (h, w, c), its row 0 at v = 1: radiance to be written, or coefficients.
        `background`, a number or c of them, stands where no texel is near. Has the dtype of
        `values`.

        Differentiable in the values and the background. Runs under `jit` and `vmap`. Shards over
        the rows of `source`, where values are whole on each device; values that are shared out by
        texel are brought together for a picture whole on each device. Raises `ValueError` for
        values or a background of another shape.

        **Example**

        See `Texels`.
        """
        values, background = as_float(values, "values"), as_float(background, "background")
        if values.ndim != 2 or values.shape[0] != self.num_points:
            raise ValueError(
                f"expected values ({self.num_points}, c), one row per texel, got shape "
                f"{values.shape}"
            )
        behind = background.astype(values.dtype)
        if behind.shape not in ((), values.shape[1:]):
            raise ValueError(
                f"expected background as a number or {values.shape[1:]}, got shape {behind.shape}"
            )
        return _image(values, behind, self.source)


# What light can be asked for on.
Surface = Mesh | Points | Texels


def texels(
    mesh: Mesh,
    resolution: int | tuple[int, int],
    *,
    gutter: int = 2,
    unwrap: bool = False,
) -> Texels:
    """Find the places on a mesh that the texels of a picture show at their centers, by its UV.

    Light per texel is as fine as the picture, however coarse the mesh. A face too small for any
    center gets the texel that its middle lies in, where that is free. A mesh without UV is
    unwrapped by xatlas (the extra `xatlas`): cut into charts that are laid flat and packed with two
    gutters between them. That takes most of the time, and more than in proportion to the vertices:
    keep `Texels.mesh`, which has UV then.

    **Arguments**

    - `resolution`: of the picture: its side, or width and height.
    - `gutter`: the texels around what faces touch that show the nearest one with its center in a
      face, so that look-ups at a chart's rim mix in no background: 1 for bilinear ones, twice as
      many for each level of mip maps.
    - `unwrap`: True unwraps also a mesh that has UV: for those that overlap or repeat, as for
      textures. These textures stay with the mesh given, and are left out of `Texels.mesh`.

    **Returns** `Texels`; what is there in floats has the dtype of the mesh's vertices.

    Runs on the host, outside `jit`; same result whenever it is run. Not differentiable itself:
    `texels.carry(vertices)` are positions that differentiate.

    Raises `ValueError` for vertices that are not finite, for UV that overlap, that leave the
    picture by more than half a texel, or have no area at all, and where faces have none or xatlas's
    charts no room; and `ImportError` where xatlas is needed and missing. One `UserWarning` counts
    the faces without area in UV, which are on no texel, and charts too small to get one.

    **Example**

    >>> import dataclasses
    >>> import numpy as np
    >>> from jaxsh import geometry
    >>> triangle = geometry.make_mesh(np.eye(3), np.array([[0, 1, 2]]))
    >>> triangle = dataclasses.replace(triangle, uv=triangle.vertices[:, :2])
    >>> held = geometry.texels(triangle, 4, gutter=1)
    >>> held.source.tolist()
    [[0, 0, 2, -1], [1, 2, 2, 5], [3, 4, 5, 5], [6, 7, 8, 9]]
    """
    check_type("mesh", mesh, Mesh)
    width, height = _size(resolution)
    gutter = check_size("gutter", gutter, least=0)
    unwrap = check_flag("unwrap", unwrap)
    check_known("mesh", mesh)
    faces = np.asarray(mesh.faces)
    if not len(faces):
        raise ValueError("expected a mesh with faces, got one without")
    check_faces("the mesh", faces, mesh.vertices.shape[0])
    if bad := int((~np.isfinite(np.asarray(mesh.vertices)).all(axis=1)).sum()):
        raise ValueError(f"the mesh has {bad} NaN or infinite vertices; make_mesh drops such")
    vertex = np.arange(mesh.vertices.shape[0], dtype=np.int32)
    own = mesh.uv is not None and not unwrap
    if not own:
        mesh, vertex = unwrapped(mesh, width, height, gutter)
        faces = np.asarray(mesh.faces)
    uv = np.asarray(mesh.uv, np.float64)
    uv = np.where(np.isfinite(uv), uv, np.nan)  # one kind, of which NumPy says nothing
    corners = uv[faces]
    if own:
        _check_range(corners, width, height)
    # In texels, from the upper left.
    corners = np.stack([corners[..., 0] * width, (1 - corners[..., 1]) * height], axis=-1)
    covered = cover(corners, width, height)
    _check(covered, own)
    return _texels(mesh, corners, covered, gutter, vertex)


def _texels(
    mesh: Mesh,
    corners: np.ndarray,
    covered: Covered,
    gutter: int,
    vertex: np.ndarray,
) -> Texels:
    height, width = covered.face.shape
    face = covered.face.ravel()
    texel = np.flatnonzero(face >= 0)
    face = face[texel]
    source = np.full(height * width, -1, np.int32)
    source[texel] = np.arange(len(texel), dtype=np.int32)
    small = np.zeros(len(corners), bool)
    small[covered.small] = True
    widths = {"positions": 3, "normals": 3, "uv": 2, "barycentric": 3}
    like = np.dtype(mesh.vertices.dtype)
    rows = {name: np.empty((len(texel), n), like) for name, n in widths.items()}
    vertices, normals, faces = map(np.asarray, (mesh.vertices, mesh.normals, mesh.faces))
    for start in range(0, len(texel), _BLOCK):
        part = slice(start, start + _BLOCK)
        row, column = np.divmod(texel[part], width)
        center = np.stack([column, row], axis=1) + 0.5
        alone = small[face[part]]
        center[alone] = corners[face[part][alone]].mean(axis=1)
        weights = barycentric(corners[face[part]], center)
        rows["positions"][part], rows["normals"][part] = places(
            vertices, normals, faces, face[part], weights
        )
        rows["uv"][part] = np.stack([center[:, 0] / width, 1 - center[:, 1] / height], axis=1)
        rows["barycentric"][part] = weights
    return Texels(
        **{name: put(array) for name, array in rows.items()},
        face=put(face),
        source=put(nearest(source.reshape(height, width), corners, gutter)),
        mesh=mesh,
        vertex=put(vertex),
    )


def _size(resolution: Any) -> tuple[int, int]:
    """Give width and height."""
    sides = resolution if isinstance(resolution, tuple | list) else (resolution, resolution)
    if len(sides) != 2:
        raise ValueError(
            f"expected resolution as an integer or as width and height, got {described(resolution)}"
        )
    width, height = (check_size("resolution", side) for side in sides)
    if max(width, height) > _MOST:
        raise ValueError(f"resolution must be at most {_MOST:,}, got {width} × {height}")
    return width, height


def _check_range(corners: np.ndarray, width: int, height: int) -> None:
    known = corners[np.isfinite(corners).all(axis=(1, 2))].reshape(-1, 2)
    if not len(known):
        raise ValueError("expected UV of the mesh that are finite, got none: unwrap=True makes new")
    low, high = known.min(axis=0), known.max(axis=0)
    half = 0.5 / np.array([width, height])
    if (low < -half).any() or (high > 1 + half).any():
        raise ValueError(
            f"expected UV of the mesh within 0 to 1, each place of the picture once, got "
            f"{low[0]:.3g} to {high[0]:.3g} and {low[1]:.3g} to {high[1]:.3g}: unwrap=True makes "
            "new ones"
        )


def _check(covered: Covered, own: bool) -> None:
    """Raise where UV cannot do, and warn where they do for a part only."""
    if (covered.face < 0).all():
        raise ValueError(
            "expected UV of the mesh with an area, got none on any face: unwrap=True makes new ones"
        )
    twice = int(covered.overlapping.sum())
    if twice and own:
        row, column = np.argwhere(covered.overlapping)[0]
        raise ValueError(
            f"expected UV of the mesh that do not overlap, got {twice:,} of "
            f"{(covered.face >= 0).sum():,} texels in several faces, first at row {row}, column "
            f"{column}: unwrap=True makes new ones"
        )
    found = [
        (twice, "texels are in several faces, and show the first"),
        (covered.flat, "faces have no area in UV and are on no texel"),
        (covered.hidden, "charts are smaller than a texel and show what is beside them"),
    ]
    if said := ", ".join(f"{count:,} {what}" for count, what in found if count):
        warnings.warn(f"texels: {said}", stacklevel=3)


@jax.jit
def _carry(values, faces, face, weights):
    def rows(values, faces, face, weights):
        return einsum("nkc,nk->nc", values[faces[face]], weights.astype(values.dtype))

    arrays = values, faces, face, weights
    if rows_are_split(face):
        return keep_rows(rows, *arrays, like=face, axis=0, out=0)
    return keep_rows(rows, *arrays, like=values, axis=0, out=None)


@jax.jit
def _image(values, background, source):
    def pixels(values, background, source):
        shown = values[jnp.maximum(source, 0)]
        return jnp.where((source >= 0)[..., None], shown, background)

    if rows_are_split(source):
        return keep_rows(pixels, values, background, source, like=source, axis=0, out=0)
    return keep_rows(pixels, values, background, source, like=values, axis=0, out=None)
