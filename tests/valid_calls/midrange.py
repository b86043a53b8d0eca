"""Valid calls of `jaxsh.midrange`."""

import numpy as np

from jaxsh import midrange, transfer

from .shared import V, floats, knot, lamp, of


def calls():
    m, light = midrange, lamp()
    points, positions = floats(4, 3), floats(V, 3)
    ball = m.Sphere(np.array([0.0, 0.0, 3.0]), 0.5, np.ones(3))
    scene, cube = m.Scene([light], [ball]), m.capture(m.Scene([light]), points[0], 2)
    samples = m.surface_samples([light], 4)
    expansions = m.Expansion(floats(5, 3), floats(5, 3, 4, 4))
    five = m.capture(m.Scene([light]), expansions.point, 2)
    one = m.Expansion(floats(3), floats(3, 4, 4))
    baked = transfer.unshadowed(positions, floats(V, 3), 1)
    weights = m.inverse_distance_weights(positions, expansions.point)
    polygon = {"polygon": light, "point": points, "degree": 1}
    behind = {"horizon": np.array([0.0, 0.0, 1.0]), "blockers": [light]}
    grid = m.Grid(np.zeros(3), np.ones(3), (2, 2, 3))
    search = {"exponent": 6.0, "checks": 8, "seed": 0}

    def evaluate(points):
        return m.Expansion(points, np.ones((len(points), 3, 4, 4)))

    return {
        "EmissiveMesh": of(
            m.EmissiveMesh, mesh=knot(), radiance=np.ones(3), two_sided=False, finite="radiance"
        ),
        "Expansion": of(m.Expansion, point=floats(5, 3), terms=floats(5, 3, 9, 4)),
        "Expansion.truncated": of(one.truncated, order=1),
        "Grid": of(
            m.Grid, lower=np.zeros(3), upper=np.ones(3), shape=(2, 2, 3), finite="lower upper"
        ),
        "Grid.weights": of(grid.weights, positions=positions),
        "Polygon": of(
            m.Polygon,
            vertices=np.asarray(light.vertices),
            radiance=np.ones(3),
            two_sided=False,
            finite="vertices radiance",
        ),
        "RadianceCube": of(
            m.RadianceCube,
            radiance=floats(24, 3),
            distance=floats(24),
            plane_distance=floats(24),
            normal=floats(24, 3),
            point=floats(3),
        ),
        "Scene": of(
            m.Scene, emitters=[light], blockers=[ball], environment=floats(4, 8, 3), host=True
        ),
        "Sphere": of(
            m.Sphere,
            center=np.zeros(3),
            radius=0.5,
            radiance=np.ones(3),
            finite="center radius radiance",
        ),
        "SurfaceSamples": of(
            m.SurfaceSamples,
            points=floats(7, 3),
            normals=floats(7, 3),
            areas=floats(7),
            radiance=floats(7, 3),
        ),
        "capture": of(
            m.capture,
            scene=scene,
            point=points,
            resolution=2,
            rays="analytic",
            finite="point",
            slow=True,
        ),
        "extrapolate": of(m.extrapolate, expansion=one, positions=positions),
        "grid_around": of(m.grid_around, positions=positions, shape=(2, 2, 3), host=True),
        "interpolate": of(
            m.interpolate,
            expansions=expansions,
            weights=weights,
            positions=positions,
            rule="full",
            visibility=five,
        ),
        "inverse_distance_weights": of(
            m.inverse_distance_weights, positions=positions, points=points, exponent=4.0
        ),
        "visible_weights": of(
            m.visible_weights, weights=weights, cubes=five, positions=positions, tolerance=1e-3
        ),
        "make_expansion": of(
            m.make_expansion,
            point=points,
            coefficients=floats(4, 3, 9),
            gradient=floats(4, 3, 9, 3),
        ),
        "monomials": of(m.monomials, offsets=points, order=2),
        "moving_least_squares_weights": of(
            m.moving_least_squares_weights, positions=positions, points=floats(5, 3), exponent=2.0
        ),
        "place_samples": of(
            m.place_samples,
            positions=positions,
            count=2,
            method="kmeans",
            evaluate=evaluate,
            target=0.1,
            candidates=4,
            **search,
            slow=True,
        ),
        "polygon_harmonics": of(m.polygon_harmonics, **polygon, **behind, slow=True),
        "polygon_harmonics_with_gradient": of(
            m.polygon_harmonics_with_gradient, **polygon, **behind, slow=True
        ),
        "project_cube": of(m.project_cube, cube=cube, degree=1),
        "project_cube_with_gradient": of(
            m.project_cube_with_gradient, cube=cube, degree=1, gradient="edges"
        ),
        "project_surface": of(m.project_surface, samples=samples, point=points, degree=1),
        "project_surface_with_gradient": of(
            m.project_surface_with_gradient, samples=samples, point=points, degree=1
        ),
        "shade": of(
            m.shade,
            expansions=expansions,
            transfer=baked,
            albedo=floats(V, 3),
            weights=weights,
            rule="full",
            finite="albedo",
        ),
        "sphere_harmonics": of(m.sphere_harmonics, sphere=ball, point=points, degree=1),
        "sphere_harmonics_with_gradient": of(
            m.sphere_harmonics_with_gradient, sphere=ball, point=points, degree=1
        ),
        "surface_samples": of(m.surface_samples, emitters=[light], count=4, host=True),
        "taylor": of(m.taylor, cube=cube, degree=1, order=1),
        "update_samples": of(
            m.update_samples,
            points=points,
            candidates=floats(4, 3),
            positions=positions,
            evaluate=evaluate,
            target=0.1,
            release=0.05,
            limit=5,
            **search,
            slow=True,
        ),
    }
