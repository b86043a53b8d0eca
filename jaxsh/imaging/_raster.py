"""Faces that pixels see, and colors carried from vertices to pixels."""

import dataclasses
import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from .._core.checks import as_float, check_size, check_type
from .._core.host import put
from .._core.known import is_concrete
from .._core.linalg import einsum
from .._core.xla import keep_rows, rows_are_split
from ..geometry import Mesh, RayScene, ray_scene
from ._camera import Camera, host_rays


class Raster(eqx.Module):
    """Holds what the samples of each pixel see of a mesh: n × n of them, for a picture of h × w.

    With one sample, its pixel's center, the rows and columns are those of the picture. Made by
    `rasterize`, drawn with `interpolate`. Of a mesh with UV it holds those of each sample, and its
    footprint, for `sample_texture`.

    **Example**

    >>> from jaxsh import geometry, imaging
    >>> mesh = geometry.knot(300)
    >>> raster = imaging.rasterize(mesh, imaging.Camera.facing(mesh, width=8, height=6))
    >>> raster.alpha.shape, raster.mask.dtype.name
    ((6, 8), 'bool')
    """

    face: Int[Array, "hn wn"]  # index into `faces`, -1 for background; int32
    barycentric: Float[Array, "hn wn 3"]  # of the face's vertices, 0 for background; float32
    faces: Int[Array, "f 3"]  # the mesh's
    samples: int = eqx.field(static=True, default=1)  # n
    # Of a mesh with UV, 0 for background: where in the texture the samples are, and by how much
    # (u, v) changes to the next sample to the right and the next one down, in its columns.
    uv: Float[Array, "hn wn 2"] | None = None
    footprint: Float[Array, "hn wn 2 2"] | None = None

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of the picture."""
        height, width = self.face.shape
        return height // self.samples, width // self.samples

    @property
    def alpha(self) -> Float[Array, "h w"]:
        """Share of each pixel's samples that are on the object; float32."""
        return _alpha(self.face, self.samples)

    @property
    def mask(self) -> Bool[Array, "h w"]:
        """True where the whole pixel is on the object."""
        return _mask(self.face, self.samples)


def rasterize(
    mesh: Mesh, camera: Camera, *, samples: int = 1, scene: RayScene | None = None
) -> Raster:
    """Find the first face on the rays through each pixel, and where on it they arrive.

    `samples` rays along each side of a pixel, on a regular grid: one is its center, n give pictures
    n² + 1 shades of a silhouette and take n² times the memory. Exact at the samples (weights are
    those in space, so perspective is right), the UV and its footprint too: the derivative, in the
    picture's plane, of where on the face a ray arrives. Frame after frame of a mesh at rest, give
    its `geometry.ray_scene(mesh)` as `scene`, so that its tree is built once.

    Runs on the host through a `RayScene`, outside `jit`, and does not shard. Not differentiable:
    which face is seen is a step. Raises `ValueError` for samples below 1.

    **Example**

    >>> from jaxsh import geometry, imaging
    >>> mesh = geometry.knot(300)
    >>> camera = imaging.Camera.facing(mesh, width=8, height=6)
    >>> raster = imaging.rasterize(mesh, camera, samples=2)
    >>> raster.shape, raster.face.shape, raster.barycentric.shape
    ((6, 8), (12, 16), (12, 16, 3))
    """
    check_type("mesh", mesh, Mesh)
    check_type("camera", camera, Camera)
    samples = check_size("samples", samples)
    if scene is not None:
        check_type("scene", scene, RayScene)
    shape = (camera.height * samples, camera.width * samples)
    finer = dataclasses.replace(camera, height=shape[0], width=shape[1])
    scene = ray_scene(mesh) if scene is None else scene
    hit = scene.closest_hit(*host_rays(finer))
    face, barycentric = put(hit.face.reshape(shape)), put(hit.barycentric.reshape(*shape, 3))
    uv, footprint = (None, None)
    if mesh.uv is not None:
        uv, footprint = _in_texture(mesh.vertices, mesh.faces, mesh.uv, face, barycentric, finer)
    return Raster(face, barycentric, jnp.asarray(mesh.faces), samples, uv, footprint)


def interpolate(
    raster: Raster,
    values: Float[Array, "v c"] | Float[Array, "hn wn c"],
    background: float | Float[Array, " c"] | Float[Array, "h w c"] = 0.0,
    *,
    color: Float[Array, "hn wn c"] | None = None,
) -> Float[Array, "h w c"]:
    """Carry values at vertices (colors, positions, normals) linearly over the faces to pixels.

    A pixel is the mean over its samples; those beside the object count as `background`, a number,
    a color or a picture (as from `backdrop`). Give linear radiance: the mean of encoded colors is
    not the color of the mean light. `color`, one for each of the raster's samples, as `base_color`
    and `sample_texture` give it, is multiplied into the values there, before the mean: a texture
    may be finer than the mesh. Values may be of the samples themselves too (height·n, width·n, c),
    as a lightmap's by `sample_texture(lightmap, raster.uv, raster.footprint)`. Has the dtype of
    `values`. Raises `ValueError` for values of another shape or of too few vertices, and for a
    background or color of another shape.

    Differentiable, forward and reverse, in `values`, `background`, `color` and the raster's
    weights. Runs under `jit` and `vmap`. Shards over the raster's rows, where `values` are whole on
    each device; values that are shared out by vertex are brought together for a picture whole on
    each device.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import geometry, imaging
    >>> mesh = geometry.knot(300)
    >>> raster = imaging.rasterize(mesh, imaging.Camera.facing(mesh, width=8, height=6))
    >>> imaging.interpolate(raster, 0.5 * mesh.normals + 0.5, jnp.nan).shape
    (6, 8, 3)
    """
    check_type("raster", raster, Raster)
    values, background = as_float(values, "values"), as_float(background, "background")
    of_samples = values.ndim == 3 and values.shape[:2] == raster.face.shape
    if values.ndim != 2 and not of_samples:
        raise ValueError(
            f"expected values (v, c), one row per vertex, or {(*raster.face.shape, 'c')}, one for "
            f"each sample of the raster, got shape {values.shape}"
        )
    if not of_samples and is_concrete(raster.faces) and len(raster.faces):
        vertices = int(np.max(np.asarray(raster.faces))) + 1
        if vertices > len(values):
            raise ValueError(f"expected values for {vertices} vertices, got {len(values)}")
    behind = background.astype(values.dtype)
    shape = (*raster.shape, values.shape[-1])
    if behind.shape not in ((), shape[2:], shape):
        raise ValueError(
            f"expected background as a number, {shape[2:]} or {shape}, got shape {behind.shape}"
        )
    if color is not None:
        color = as_float(color, "color").astype(values.dtype)
        wanted = (*raster.face.shape, values.shape[-1])
        if color.shape != wanted:
            raise ValueError(
                f"expected color {wanted}, one for each sample of the raster, got shape "
                f"{color.shape}"
            )
    return _interpolate(raster, values, behind, color)


