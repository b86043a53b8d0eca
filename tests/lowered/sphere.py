"""`jaxsh.sphere` at full size."""

import functools

from jaxsh import sphere

from .shared import DEGREE, K, V, floats, made_by, of, shapes

WITHOUT = {
    "Quadrature": "holds what it is given",
    "Suns": "holds what it is given",
    "split_sun": "runs on the host",
}


@functools.cache
def suns():
    """Sixteen sources that spread over 64 vectors."""
    return made_by(sphere.Suns, floats(16, 3), floats(16), floats(16, 3), floats(16, 64, 3))


def calls():
    s = sphere
    image, quadrature = floats(512, 1024, 3), shapes(s.lat_long(256, 512))
    light, lights, points = floats(3, K), floats(V, 3, K), floats(V, 3)
    return {
        "Suns.harmonics": of(lambda suns: suns.harmonics(DEGREE), suns()),
        "Suns.rays": of(lambda suns: suns.rays(64), suns()),
        "Suns.rotate": of(lambda suns, turn: suns.rotate(turn), suns(), floats(3, 3)),
        "irradiance": of(s.irradiance, light, points),
        "irradiance, own lights": of(s.irradiance, lights, points),
        "project": of(lambda f, q: s.project(f, q, DEGREE), floats(3, 256 * 512), quadrature),
        "project_lat_long": of(lambda image: s.project_lat_long(image, DEGREE), image),
        "reconstruct": of(s.reconstruct, light, points),
        "reconstruct_lat_long": of(lambda c: s.reconstruct_lat_long(c, 512, 1024), light),
    }
