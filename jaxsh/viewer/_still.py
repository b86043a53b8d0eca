"""A picture of what a page first shows, for where no script runs."""

import io
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from ..geometry import Mesh
from ..imaging import Camera, base_color, interpolate, rasterize, tone_map
from ..transfer import Material, Transfer
from ._gloss import split_material
from ._lamp import Lamp
from ._lights import shaded
from ._surface import Surface, looked_up


class Still:
    """Draws a mesh under a light, from where and at the exposure that a page's header says."""

    def __init__(
        self,
        transfer: Transfer,
        surface: Surface,
        albedo: ArrayLike | Material,
        height: int,
        lamp: Lamp | None = None,
    ):
        self.transfer, self.albedo, self.height, self.lamp = transfer, albedo, height, lamp
        faces = jnp.asarray(surface.faces)
        self.surface = surface
        mesh = surface.mesh
        self.mesh = Mesh(transfer.positions, faces, transfer.normals) if mesh is None else mesh

    def png(self, light: Float[np.ndarray, "3 k"], header: dict[str, Any]) -> bytes:
        """A PNG with the ground transparent, four samples in a pixel."""
        facts = header["camera"]
        position, target, up = (
            np.asarray(facts[name], self.transfer.positions.dtype)
            for name in ("position", "target", "up")
        )
        width = max(1, round(self.height * facts["aspect"]))
        camera = Camera(position, target, up, facts["fovY"], width, self.height)
        raster = rasterize(self.mesh, camera, samples=2)
        first = header["kinds"][0], light
        sent = shaded(*first, self.transfer, self.albedo, camera.position, self.lamp)
        seen = looked_up(self.surface, raster, sent)
        if self.surface.tinted:
            diffuse, _ = split_material(self.albedo)
            white = shaded(*first, self.transfer, diffuse, camera.position, self.lamp)
            color = base_color(self.mesh, raster).astype(sent.dtype)
            seen = seen + looked_up(self.surface, raster, white) * (color - 1)
        return _encoded(interpolate(raster, seen), raster.alpha, header["exposure"])


def _encoded(radiance: Float[Array, "h w 3"], alpha: Float[Array, "h w"], exposure: float) -> bytes:
    from PIL import Image

    cover = alpha[..., None].astype(radiance.dtype)
    # Its color is that of the object alone.
    colors = tone_map(radiance / jnp.where(cover > 0, cover, 1), exposure)
    pixels = np.concatenate([np.asarray(colors), np.asarray(cover)], axis=-1)
    file = io.BytesIO()
    Image.fromarray(np.rint(255 * pixels).astype(np.uint8)).save(file, "PNG")
    return file.getvalue()
