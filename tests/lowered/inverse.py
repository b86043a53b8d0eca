"""`jaxsh.inverse` at full size."""

import functools

import numpy as np

from jaxsh import inverse, midrange

from .shared import K, V, baked, floats, of

WITHOUT = {
    "light_variances": "a table",
    "rectangle_of": "of one light",
}

STEPS = "solvers: each step starts from the one before; a TPU factors matrices in loops, too"


def lamps(corners):
    return [midrange.Polygon(each, np.ones(3, np.float32)) for each in corners]


def calls():
    i, data = inverse, (floats(V, 3), baked(), floats(V, 3))
    fit = functools.partial(i.fit_light, degree=6, throw=False)
    materials = np.arange(V) % 5
    corners = np.array([[0, 0, 0], [0, 1, 0], [1, 1, 0], [1, 0, 0]], np.float32)
    corners = corners + np.array([[0, 0, 1], [1, 1, 1], [0, 1, 2], [2, 1, 2]], np.float32)[:, None]

    def robust(observed, made, albedo):
        return fit(observed, made, albedo, loss="huber", nonnegative="light").value

    def colored(observed, made):
        return fit(observed, made, 0.5, materials=materials).value

    def polygons(observed, made, albedo):
        made = made.truncated(4)
        starts = lamps(corners[:2]), lamps(corners[2:])
        return i.fit_polygons(observed, made, albedo, starts, throw=False).value

    def of_solver(function, *arguments, **options):
        return of(function, *arguments, reverse=False, why=STEPS, **options)

    return {
        "fit_colors": of_solver(
            lambda *data: i.fit_colors(*data, lamps(corners[:1]), throw=False).value,
            *data,
            trips=999,
        ),
        "fit_daylight": of_solver(
            lambda *data: i.fit_daylight(*data, throw=False).value, *data, trips=10, open=1
        ),
        "fit_daylight, normals": of_solver(
            lambda *data: i.fit_daylight(*data, throw=False).value,
            data[0],
            floats(V, 3),
            data[2],
            open=1,
        ),
        "fit_light": of(lambda *data: fit(*data).value, *data, trips=K, open=6, why=STEPS),
        "fit_light, normals": of(
            lambda *data: fit(*data).value,
            data[0],
            floats(V, 3),
            data[2],
            trips=K,
            open=6,
            why=STEPS,
        ),
        "fit_light, no prior": of(
            lambda *data: fit(*data, prior=None).value, *data, open=12, why=STEPS
        ),
        "fit_light, robust": of_solver(robust, *data, trips=K, open=8),
        "fit_light, materials": of_solver(colored, *data[:2], trips=K, open=4),
        "fit_polygons": of_solver(polygons, *data, trips=22, open=1),
        "fit_sky": of_solver(
            lambda *data: i.fit_sky(*data, throw=False).value, *data, trips=3, open=1
        ),
    }
