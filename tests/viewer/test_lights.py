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

from jaxsh import geometry, harmonics, midrange, sky, transfer, viewer
from jaxsh.viewer import _gloss, _lamp, _lights

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
    if importlib.util.find_spec("ephem") is None:  # then nothing is compared
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
    grid = midrange.grid_around(np.asarray(pages.example()[1].positions, np.float64), (4, 4, 4))
    lights = lights_of(sky=viewer.Sky(scale=1.0), lamp=viewer.Lamp(ball(), grid))
    assert lights.kinds == ["sky", "lamp"]
    points = np.asarray(grid.points)
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
    assert "pass 8" in run.stdout


def test_what_does_not_fit_is_refused(unchecked):
    grid = midrange.Grid(np.zeros(3), np.ones(3), (2, 2, 2))
    fine = midrange.Grid(np.zeros(3), np.ones(3), (9, 8, 8))
    light = midrange.Expansion(grid.points, np.ones((8, 3, 4, 4)))
    for message, made in (
        ("not below the horizon", lambda: viewer.Sky(sun=(1, 0, -0.1))),
        (r"expected sun as a vector \(3,\)", lambda: viewer.Sky(sun=(0.0, 0.0, 0.0))),
        ("turbidity must be a number >= 2 and <= 10", lambda: viewer.Sky(turbidity=1.9)),
        ("expected time with a time zone", lambda: viewer.Sky(time="2026-06-21T10:00")),
        ("expected time in ISO form", lambda: viewer.Sky(time="noon")),
        ("expected place as latitude", lambda: viewer.Sky(place=(91.0, 0.0))),
        ("needs the grid and the position", lambda: viewer.Lamp(light, grid)),
        ("at the grid's 8 samples", lambda: viewer.Lamp(light.truncated(0), grid, np.ones(3))),
        ("at most 512 samples", lambda: viewer.Lamp(ball(), fine)),
        (
            "expansion of degree 6 or more, got 1",
            lambda: lights_of(lamp=viewer.Lamp(light, grid, np.ones(3))),
        ),
        ("expected a light, a sky or a lamp, got none", lights_of),
    ):
        with pytest.raises(ValueError, match=message):
            made()


def test_gloss_that_differs_by_vertex_is_refused(tmp_path):
    mesh, made, light, albedo = pages.example()
    material = transfer.Material(albedo, albedo, 8.0)
    with pytest.raises(ValueError, match="expected a material with one specular albedo"):
        viewer.export_html(tmp_path / "a.html", made, light, mesh.faces, material)


def test_gloss_that_would_fill_the_memory_is_refused():
    material = transfer.Material(0.5, 0.5, 8.0)
    with pytest.raises(ValueError, match="expected at most 512 MiB for gloss of degree 10, but"):
        _gloss.gloss_facts(material, 10, 400_000)


def test_a_flat_mesh_has_a_grid_around_it():
    flat = np.array([[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [0.0, 1.0, 1.0]])
    facts, terms = _lamp.lamp_part(viewer.Lamp(ball()), flat, 1)
    assert terms is None
    lower, upper = (np.array(facts["grid"][end]) for end in ("lower", "upper"))
    assert (upper > lower).all()
    np.testing.assert_allclose((lower + upper) / 2, [1.0, 0.5, 1.0], rtol=0, atol=1e-12)


def test_a_sky_is_as_bright_as_the_light_beside_it():
    _, made, light, _ = pages.example()
    light = light[:, :49]
    lights = _lights.make_lights(light, viewer.Sky(), None, made)
    assert lights.kinds == ["given", "sky"]
    assert lights.names() == ["Light 1", "Clear sky"]
    coefficients = np.asarray(made.coefficients, np.float64)[:, :49]
    means = [(coefficients @ one.T).mean() for one in lights.coefficients]
    assert means[1] == pytest.approx(means[0], rel=1e-9)
    known = sky.preetham_harmonics(np.array([0.55, -0.65, 0.53]), 3.0, DEGREE, table="wide")
    assert lights.facts["sky"]["gain"] > 0
    alone = lights_of(sky=viewer.Sky(disc=False))
    np.testing.assert_allclose(alone.coefficients[0], known, rtol=0, atol=1e-12)


@pytest.mark.slow
def test_a_lamp_of_512_samples_errs_by_a_hundredth():
    mesh = geometry.knot(1500)
    made = transfer.unshadowed(mesh.vertices, mesh.normals, DEGREE)
    near = midrange.Sphere(jnp.array([0.6, -0.85, 0.6]), jnp.array(0.1), jnp.ones(3))
    exact = transfer.shade_diffuse(
        midrange.sphere_harmonics(near, mesh.vertices, DEGREE), made, 1.0
    )
    found = _lamp.lamp_radiance(viewer.Lamp(near), made, DEGREE, 1.0)
    share = np.sqrt(((found - exact) ** 2).mean() / (exact**2).mean())
    assert share < 0.011  # 0.0096
    distance = np.linalg.norm(np.asarray(mesh.vertices) - [0.6, -0.85, 0.6], axis=1).min()
    assert distance < 0.44 * 1.0515  # of the mesh's radius
