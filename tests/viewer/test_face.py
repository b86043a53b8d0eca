"""The viewer's face in a real browser: false color, two sides, a vertex's transfer, keys and touch.

Needs what `test_browser.py` needs, and is skipped without.
"""

import io

import jax.numpy as jnp
import matplotlib
import numpy as np
import pytest
import viewer_pages as pages
from PIL import Image
from scipy.ndimage import binary_erosion
from test_browser import CHROMIUM, levels, opened, read

from jaxsh import harmonics, imaging, transfer, viewer

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium, which is not here"),
]
WIDTH, HEIGHT = 192, 144
FRAMES = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
SIZE = {"width": 800, "height": 600}
# The canvas follows the window, which on a busy machine takes longer than two frames.
SIZED = """new Promise((done) => {
  const { canvas } = viewer;
  const width = () => Math.round(canvas.clientWidth * devicePixelRatio);
  const ready = () => innerWidth === 800 && canvas.width === width();
  const look = () => (ready() ? done() : requestAnimationFrame(look));
  look();
})"""


@pytest.fixture(scope="module")
def scene():
    """A knot under a light that rings below zero, with a value and levels at its vertices."""
    mesh, _, _, _ = pages.example(3000, 4)
    made = transfer.unshadowed(mesh.vertices, mesh.normals, 4)
    sun = 1.5 * np.asarray(harmonics.evaluate(np.array([0.3, -0.6, 0.74]), 4))
    light = np.stack([sun, 0.8 * sun, 0.6 * sun]).astype(np.float32)
    height = np.asarray(mesh.vertices)[:, 2]
    values = {"height": height, "third": np.digitize(height, [-0.2, 0.2])}
    return mesh, made, light, values


@pytest.fixture(scope="module")
def window(browser, scene, tmp_path_factory):
    mesh, made, light, values = scene
    path = tmp_path_factory.mktemp("face") / "knot.html"
    camera = imaging.Camera.facing(mesh, width=WIDTH, height=HEIGHT)
    lights = np.stack([light, light[::-1]])
    viewer.export_html(path, made, lights, mesh.faces, camera=camera, exposure=1.5, values=values)
    faults = []
    page = opened(browser, path, faults)
    yield page, faults
    page.context.close()


@pytest.fixture
def page(window):
    """The page as it is at first; fails where a script does, or where something is asked for."""
    page, faults = window
    page.set_viewport_size(SIZE)
    page.evaluate("viewer.reset()")
    page.evaluate(SIZED)
    page.evaluate(FRAMES)
    yield page
    assert faults == []


@pytest.fixture(scope="module")
def seen(scene):
    """What a camera's pixels hold of a mesh: those inside, and a function of vertices' values."""
    mesh, *_ = scene
    raster = imaging.rasterize(mesh, imaging.Camera.facing(mesh, width=WIDTH, height=HEIGHT))
    inside = binary_erosion(np.asarray(raster.mask), np.ones((3, 3)))

    def at(values):
        rows = jnp.asarray(values, jnp.float32).reshape(len(mesh.vertices), -1)
        return np.asarray(imaging.interpolate(raster, jnp.broadcast_to(rows, (len(rows), 3))))

    return inside, at


def picture(page) -> np.ndarray:
    pixels = read(page, f"viewer.pixels({WIDTH}, {HEIGHT})", np.uint8)
    return pixels.reshape(HEIGHT, WIDTH, 4)[..., :3].astype(int)


def viridis(numbers) -> np.ndarray:
    return 255 * matplotlib.colormaps["viridis"](np.clip(numbers, 0, 1))[..., :3]


def test_luminance_in_false_color_is_pythons(page, scene, seen):
    _, made, light, _ = scene
    inside, at = seen
    page.evaluate("viewer.chooseLook(1)")
    found = picture(page)
    luminance = at(transfer.shade_diffuse(light, made, 0.8)) @ [0.2126, 0.7152, 0.0722]
    above, below = inside & (luminance > 1e-3), inside & (luminance < -1e-3)
    apart = abs(found - viridis(1.5 * luminance)).max(axis=-1)
    # The ramp has 33 colors for matplotlib's 256.
    assert (apart[above] <= 3).mean() >= 0.99
    assert above.sum() > 3000
    gray = found[below]
    assert below.sum() > 200
    assert (np.ptp(gray, axis=-1) == 0).all()
    assert set(np.unique(gray)) == {115, 191}
    page.evaluate(FRAMES)
    bar = page.get_by_role("img", name="Color bar: Luminance")
    assert bar.get_attribute("aria-label").endswith("from 0 to 0.6667")


