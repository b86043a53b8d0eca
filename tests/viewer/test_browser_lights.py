"""The lights in a real browser: the colors under sky, lamp and windows are Python's.

Needs what `test_browser.py` needs, and is skipped without.
"""

import jax.numpy as jnp
import numpy as np
import pytest
import viewer_pages as pages
from test_browser import CHROMIUM, colors, levels, opened
from test_lights import DEGREE, ball

from jaxsh import harmonics, imaging, midrange, sky, transfer, viewer

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium, which is not here"),
]


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    mesh, made, light, albedo = pages.example()
    path = tmp_path_factory.mktemp("lights") / "knot.html"
    shown = {"sky": viewer.Sky(scale=0.05), "lamp": viewer.Lamp(ball())}
    return viewer.export_html(path, made, light[:, :49], mesh.faces, albedo, exposure=1.5, **shown)


@pytest.fixture
def page(browser, file):
    faults = []
    page = opened(browser, file, faults)
    yield page
    page.context.close()
    assert faults == []


def drag(page, handle, x: float, y: float) -> None:
    box = handle.bounding_box()
    middle = box["x"] + box["width"] / 2, max(box["y"] + box["height"] / 2, 5)
    page.mouse.move(*middle)
    page.mouse.down()
    page.mouse.move(x, y, steps=2)
    page.mouse.up()


def apart(page, expected) -> float:
    """The largest difference of a vertex's color in levels of 8 bits."""
    shown = levels(np.asarray(expected))
    assert shown.std() > 20  # there is something to see
    return abs(levels(colors(page)) - shown).max()


def shaded(light):
    _, made, _, albedo = pages.example()
    return transfer.shade_diffuse(jnp.asarray(light, jnp.float32), made, albedo)


def lit_by(lamp, degree=DEGREE, window="none"):
    _, made, _, albedo = pages.example()
    positions = np.asarray(made.positions, np.float64)
    grid = midrange.grid_around(positions, (8, 8, 8))
    found = midrange.sphere_harmonics_with_gradient(lamp, grid.points, degree)
    weights = harmonics.window(window, degree)
    terms = midrange.make_expansion(grid.points, *found).terms * weights[None, None, :, None]
    cast = midrange.Expansion(grid.points, terms)
    return midrange.shade(cast, made, albedo, weights=grid.weights(positions), rule="half")


def test_the_sky_is_pythons_wherever_the_sun_is(page):
    page.evaluate("viewer.set({ index: 1 })")
    for sun, turbidity, window in (
        ([0.55, -0.65, 0.53], 3.0, "none"),
        ([-0.6, 0.5, 0.3], 5.5, "zonal-sinc"),
    ):
        facts = {"sun": sun, "turbidity": turbidity, "window": window}
        page.evaluate("(facts) => viewer.set(facts)", facts)
        clear = sky.preetham_harmonics(np.array(sun), turbidity, DEGREE)  # the precise table
        whole = clear + sky.sun_harmonics(np.array(sun), turbidity, DEGREE)
        softened = 0.05 * whole * harmonics.window(window, DEGREE)[None]
        said = {"imaging": imaging, "sky": sky, "jnp": jnp, "harmonics": harmonics}
        exec(page.evaluate("viewer.python()"), said)
        np.testing.assert_allclose(said["light"], softened, rtol=0, atol=1e-4)
        assert apart(page, shaded(softened)) < 0.1
    page.evaluate("viewer.set({ sun: [0.6, 0, -0.8] })")  # night
    exec(page.evaluate("viewer.python()"), said)
    assert not said["light"].any()


def test_the_sun_is_dragged_and_set_by_date_and_place(page):
    page.get_by_role("combobox").first.select_option("Clear sky")
    before = np.array(page.evaluate("viewer.state.sun"))
    box = page.locator(".jaxsh-ball").first.bounding_box()
    x, y = box["x"] + 40, box["y"] + 40
    page.mouse.move(x - 20, y + 20)
    page.mouse.down()
    page.mouse.move(x + 10, y + 20, steps=2)
    page.mouse.up()
    after = np.array(page.evaluate("viewer.state.sun"))
    assert after[2] == pytest.approx(before[2])  # around the vertical
    assert np.degrees(np.arccos(before @ after)) > 3
    drag(page, page.get_by_role("button", name="Sun:"), x - 20, y + 10)
    facts = page.evaluate("viewer.scene.camera")
    camera = imaging.Camera(*(np.array(facts[key]) for key in ("position", "target", "up")))
    across, up, forward = np.array(camera._axes())
    normal = -0.5 * across - 0.25 * up - np.sqrt(1 - 0.5**2 - 0.25**2) * forward
    mirrored = forward - 2 * (forward @ normal) * normal
    mirrored = np.where([False, False, mirrored[2] < 0], 0, mirrored)  # not below the horizon
    mirrored /= np.linalg.norm(mirrored)
    assert np.array(page.evaluate("viewer.state.sun")) @ mirrored > np.cos(np.radians(2))
    page.get_by_label("Latitude").fill("-33.87")
    page.get_by_label("Longitude").fill("151.2")
    page.get_by_label("Date").fill("2026-06-21")
    page.get_by_label("Date").press("Enter")
    page.get_by_label("Time (UTC)").fill("120")
    # Sydney at noon in winter: the sun is in the north, 90° - 33.87° - 23.44° high.
    sun = np.array(page.evaluate("viewer.state.sun"))
    assert np.degrees(np.arcsin(sun[2])) == pytest.approx(32.7, abs=0.2)
    assert sun[1] > 0.8
    page.get_by_label("Time (UTC)").fill("840")
    assert page.get_by_text("below the horizon").is_visible()
    assert colors(page).max() == 0