@functools.partial(jax.jit, static_argnums=1)
def _alpha(face: Int[Array, "hn wn"], samples: int) -> Float[Array, "h w"]:
    on_object = (face >= 0).astype(jnp.float32)[..., None]
    return keep_rows(lambda x: _resolve(x, samples), on_object, like=face, axis=0, out=0)[..., 0]


@functools.partial(jax.jit, static_argnums=1)
def _mask(face: Int[Array, "hn wn"], samples: int) -> Bool[Array, "h w"]:
    return _alpha(face, samples) == 1


@jax.jit
def _interpolate(raster: Raster, values, background, color):
    def pixels(raster: Raster, values, background, color):
        seen = values
        if values.ndim == 2:
            # The background's -1 would be the last face, but its weights are zero.
            at = raster.faces[jnp.maximum(raster.face, 0)]
            seen = between(values[at], raster.barycentric)
        seen = seen if color is None else seen * color
        seen = jnp.where((raster.face >= 0)[..., None], seen, 0)
        seen = _resolve(seen, raster.samples)
        free = 1 - raster.alpha[..., None].astype(values.dtype)
        # A background of NaN, as a mark, stays where it is seen.
        return seen + jnp.where(free > 0, free * jnp.broadcast_to(background, seen.shape), 0)

    if rows_are_split(raster.face):
        return keep_rows(pixels, raster, values, background, color, like=raster.face, axis=0, out=0)
    return keep_rows(pixels, raster, values, background, color, like=values, axis=0, out=None)


def between(
    corners: Float[Array, "*shape 3 c"], barycentric: Float[Array, "*shape 3"]
) -> Float[Array, "*shape c"]:
    """Take the mean of what is at the corners of faces, by weights, in the dtype of the former."""
    weights = barycentric.astype(corners.dtype)
    # Written out: XLA would store what it gathers for a product of small matrices.
    a, b, c = (corners[..., k, :] * weights[..., k, None] for k in range(3))
    return a + b + c


def _resolve(samples: Float[Array, "hn wn c"], n: int) -> Float[Array, "h w c"]:
    """Average each n × n samples."""
    height, width, channels = samples.shape
    return jnp.mean(samples.reshape(height // n, n, width // n, n, channels), axis=(1, 3))


@jax.jit
def _in_texture(vertices, faces, uv, face, barycentric, camera: Camera):
    """UV of each sample, and their change to the next samples to the right and down."""
    seen = face >= 0
    at = faces[jnp.maximum(face, 0)]
    corners = vertices[at]
    point = between(corners, barycentric)
    first, second = corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 0, :]
    across = jnp.cross(first, second)
    squared = jnp.sum(across * across, axis=-1)
    # The ray at x, y of the picture is o + t (x right + y upward + forward), t its depth. A step
    # in x moves the point by t right, and then along the ray back into the plane of the face.
    right, upward, forward = (axis.astype(vertices.dtype) for axis in camera._axes())
    ray = point - camera.position.astype(vertices.dtype)[None, None]
    depth = einsum("hwc,c->hw", ray, forward)
    facing = jnp.sum(ray * across, axis=-1)
    # A face seen from its edge has no end of a footprint; no ray arrives there but by rounding.
    usable = seen & (squared > 0) & (facing != 0)
    squared, facing = (jnp.where(usable, x, 1)[..., None] for x in (squared, facing))
    tall = 2 * jnp.tan(jnp.radians(jnp.asarray(camera.fov_y, vertices.dtype)) / 2)
    step = tall / camera.height  # pixels are square
    texture = uv[at]
    edges = texture[..., 1:, :] - texture[..., :1, :]
    columns = []
    for axis in (right, -upward):
        move = (depth * step)[..., None] * axis[None, None]
        move = move - ray * (jnp.sum(move * across, axis=-1, keepdims=True) / facing)
        # Barycentric coordinates of the move, by the normal's cross products with the edges.
        b = jnp.sum(jnp.cross(move, second) * across, axis=-1, keepdims=True) / squared
        c = jnp.sum(jnp.cross(first, move) * across, axis=-1, keepdims=True) / squared
        change = b.astype(uv.dtype) * edges[..., 0, :] + c.astype(uv.dtype) * edges[..., 1, :]
        columns.append(jnp.where(usable[..., None], change, 0))
    place = between(texture, barycentric)
    return jnp.where(seen[..., None], place, 0), jnp.stack(columns, axis=-1)