def test_values_and_levels_have_the_colors_of_the_bar(page, scene, seen):
    *_, values = scene
    inside, at = seen
    page.get_by_label("Colors").select_option("height")
    height = values["height"]
    unit = (at(height)[..., 0] - height.min()) / np.ptp(height)
    apart = abs(picture(page) - viridis(unit)).max(axis=-1)[inside]
    assert (apart <= 3).mean() >= 0.99
    page.get_by_label("Colors").select_option("third")
    assert page.evaluate("viewer.state.over") == pytest.approx(0.7)
    page.evaluate("viewer.set({ over: 1 })")
    found = picture(page)[inside]
    expected = viridis(np.array([0, 0.5, 1]))
    apart = abs(found[:, None] - expected).max(axis=-1)
    # None in between, also where the lowest is beside the highest.
    assert (apart.min(axis=1) <= 2).all()
    assert set(apart.argmin(axis=1)) == {0, 1, 2}


def test_two_sides_have_lights_of_their_own_and_one_camera(page, scene):
    _, made, light, _ = scene
    page.get_by_role("button", name="Compare two lights").click()
    lit = {0: light, 1: light[::-1]}
    for side, own in lit.items():
        expected = levels(transfer.shade_diffuse(own, made, 0.8))
        assert abs(levels(colors_of(page, side)) - expected).max() < 0.1
    page.locator(".jaxsh-choice span", has_text="B").click()
    page.get_by_label("Degree of the light").press("ArrowLeft")
    cut = transfer.shade_diffuse(light[::-1, :16], made, 0.8)
    assert abs(levels(colors_of(page, 1)) - levels(cut)).max() < 0.1
    whole = transfer.shade_diffuse(light, made, 0.8)
    assert abs(levels(colors_of(page, 0)) - levels(whole)).max() < 0.1
    halves = read(page, "viewer.pixels(320, 120)", np.uint8).reshape(120, 2, 160, 4)
    alpha = halves[..., 3] > 0
    assert alpha[:, 0].sum() > 1000
    np.testing.assert_array_equal(alpha[:, 0], alpha[:, 1])
    assert (halves[:, 0] != halves[:, 1]).any(axis=-1)[alpha[:, 0]].mean() > 0.5
    page.set_viewport_size({"width": 390, "height": 844})
    page.evaluate(FRAMES)
    [[left, top, *size], other] = page.evaluate("[viewer.rectangle(0), viewer.rectangle(1)]")
    assert other == pytest.approx([left, top + size[1], *size], abs=1)
    page.evaluate("viewer.set({ compare: false })")
    assert page.evaluate("viewer.side") == 0


def colors_of(page, side: int) -> np.ndarray:
    return read(page, f"viewer.colors({side})", np.float32).reshape(-1, 3)


def test_a_click_shows_the_transfer_of_a_vertex(page, scene):
    mesh, made, _, _ = scene
    box = page.locator("canvas").first.bounding_box()
    spots = [(x, y) for y in range(150, 450, 50) for x in range(150, 450, 50)]
    for x, y in spots:
        page.mouse.click(box["x"] + x, box["y"] + y)
        vertex = page.evaluate("viewer.state.vertex")
        if vertex is not None:
            break
    card = page.locator(".jaxsh-card")
    card.wait_for()
    assert f"Vertex {vertex}" in card.inner_text()
    # It stands where the click was.
    camera = imaging.Camera.facing(mesh, width=WIDTH, height=HEIGHT)
    away = np.asarray(mesh.vertices)[vertex] - np.asarray(camera.position)
    axes = np.array(camera._axes())
    across, over, depth = axes @ away
    scale = box["height"] / 2 / np.tan(np.deg2rad(camera.fov_y / 2))
    scale /= max(1, WIDTH / HEIGHT * box["height"] / box["width"])
    at = box["width"] / 2 + across / depth * scale, box["height"] / 2 - over / depth * scale
    np.testing.assert_allclose(at, [x, y], rtol=0, atol=25)
    ways = np.array(page.evaluate("viewer.lobe.grid.directions.filter((_, i) => i % 97 === 0)"))
    for degree in (4, 2):
        amounts = read(page, f"viewer.lobe.amountsOf({vertex}, {degree})", np.float32)[::97]
        basis = np.asarray(harmonics.evaluate(ways, degree))
        expected = basis @ np.asarray(made.coefficients)[vertex, : (degree + 1) ** 2]
        np.testing.assert_allclose(amounts, expected, rtol=0, atol=1e-3)
    shown = picture(page)
    page.keyboard.press("Escape")
    assert page.evaluate("viewer.state.vertex") is None
    assert (shown != picture(page)).any(axis=-1).sum() > 200
    assert card.is_hidden()


