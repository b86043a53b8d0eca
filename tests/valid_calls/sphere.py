"""Valid calls of `jaxsh.sphere`."""

import numpy as np

from jaxsh import sphere

from .shared import K, V, floats, of


def calls():
    s = sphere
    quadrature = s.fibonacci(7)
    suns = s.Suns(floats(2, 3), floats(2), floats(2, 3), floats(2, 8, 3))
    return {
        "Quadrature": of(
            s.Quadrature, directions=np.asarray(quadrature.directions), weights=floats(7)
        ),
        "Quadrature.sharded": of(quadrature.sharded, devices=None, host=True),
        "Suns": of(
            s.Suns,
            direction=floats(2, 3),
            solid_angle=floats(2),
            radiance=floats(2, 3),
            shape=floats(2, 8, 3),
        ),
        "Suns.harmonics": of(suns.harmonics, degree=2),
        "Suns.rays": of(suns.rays, count=4),
        "Suns.rotate": of(suns.rotate, rotation=np.eye(3), finite="rotation"),
        "cube_map": of(s.cube_map, resolution=2),
        "fibonacci": of(s.fibonacci, count=7),
        "gauss_legendre": of(s.gauss_legendre, degree=2),
        "irradiance": of(s.irradiance, light=floats(3, K), normals=floats(V, 3), finite="light"),
        "lat_long": of(s.lat_long, height=4, width=8),
        "project": of(s.project, values=floats(3, 7), quadrature=quadrature, degree=2),
        "project_lat_long": of(s.project_lat_long, image=floats(6, 12, 3), degree=2),
        "reconstruct": of(s.reconstruct, coefficients=floats(3, K), directions=floats(7, 3)),
        "reconstruct_lat_long": of(
            s.reconstruct_lat_long, coefficients=floats(3, K), height=4, width=8
        ),
        "split_sun": of(
            s.split_sun,
            image=floats(6, 12, 3) + 100 * (np.arange(72).reshape(6, 12, 1) == 40),
            count=1,
            threshold=4.0,
            largest=0.5,
            least=0.4,
            rays=4,
            host=True,
            finite="image",
        ),
    }