def test_a_lamp_shades_as_midrange_does_and_is_dragged(page):
    page.evaluate("viewer.set({ index: 2 })")
    assert apart(page, lit_by(ball())) < 0.1
    page.evaluate("viewer.set({ degree: 3, window: 'positive' })")
    assert apart(page, lit_by(ball(), 3, "positive")) < 0.1
    page.evaluate("viewer.set({ degree: 6, window: 'none' })")
    lamp = page.get_by_role("button", name="Lamp")
    box = lamp.bounding_box()
    drag(page, lamp, box["x"] + box["width"] / 2 + 60, max(box["y"] + box["height"] / 2, 5) + 10)
    place = np.array(page.evaluate("viewer.state.lamp"))
    assert np.linalg.norm(place - np.asarray(ball().center)) > 0.1
    moved = midrange.Sphere(jnp.asarray(place), ball().radius, ball().radiance)
    assert apart(page, lit_by(moved)) < 0.1
    said = {"imaging": imaging, "midrange": midrange, "jnp": jnp}
    exec(page.evaluate("viewer.python()"), said)
    np.testing.assert_allclose(said["ball"].center, place, rtol=0, atol=1e-8)
    lamp.press("ArrowRight")
    assert page.evaluate("viewer.state.lamp") != place.tolist()


def test_a_lamp_that_was_captured_moves_with_its_light(browser, tmp_path, rng):
    mesh, made, _, albedo = pages.example()
    positions = np.asarray(made.positions, np.float64)
    low, high = positions.min(axis=0) - 0.5, positions.max(axis=0) + 0.5
    grid = midrange.Grid(low, high, (3, 3, 4))
    colored = midrange.Sphere(ball().center, ball().radius, jnp.array([30.0, 10.0, 5.0]))
    other = midrange.Sphere(ball().center * -1.2, ball().radius, jnp.array([2.0, 8.0, 20.0]))
    c, gradient = (
        a + b
        for a, b in zip(
            *(
                midrange.sphere_harmonics_with_gradient(one, grid.points, 4)
                for one in (colored, other)
            ),
            strict=True,
        )
    )
    cast = midrange.make_expansion(grid.points, c, gradient)
    lamp = viewer.Lamp(cast, grid, position=ball().center)
    path = tmp_path / "field.html"
    truncated = made.truncated(4)
    viewer.export_html(path, truncated, None, mesh.faces, albedo, lamp=lamp, exposure=1.0)
    page = opened(browser, path, [])
    expected = midrange.shade(cast, truncated, albedo, weights=grid.weights(positions), rule="half")
    assert apart(page, expected) < 0.1
    shift = np.array([0.2, -0.1, 0.3])
    place = np.asarray(ball().center) + shift
    page.evaluate("(place) => viewer.set({ lamp: place })", place.tolist())
    moved = transfer.Transfer(
        truncated.coefficients,
        jnp.asarray(positions - shift, jnp.float32),
        truncated.normals,
        truncated.neighbors,
    )
    expected = midrange.shade(
        cast, moved, albedo, weights=grid.weights(positions - shift), rule="half"
    )
    assert apart(page, expected) < 0.1
    page.context.close()


def test_gloss_is_shade_glossy_from_every_eye(browser, tmp_path):
    mesh, made, light, albedo = pages.example()
    degree, made, light = 4, made.truncated(4), jnp.asarray(light[:, :25])
    material = transfer.Material(albedo, jnp.array([0.5, 0.4, 0.3]), 12.0)
    path = tmp_path / "gloss.html"
    viewer.export_html(path, made, light, mesh.faces, material, exposure=1.0, sky=viewer.Sky())
    page = opened(browser, path, [])
    eye = jnp.asarray(page.evaluate("viewer.state.camera.position"), jnp.float32)
    assert apart(page, transfer.shade_glossy(light, made, eye, material)) < 0.1
    box = page.locator("canvas").first.bounding_box()
    page.mouse.move(box["x"] + 100, box["y"] + 100)
    page.mouse.down()
    page.mouse.move(box["x"] + 190, box["y"] + 60, steps=2)
    page.mouse.up()
    page.evaluate("viewer.set({ window: 'hann', lobe: 1, gloss: 1.5 })")
    moved = jnp.asarray(page.evaluate("viewer.state.camera.position"), jnp.float32)
    assert abs(moved - eye).max() > 0.2
    dull = transfer.Material(albedo, 1.5 * material.specular, 2.0)
    softened = light * harmonics.window("hann", degree)[None].astype(jnp.float32)
    assert apart(page, transfer.shade_glossy(softened, made, moved, dull)) < 0.1
    page.context.close()
