"""Meshes and environments by name or by file, and one with a texture made at run time."""

import math
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, UInt8

from jaxsh import geometry, imaging

from ..runner import Context, UserError

# The textured mesh that is made at run time.
VASE = "vase"


def mesh(context: Context, name: str, up: str | None) -> geometry.Mesh:
    """A mesh of the data by its name, from a file by its path, or the vase."""
    if name == VASE:
        return vase()
    if not Path(name).suffix:
        return context.data.mesh(name)
    try:
        return geometry.read_mesh(name) if up is None else geometry.read_mesh(name, up=up)  # pyright: ignore[reportArgumentType]
    except (OSError, ValueError) as error:
        raise UserError(" ".join(str(error).split())) from error


def environment(context: Context, name: str) -> Float[Array, "h w 3"]:
    """An environment of the data by its name, or from a file by its path."""
    if not Path(name).suffix:
        return context.data.environment(name)
    try:
        return imaging.read_environment(name)
    except (OSError, ValueError) as error:
        raise UserError(" ".join(str(error).split())) from error


# Radius and height of the vase from near the middle of its foot over the rim to that of its floor.
_PROFILE = [
    *((0.02, 0), (0.28, 0), (0.31, 0.03), (0.44, 0.35), (0.37, 0.7), (0.33, 0.86), (0.41, 0.97)),
    *((0.39, 0.975), (0.3, 0.86), (0.33, 0.7), (0.38, 0.5), (0.25, 0.36), (0.02, 0.34)),
]
_FLUTES = 12


def vase(rows: int = 160, columns: int = 204, texels: int = 1024) -> geometry.Mesh:
    """A fluted vase, open on top, that shades its inside, under a texture of bands and dots."""
    from scipy.interpolate import PchipInterpolator

    radius, height = np.array(_PROFILE).T
    along = np.cumsum(np.hypot(np.diff(radius, prepend=0), np.diff(height, prepend=0)))
    along = (along - along[0]) / (along[-1] - along[0])
    profile = PchipInterpolator(along, np.stack([radius, height], axis=1))

    def place(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        u = u % 1  # so that the seam closes
        r, z = np.moveaxis(profile(v), -1, 0)
        r = r * (1 + 0.04 * np.cos(2 * math.pi * _FLUTES * u) * np.sin(math.pi * np.clip(z, 0, 1)))
        return np.stack([r * np.cos(2 * math.pi * u), r * np.sin(2 * math.pi * u), z], axis=-1)

    v, u = np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 1, columns + 1), indexing="ij")
    step, inner = 1e-4, np.clip(v, 1e-4, 1 - 1e-4)
    normals = np.cross(
        place(u + step, inner) - place(u - step, inner),
        place(u, inner + step) - place(u, inner - step),
    )
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    number = np.arange(u.size).reshape(u.shape)
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    return geometry.Mesh(
        jnp.asarray(place(u, v).reshape(-1, 3), jnp.float32),
        jnp.asarray(faces, jnp.int32),
        jnp.asarray(normals.reshape(-1, 3), jnp.float32),
        uv=jnp.asarray(np.stack([u, v], -1).reshape(-1, 2), jnp.float32),
        face_material=jnp.zeros(len(faces), jnp.int32),
        materials=(geometry.BaseColor("glaze", texture=_glaze(texels)),),
    )


def _glaze(size: int) -> UInt8[np.ndarray, "h w 4"]:
    """Bands, and dots on them, in sRGB; edges are as wide as a texel."""
    u, v = (np.arange(size) + 0.5) / size, 1 - (np.arange(size)[:, None] + 0.5) / size
    clay, cream, blue = (
        np.array(color) for color in ((176, 84, 52), (232, 221, 196), (38, 70, 120))
    )
    # In texels from the edge, inwards.
    bands = size / (2 * math.pi * 9) * (np.sin(2 * math.pi * 9 * v) - 0.2) * np.ones_like(u)
    dots = size / 21 * (0.25 - np.hypot((24 * u) % 1 - 0.5, (18 * v) % 1 - 0.5))
    band, dot = (np.clip(distance + 0.5, 0, 1)[..., None] for distance in (bands, dots))
    colors = clay + band * (cream + dot * (blue - cream) - clay)
    return np.concatenate([np.rint(colors), np.full((size, size, 1), 255)], 2).astype(np.uint8)
