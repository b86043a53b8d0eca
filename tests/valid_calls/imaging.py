"""Valid calls of `jaxsh.imaging`."""

import jax.numpy as jnp
import numpy as np

from jaxsh import geometry, imaging

from .geometry import square_texels
from .shared import eye, floats, knot, of


def calls():
    i = imaging
    image, mesh = floats(6, 12, 3), knot()
    camera = i.Camera((0.3, -4.0, 0.2), (0.0, 0.0, 0.0), width=6, height=8)
    raster = i.rasterize(mesh, camera)
    return {
        "Camera": of(
            i.Camera,
            position=eye(),
            target=np.zeros(3),
            up=np.array([0.0, 0.0, 1.0]),
            fov_y=40.0,
            width=6,
            height=8,
            finite="position target up fov_y",
        ),
        "Camera.facing": of(
            i.Camera.facing,
            mesh=mesh,
            toward=(0.0, -1.0, 0.2),
            fov_y=30.0,
            width=6,
            height=8,
            margin=0.05,
            free="toward",
            host=True,
            finite="fov_y margin",
        ),
        "Splats": of(
            i.Splats,
            positions=floats(4, 3),
            coefficients=floats(4, 3, 9),
            opacities=floats(4),
            scales=floats(4, 3),
            rotations=floats(4, 4),
        ),
        "auto_exposure": of(
            i.auto_exposure, image=image, mask=image[..., 0] > 0.5, percentile=90.0
        ),
        "backdrop": of(i.backdrop, environment=image, camera=camera),
        "base_color": of(i.base_color, mesh=mesh, at=raster),
        "interpolate": of(
            i.interpolate,
            raster=raster,
            values=floats(300, 3),
            background=floats(3),
            color=floats(8, 6, 3),
        ),
        "look_up": of(i.look_up, environment=image, directions=floats(4, 3)),
        "psnr": of(i.psnr, image=image, reference=image, mask=image[..., 0] > 0.5, peak=1.0),
        "rasterize": of(
            i.rasterize,
            mesh=mesh,
            camera=camera,
            samples=1,
            scene=geometry.ray_scene(mesh),
            slow=True,
        ),
        "read_environment": of(
            i.read_environment,
            path="no such file.exr",
            layout="lat-long",
            orientation="jaxsh",
            encoding="srgb",
            layer="beauty",
            height=8,
            repair=True,
            free="path layer",
            slow=True,
        ),
        "read_light": of(
            i.read_light,
            path="no such file.json",
            convention="three.js",
            up="y",
            which="sky",
            free="path which",
            slow=True,
        ),
        "read_splats": of(i.read_splats, path="no such file.ply", up="y", slow=True),
        "sample_texture": of(
            i.sample_texture,
            texture=image,
            uv=floats(4, 2),
            footprint=floats(4, 2, 2),
            wrap="clamp",
        ),
        "srgb_decode": of(i.srgb_decode, signal=image),
        "srgb_encode": of(i.srgb_encode, linear=image),
        "studio": of(i.studio, height=8, width=16),
        "tone_map": of(i.tone_map, image=image, exposure=1.0, curve="reinhard", white=2.0),
        "write_image": of(
            i.write_image, path="/dev/null/no/a.exr", image=image, encoding=None, slow=True
        ),
        "write_light": of(
            i.write_light,
            path="/dev/null/no/a.json",
            light=floats(3, 9),
            convention="three.js",
            up="y",
            finite="light",
            slow=True,
        ),
        "write_lightmap": of(
            i.write_lightmap,
            path="/dev/null/no/a.exr",
            texels=square_texels(),
            values=floats(6, 3),
            exposure=1.0,
            finite="values exposure",
            slow=True,
        ),
        "write_movie": of(
            i.write_movie,
            path="/dev/null/no/a.gif",
            frames=floats(1, 6, 8, 3),
            fps=25.0,
            loop=True,
            quality=80.0,
            encoding=None,
            finite="frames fps quality",
            slow=True,
        ),
        "write_relit": of(
            i.write_relit,
            path="/dev/null/no/a.glb",
            surface=mesh,
            radiance=floats(300, 3),
            exposure=1.0,
            textured=False,
            up="y",
            finite="radiance exposure",
            slow=True,
        ),
        "write_splats": of(
            i.write_splats,
            path="/dev/null/no/a.ply",
            splats=i.Splats(jnp.zeros((4, 3)), jnp.zeros((4, 3, 9))),
            up="y",
            slow=True,
        ),
    }
