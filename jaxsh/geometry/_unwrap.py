"""UV for a mesh that has none: cut into charts that are laid flat and packed, by xatlas."""

import dataclasses
import warnings
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from ._mesh import Mesh

# Share of the square that charts should cover; below they are packed closer, if they can be.
_COVERED = 0.15
# Packings that are tried for one distance between charts.
_TRIES = 8


class _Charts(NamedTuple):
    """Holds the charts as xatlas cuts them: vertices of its own, each in one chart."""

    parent: Int[np.ndarray, " u"]  # the vertex of the mesh
    faces: Int[np.ndarray, "f 3"]  # in the mesh's order
    flat: Float[np.ndarray, "u 2"]  # all in one scale
    number: int


def unwrap(mesh: Mesh, width: int, height: int, gutter: int) -> tuple[Mesh, Int[np.ndarray, " u"]]:
    """Give the mesh with UV of its own, and for each of its vertices that of `mesh` that it is.

    Vertices are in the order of the mesh, each as often as it is in charts; faces keep their
    numbers and their corners. Textures are left out, since they belong to other UV.
    """
    charts = _cut(mesh)
    # A gutter along the picture's rim too: look-ups that repeat it reach across.
    size = min(width, height)
    rim = min(gutter, (size - 1) // 4)
    packed = _pack(charts, size - 2 * rim, gutter)
    if packed is None:
        raise ValueError(
            f"expected a resolution at which the {charts.number:,} charts that xatlas made of the "
            f"mesh have room, got {width} × {height}"
        )
    inner, apart = packed
    uv = (inner * (size - 2 * rim) + rim) / size
    if charts.number > 1 and apart < min(2 * gutter, 2):
        warnings.warn(
            f"texels: {width} × {height} leave less than 2 between the {charts.number:,} charts "
            "that xatlas made of the mesh, so that bilinear look-ups mix them: give a higher "
            "resolution",
            stacklevel=3,
        )
    order = np.argsort(charts.parent, kind="stable")
    number = np.empty(len(order), np.int32)
    number[order] = np.arange(len(order))
    parent = charts.parent[order].astype(np.int32)
    unwrapped = dataclasses.replace(
        mesh,
        vertices=mesh.vertices[parent],
        faces=jnp.asarray(number[charts.faces]),
        normals=mesh.normals[parent],
        uv=jnp.asarray(uv[order], mesh.vertices.dtype),
        colors=None if mesh.colors is None else mesh.colors[parent],
        materials=tuple(dataclasses.replace(m, texture=None) for m in mesh.materials),
    )
    return unwrapped, parent


def _cut(mesh: Mesh) -> _Charts:
    xatlas = _xatlas()
    vertices = np.asarray(mesh.vertices, np.float64)
    # Its thresholds are for meshes of about this size.
    used = vertices[np.unique(np.asarray(mesh.faces))]
    middle, size = used.mean(axis=0), np.ptp(used, axis=0).max()
    vertices = (vertices - middle) / np.where(size > 0, size, 1)
    normals = np.asarray(mesh.normals, np.float32)
    # It makes no chart around one that is not finite, and takes the faces' own around zero.
    normals = np.where(np.isfinite(normals).all(axis=1, keepdims=True), normals, 0)
    atlas = xatlas.Atlas()
    atlas.add_mesh(
        vertices.astype(np.float32),
        np.asarray(mesh.faces, np.uint32),
        normals,
    )
    atlas.generate(xatlas.ChartOptions(), xatlas.PackOptions(), False)
    if not atlas.width * atlas.height:
        raise ValueError("expected a mesh with an area, got none on any face")
    parent, faces, uv = atlas[0]
    flat = uv * np.array([atlas.width, atlas.height], np.float32)
    return _Charts(parent.astype(np.int64), faces, flat.astype(np.float32), atlas.chart_count)


def _pack(charts: _Charts, size: int, gutter: int) -> tuple[Float[np.ndarray, "u 2"], int] | None:
    """Pack charts into a square: their UV, and the texels that they stand apart; None without room.

    Two gutters apart where the charts then cover enough of the square, else closer.
    """
    best, most, apart = None, -1.0, 2 * gutter
    while True:
        for uv, covered in _packings(charts, size, apart):
            if covered > most:
                best, most = (uv, apart), covered
        if apart == 0 or most >= _COVERED:
            return best
        apart //= 2


def _packings(charts: _Charts, size: int, apart: int):
    """Give packings that fit into a square, each with the share of it that charts cover.

    xatlas takes the number of texels that the charts would fill, and then makes the picture as
    large as the distances between them want: what to give is found step by step.
    """
    xatlas = _xatlas()
    options = xatlas.PackOptions()
    options.padding, options.bilinear = apart, True
    wanted, tried = size, set()
    for _ in range(_TRIES):
        if wanted in tried:
            return
        tried.add(wanted)
        options.resolution = wanted
        atlas = xatlas.Atlas()
        atlas.add_uv_mesh(charts.flat, charts.faces)
        atlas.generate(xatlas.ChartOptions(), options, False)
        parent, _, uv = atlas[0]
        texels = np.empty((len(charts.flat), 2))
        texels[parent] = uv * np.array([atlas.width, atlas.height], np.float32)
        side = max(atlas.width, atlas.height)
        if side <= size and atlas.atlas_count == 1:
            yield texels / size, _area(texels[charts.faces]) / size**2
        # A texel less where it was just too large, since rounding may leave it there.
        smaller = int(wanted * size / side)
        wanted = max(1, smaller if side <= size else min(smaller, wanted - 1))


def _area(corners: Float[np.ndarray, "f 3 2"]) -> float:
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return float(np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]).sum() / 2)


def _xatlas() -> Any:
    try:
        import xatlas  # pyright: ignore[reportMissingImports]
    except ImportError as error:
        raise ImportError(
            "a mesh without UV of its own is unwrapped by the package xatlas, which cannot be "
            "imported here: `pip install xatlas`, or the extra `xatlas`"
        ) from error
    return xatlas
