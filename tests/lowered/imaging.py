"""`jaxsh.imaging` at full size: pictures of a million pixels."""

import numpy as np

from jaxsh import geometry, imaging

from .shared import V, booleans, floats, integers, made_by, of

FILES = "touches files"
WITHOUT = {
    "Camera": "holds what it is given",
    "Splats": "holds what it is given",
    "rasterize": "casts rays on the host",
    "read_environment": FILES,
    "read_light": FILES,
    "read_splats": FILES,
    "write_image": FILES,
    "write_light": FILES,
    "write_lightmap": FILES,
    "write_movie": FILES,
    "write_relit": FILES,
    "write_splats": FILES,
}


def calls():
    i = imaging
    image, probe = floats(1024, 1024, 3), floats(512, 1024, 3)
    mask = booleans(1024, 1024)

    def camera(position, target):
        return i.Camera(position, target, width=1024, height=1024)

    def raster(face, barycentric, faces):
        return i.Raster(face, barycentric, faces)

    seen = made_by(raster, integers(1024, 1024), floats(1024, 1024, 3), integers(2 * V, 3))

    def albedo(vertices, faces, uv, chosen, seen):
        # Codes have no derivative: they are constants, as in a file.
        part = geometry.BaseColor("", (0.5, 0.5, 0.5, 1.0), np.zeros((64, 64, 4), np.uint8))
        mesh = geometry.Mesh(vertices, faces, vertices, uv, None, chosen, (part,))
        return i.base_color(mesh, seen), i.base_color(mesh)

    mesh = floats(V, 3), integers(2 * V, 3), floats(V, 2), integers(2 * V)
    return {
        "auto_exposure": of(lambda image, mask: i.auto_exposure(image, mask), image, mask),
        "backdrop": of(
            lambda probe, *points: i.backdrop(probe, camera(*points)), probe, floats(3), floats(3)
        ),
        "base_color": of(albedo, *mesh, seen),
        "interpolate": of(i.interpolate, seen, floats(V, 3), floats(3)),
        "look_up": of(i.look_up, probe, floats(V, 3)),
        "psnr": of(lambda a, b, mask: i.psnr(a, b, mask=mask), image, image, mask),
        "sample_texture": of(i.sample_texture, image, floats(V, 2), floats(V, 2, 2)),
        "srgb_decode": of(i.srgb_decode, image),
        "srgb_encode": of(i.srgb_encode, image),
        "tone_map": of(lambda image: i.tone_map(image, 1.0, curve="reinhard"), image),
    }
