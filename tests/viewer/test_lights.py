"""The lights that a page moves by itself: what it is told of them, and its JavaScript by Node."""

import datetime
import importlib.util
import json
import os
import shutil
import subprocess
from importlib.resources import files
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
import viewer_pages as pages

from jaxsh import harmonics, midrange, sky, viewer
from jaxsh.viewer import _lights

DEGREE = 6
NODE = shutil.which("node")


def ball():
    place = jnp.array([0.3, -1.4, 1.6])
    return midrange.Sphere(place, jnp.array(0.2), jnp.array([20.0, 15.0, 10.0]))


def lights_of(**given):
    _, made, _, _ = pages.example()
    return _lights.make_lights(None, given.get("sky"), given.get("lamp"), made.truncated(DEGREE))


def skies():
    suns = np.array([[0.55, -0.65, 0.53], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [-0.3, 0.8, 0.1]])
    suns /= np.linalg.norm(suns, axis=1, keepdims=True)
    hazes = np.array([3.0, 2.0, 10.0, 6.5])
    clear = np.asarray(sky.preetham_harmonics(suns, hazes, DEGREE, table="wide"))
    disc = np.asarray(sky.sun_harmonics(suns, hazes, DEGREE))
    return [
        {"sun": suns[i], "turbidity": hazes[i], "disc": bool(i < 3), "expected": each}
        for i, each in enumerate(clear + disc * (np.arange(4) < 3)[:, None, None])
    ]


def suns():
    if importlib.util.find_spec("ephem") is None:
        # PyEphem's, as in tests/sky: noon in Greenwich, and a morning in Sydney.
        return []
    times = ["1950-03-21T12:00Z", "2000-01-01T09:30Z", "2026-06-21T04:10Z", "2049-12-21T20:00Z"]
    places = [(51.48, 0.0), (-33.87, 151.2), (78.2, 15.6), (0.0, -70.0)]
    found = np.asarray(sky.sun_direction(times, *np.array(places).T))
    return [
        {
            "time": 1000 * datetime.datetime.fromisoformat(time).timestamp(),
            "latitude": place[0],
            "longitude": place[1],
            "expected": each,
        }
        for time, place, each in zip(times, places, found, strict=True)
    ]


def field(rng):
    grid = midrange.Grid(np.array([-1.0, -2.0, 0.0]), np.array([1.0, 1.0, 2.0]), (2, 3, 4))
    terms = rng.normal(size=(grid.size, 3, 9, 4))
    moved, places = np.array([0.3, -0.2, 0.1]), rng.uniform(-1, 1, size=(5, 3))
    places[0] = 2.0, 3.0, -1.0  # outside
    light = midrange.interpolate(
        midrange.Expansion(grid.points, terms),
        grid.weights(places - moved),
        places - moved,
        rule="half",
    )
    facts = {"lower": grid.lower, "upper": grid.upper, "shape": grid.shape}
    sent = terms.transpose(0, 3, 1, 2).ravel()
    return {"grid": facts, "terms": sent, "moved": moved, "places": places, "expected": light}


@pytest.mark.skipif(NODE is None, reason="needs node, which is not here")
def test_lights_in_javascript_agree_with_python(rng, tmp_path):
    lights = lights_of(sky=viewer.Sky(scale=1.0), lamp=viewer.Lamp(ball()))
    assert lights.kinds == ["sky", "lamp"]
    positions = np.asarray(pages.example()[1].positions, np.float64)
    points = np.asarray(midrange.grid_around(positions, (4, 4, 4)).points)
    c, gradient = midrange.sphere_harmonics_with_gradient(ball(), points, DEGREE)
    whole = np.concatenate(
        [np.asarray(c)[:, :1], np.asarray(gradient[:, 0]).swapaxes(1, 2)], axis=1
    )
    cuts = [("none", 6), ("hann", 2), ("lanczos", 6), ("zonal-sinc", 4), ("positive", 5)]
    numbers = {
        "folder": str(files("jaxsh.viewer").joinpath("js")),
        "header": lights.facts | {"degree": lights.degree},
        "skyTable": lights.arrays["skyTable"].ravel(),
        "skies": skies(),
        "suns": suns(),
        "lamp": ball().center,
        "points": points,
        "terms": whole.ravel() / 20,
        "field": field(rng),
        "cut": [
            {"window": kind, "degree": degree, "expected": harmonics.window(kind, degree)}
            for kind, degree in cuts
        ],
    }
    path = tmp_path / "numbers.json"
    path.write_text(json.dumps(numbers, default=lambda array: array.tolist()))
    run = subprocess.run(
        [NODE, "--test", str(Path(__file__).with_name("lights.test.mjs"))],
        env=os.environ | {"VIEWER_NUMBERS": str(path)},
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    assert "pass 7" in run.stdout
