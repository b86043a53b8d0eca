"""Which face a pixel sees, and colours from vertices to pixels."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Bool, Float, Int

from jaxsh.geometry import Mesh, RayScene

from ._camera import Camera

_rays = eqx.filter_jit(Camera.rays)


class Raster(eqx.Module):
    """What each pixel's centre sees of a mesh."""

    face: Int[Array, "h w"]  # index into the mesh's faces, -1 for background; int32
    barycentric: Float[Array, "h w 3"]  # weights of the face's vertices, 0 for background; float32

    @property
    def mask(self) -> Bool[Array, "h w"]:
        """True on the object."""
        return self.face >= 0


def rasterize(mesh: Mesh, camera: Camera) -> Raster:
    """The first face on the ray through each pixel centre, and where on it the ray arrives.

    Exact at the pixel centre (weights are those in space, so perspective is right), without
    antialiasing. Runs on the CPU through `RayScene`: neither traceable nor differentiable.
    """
    hit = RayScene(mesh).closest_hit(*_rays(camera))
    shape = (camera.height, camera.width)
    return Raster(
        jnp.asarray(hit.face.reshape(shape)), jnp.asarray(hit.barycentric.reshape(*shape, 3))
    )


def interpolate(
    raster: Raster,
    faces: Int[Array, "f 3"],
    values: Float[Array, "v c"],
    background: float | Float[Array, " c"] = 0.0,
) -> Float[Array, "h w c"]:
    """Values at vertices (colours, positions, normals) carried linearly over the faces to pixels.

    Has the dtype of `values`. Differentiable, forward and reverse, in `values`, `background` and
    the raster's weights; `jit` and `vmap` as you like.
    """
    if values.ndim != 2:
        raise ValueError(f"expected values (v, c), one row per vertex, got shape {values.shape}")
    if not isinstance(faces, Tracer) and len(faces):
        vertices = int(np.max(np.asarray(faces))) + 1
        if vertices > len(values):
            raise ValueError(f"expected values for {vertices} vertices, got {len(values)}")
    # The background's -1 would be the last face: its weights are zero, and its colour is replaced.
    corners = values[faces[jnp.maximum(raster.face, 0)]]
    weights = raster.barycentric.astype(values.dtype)
    pixels = jnp.einsum("hwkc,hwk->hwc", corners, weights, precision="highest")
    behind = jnp.broadcast_to(jnp.asarray(background, values.dtype), pixels.shape)
    return jnp.where(raster.mask[..., None], pixels, behind)