def test_the_view_as_python_draws_the_same(page, scene):
    mesh, *_ = scene
    page.evaluate("viewer.view.turnBy(0.4, -0.3, 'camera'); viewer.view.move(30, -20)")
    page.evaluate("viewer.view.turnBy(0.2, 0.1, 'light')")
    for width, height in ((220, 120), (120, 200)):
        page.evaluate(f"viewer.canvas.width = {width}; viewer.canvas.height = {height}")
        made = {}
        exec(page.evaluate("viewer.python()"), {"imaging": imaging}, made)
        assert (made["camera"].width, made["camera"].height) == (width, height)
        assert made["exposure"] == 1.5
        mask = np.asarray(imaging.rasterize(mesh, made["camera"]).mask)
        pixels = read(page, f"viewer.pixels({width}, {height})", np.uint8)
        assert ((pixels.reshape(height, width, 4)[..., 3] > 0) == mask).mean() > 0.999
    page.set_viewport_size({"width": 500, "height": 500})  # and the canvas with it
    rotation = page.evaluate("viewer.state.rotation")
    np.testing.assert_allclose(made["rotation"], rotation, rtol=0, atol=1e-8)
    page.locator("canvas").first.press("p")
    page.get_by_text("Copied as Python").wait_for()


def test_the_png_is_transparent_beside_the_mesh_and_smooth(page):
    page.evaluate("viewer.chooseLook(2)")
    with page.expect_download() as saved:
        page.get_by_role("button", name="Save PNG").click()
    page.wait_for_timeout(300)
    middle = {"x": 150, "y": 200, "width": 200, "height": 200}
    with Image.open(io.BytesIO(page.screenshot(clip=middle))) as image:
        assert np.ptp(np.asarray(image.convert("L")).astype(int)) > 20  # the mesh is still seen
    with Image.open(io.BytesIO(saved.value.path().read_bytes())) as image:
        pixels = np.asarray(image).astype(int)
    size = page.evaluate("[viewer.canvas.height, viewer.canvas.width]")
    assert list(pixels.shape) == [*size, 4]
    alpha = pixels[..., 3]
    assert (alpha[:5] == 0).all()
    assert (alpha[:, -5:] == 0).all()
    assert ((alpha > 0) & (alpha < 255)).sum() > 500  # edges
    bar = pixels[-70:, 12:232]
    assert (bar[..., 3] > 200).mean() > 0.8


def test_keys_and_reset(page):
    canvas = page.locator("canvas").first
    first = page.evaluate("viewer.state.camera.position")
    for key, expression, expected in (
        ("c", "viewer.state.compare", True),
        ("c", "viewer.state.compare", False),
        ("f", "viewer.state.look", 1),
        ("f", "viewer.state.look", 2),
        ("ArrowLeft", f"viewer.state.camera.position.join() === '{first}'", False),
        ("Shift+ArrowUp", "viewer.state.rotation[1][1] === 1", False),
        ("r", "[viewer.state.look, viewer.state.rotation[1][1]].join()", "0,1"),
    ):
        canvas.press(key)
        assert page.evaluate(expression) == expected
    assert page.evaluate("viewer.state.camera.position") == first


def test_fingers_orbit_pinch_and_move(page):
    touch = page.context.new_cdp_session(page)

    def put(kind, *points):
        places = [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(points)]
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": places})

    def camera():
        facts = page.evaluate("viewer.state.camera")
        return np.array(facts["position"]), np.array(facts["target"])

    position, target = camera()
    put("touchStart", (200, 300))
    put("touchMove", (230, 300))
    put("touchEnd")
    orbited, kept = camera()
    np.testing.assert_array_equal(kept, target)
    distance = np.linalg.norm(position - target)
    assert np.linalg.norm(orbited - position) > 0.1 * distance
    put("touchStart", (200, 300), (300, 300))
    put("touchMove", (150, 300), (350, 300))
    put("touchEnd")
    near, kept = camera()
    np.testing.assert_allclose(np.linalg.norm(near - kept) / distance, 0.5, rtol=0, atol=0.02)
    put("touchStart", (200, 300), (300, 300))
    put("touchMove", (200, 340), (300, 340))
    put("touchEnd")
    _, moved = camera()
    assert moved[2] > kept[2] + 0.01
    assert page.evaluate("viewer.state.vertex") is None
