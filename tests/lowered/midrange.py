"""`jaxsh.midrange` at full size."""

import numpy as np

from jaxsh import midrange

from .shared import DEGREE, K, V, baked, floats, made_by, of

CORNERS = np.array([[0, 0, 1], [0, 3, 1], [2, 3, 1], [2, 0, 1]], np.float32)
CUBES, TEXELS, SAMPLES = 64, 6 * 16 * 16, 128

WITHOUT = {
    "EmissiveMesh": "holds what it is given",
    "Expansion": "holds what it is given",
    "Grid": "holds what it is given",
    "Polygon": "holds what it is given",
    "RadianceCube": "holds what it is given",
    "Scene": "holds what it is given",
    "Sphere": "holds what it is given",
    "SurfaceSamples": "holds what it is given",
    "place_samples": "searches in NumPy",
    "update_samples": "searches in NumPy",
}


def lamp(corners):
    return midrange.Polygon(corners, np.ones(3, np.float32))


def hidden(count, function):
    """Of a polygon above a horizon behind so many triangles."""
    shape, corners = lamp(CORNERS), np.array([[0.5, 0.5, 0], [1, 0.5, 0], [1, 1, 0]], np.float32)
    heights = np.array([0.8, 0.7, 0.6], np.float32)[:count, None, None]
    blockers = [lamp(each) for each in corners + heights * np.array([0, 0, 1], np.float32)]

    def light(points, normals):
        return function(shape, points, DEGREE, horizon=normals, blockers=blockers)

    return light


def calls():
    m, points, corners = midrange, floats(V, 3), floats(4, 3)
    expansions = made_by(m.Expansion, floats(SAMPLES, 3), floats(SAMPLES, 3, K, 4))
    one = made_by(m.Expansion, floats(3), floats(3, K, 10))
    weights = made_by(m.Weights, floats(V, SAMPLES))
    few = made_by(m.SurfaceSamples, floats(16, 3), floats(16, 3), floats(16), floats(16, 3))
    cubes = made_by(
        m.RadianceCube,
        floats(CUBES, TEXELS, 3),
        floats(CUBES, TEXELS),
        floats(CUBES, TEXELS),
        floats(CUBES, TEXELS, 3),
        floats(CUBES, 3),
    )
    grid = m.Grid(np.zeros(3, np.float32), np.ones(3, np.float32), (4, 4, 8))
    ball = m.Sphere(np.array([0, 0, 3], np.float32), np.float32(0.5), np.ones(3, np.float32))
    scene = m.Scene([lamp(CORNERS)], [ball])
    both, memory = m.polygon_harmonics_with_gradient, "as many arcs at once as memory holds"

    def on_grid(expansions, points):
        return m.interpolate(expansions, grid.weights(points), points)

    def gridded(expansions, made):
        weights = grid.weights(made.positions)
        return m.shade(expansions, made, 0.5, weights=weights)

    return {
        "Expansion.truncated": of(lambda e: e.truncated(1), one),
        "Grid.weights": of(grid.weights, points),
        "capture": of(
            lambda p: m.capture(scene, p, 16, rays="analytic"), floats(CUBES, 3), reverse=False
        ),
        "extrapolate": of(m.extrapolate, one, points),
        "interpolate": of(m.interpolate, expansions, weights, points),
        "interpolate, grid": of(on_grid, expansions, points),
        "inverse_distance_weights": of(m.inverse_distance_weights, points, floats(SAMPLES, 3)),
        "make_expansion": of(m.make_expansion, points, floats(V, 3, K), floats(V, 3, K, 3)),
        "monomials": of(lambda o: m.monomials(o, 3), points),
        "moving_least_squares_weights": of(
            m.moving_least_squares_weights,
            points,
            floats(SAMPLES, 3),
            open=6,
            why="singular values of the samples, which a TPU finds by iteration",
        ),
        "polygon_harmonics": of(
            lambda c, p: m.polygon_harmonics(lamp(c), p, DEGREE), corners, points
        ),
        "polygon_harmonics, horizon": of(hidden(0, m.polygon_harmonics), points, points),
        "polygon_harmonics, blockers": of(
            hidden(3, m.polygon_harmonics), points, points, trips=18, why=memory
        ),
        "polygon_harmonics_with_gradient": of(
            lambda c, p: both(lamp(c), p, DEGREE), corners, points
        ),
        "polygon_harmonics_with_gradient, blocker": of(
            hidden(1, both), points, points, trips=4, why=memory
        ),
        "project_cube": of(lambda c: m.project_cube(c, DEGREE), cubes),
        "project_cube_with_gradient": of(lambda c: m.project_cube_with_gradient(c, DEGREE), cubes),
        "project_cube_with_gradient, edges": of(
            lambda c: m.project_cube_with_gradient(c, DEGREE, gradient="edges"), cubes
        ),
        "project_surface": of(lambda s, p: m.project_surface(s, p, DEGREE), few, points),
        "project_surface_with_gradient": of(
            lambda s, p: m.project_surface_with_gradient(s, p, DEGREE), few, points
        ),
        "shade": of(lambda e, t, w: m.shade(e, t, 0.5, weights=w), expansions, baked(), weights),
        "shade, grid": of(gridded, expansions, baked()),
        "sphere_harmonics": of(lambda p: m.sphere_harmonics(ball, p, DEGREE), points),
        "sphere_harmonics_with_gradient": of(
            lambda p: m.sphere_harmonics_with_gradient(ball, p, DEGREE), points
        ),
        "taylor": of(lambda c: m.taylor(c, DEGREE, 3), cubes),
        "visible_weights": of(
            lambda w, c, p: m.visible_weights(w, c, p).values,
            made_by(m.Weights, floats(V, CUBES)),
            cubes,
            points,
        ),
    }
