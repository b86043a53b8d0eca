"""The page in a real browser: its colors and its picture are Python's, and nothing leaves it.

Needs Playwright and a Chromium that is installed (`CHROMIUM=path` names one); skipped without.
Software draws, so that every machine draws the same.
"""

import base64

import jax.numpy as jnp
import numpy as np
import pytest
import viewer_pages as pages
from scipy.ndimage import binary_erosion

from jaxsh import harmonics, imaging, transfer, viewer
from jaxsh.viewer._script import script, styles

CHROMIUM = pages.chromium()
pytest.importorskip("playwright.sync_api", reason="needs the package playwright")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium, which is not here"),
]
# Python's bytes of a typed array of the page.
AS_TEXT = """(values) => {
  const bytes = new Uint8Array(values.buffer, values.byteOffset, values.byteLength);
  let text = "";
  for (const byte of bytes) text += String.fromCharCode(byte);
  return btoa(text);
}"""

LOSE_AND_RESTORE = """async () => {
  const lose = viewer.renderer.gl.getExtension("WEBGL_lose_context");
  const back = new Promise((done) =>
    viewer.canvas.addEventListener("webglcontextrestored", () => setTimeout(done, 50)));
  lose.loseContext();
  await new Promise((done) => setTimeout(done, 50));
  lose.restoreContext();
  await back;
}"""


def opened(browser, file, faults: list[str]):
    """A page in a new window, when it has drawn; what goes wrong is written into `faults`."""
    page = browser.new_context(viewport={"width": 800, "height": 600}).new_page()
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("console", lambda said: faults.append(said.text) if said.type == "error" else None)
    own = ("data:", "blob:", file.as_uri())
    page.on("request", lambda one: one.url.startswith(own) or faults.append(one.url))
    page.goto(file.as_uri())
    page.locator("main canvas").first.wait_for()  # the page's policy forbids to wait for a function
    page.evaluate("globalThis.viewer = document.getElementById('viewer').viewer")
    return page


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    mesh, made, light, albedo = pages.example()
    lights = np.stack([light, light[::-1]])
    path = tmp_path_factory.mktemp("browser") / "knot.html"
    return viewer.export_html(path, made, lights, mesh.faces, albedo, exposure=1.5)


@pytest.fixture
def page(browser, file):
    """The page; fails where a script does, or where something is asked for."""
    faults = []
    page = opened(browser, file, faults)
    yield page
    page.context.close()
    assert faults == []


def read(page, expression: str, dtype) -> np.ndarray:
    return np.frombuffer(base64.b64decode(page.evaluate(f"({AS_TEXT})({expression})")), dtype)


def levels(colors, exposure: float = 1.0) -> np.ndarray:
    return 255 * np.asarray(imaging.tone_map(jnp.asarray(colors), exposure))


def colors(page) -> np.ndarray:
    return read(page, "viewer.colors()", np.float32).reshape(-1, 3)


def test_colors_are_pythons(page):
    _, made, light, albedo = pages.example()
    shaded = transfer.shade_diffuse(light, made, albedo)
    # 0.006 here.
    assert abs(levels(colors(page)) - levels(shaded)).max() < 0.1
    page.evaluate("viewer.set({ index: 1, intensity: 0.5, degree: 3 })")
    shaded = transfer.shade_diffuse(0.5 * light[::-1, :16], made, albedo)
    assert abs(levels(colors(page)) - levels(shaded)).max() < 0.1


def test_shift_and_drag_turn_the_light(page):
    _, made, light, albedo = pages.example()
    box = page.locator("canvas").first.bounding_box()
    x, y = box["x"] + 100, box["y"] + 100
    across = 60 * np.pi / min(box["width"], box["height"])  # about +z, which is up
    page.keyboard.down("Shift")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 60, y, steps=3)
    page.mouse.up()
    page.keyboard.up("Shift")
    turned = harmonics.rotate_z(light.astype(np.float64), across)
    shaded = transfer.shade_diffuse(np.asarray(turned, np.float32), made, albedo)
    assert abs(levels(colors(page)) - levels(shaded)).max() < 0.1
    assert page.evaluate(
        "viewer.state.camera.position.join() === viewer.scene.camera.position.join()"
    )
    page.get_by_role("button", name="Reset").click()
    shaded = transfer.shade_diffuse(light, made, albedo)
    assert abs(levels(colors(page)) - levels(shaded)).max() < 0.1


def test_the_picture_is_imagings(browser, tmp_path):
    mesh, _, light, _ = pages.example(3000, 4)
    made = transfer.unshadowed(mesh.vertices, mesh.normals, 4)
    camera = imaging.Camera.facing(mesh, width=192, height=144)
    path = tmp_path / "picture.html"
    viewer.export_html(path, made, light, mesh.faces, camera=camera, exposure=1.5)
    raster = imaging.rasterize(mesh, camera)
    shaded = transfer.shade_diffuse(light, made, 0.8)
    expected = np.rint(levels(imaging.interpolate(raster, shaded), 1.5))
    page = opened(browser, path, [])
    picture = read(page, "viewer.pixels(192, 144)", np.uint8).reshape(144, 192, 4)
    page.context.close()
    on_object = np.asarray(raster.mask)
    # Where a pixel's center is on an edge, either answer is right.
    assert (on_object == (picture[..., 3] > 0)).mean() > 0.999
    inside = binary_erosion(on_object, np.ones((3, 3)))
    apart = abs(picture[..., :3] - expected).max(axis=-1)[inside]
    assert len(apart) > 8000
    assert expected[inside].std() > 15
    assert (apart <= 1).mean() >= 0.99


def test_a_drag_orbits_and_sliders_are_moved_by_keys(page):
    before = colors(page)
    box = page.locator("canvas").first.bounding_box()
    page.mouse.move(box["x"] + 100, box["y"] + 100)
    page.mouse.down()
    page.mouse.move(box["x"] + 150, box["y"] + 120, steps=2)
    page.mouse.up()
    moved = page.evaluate("viewer.state.camera.position")
    assert moved != page.evaluate("viewer.scene.camera.position")
    np.testing.assert_array_equal(colors(page), before)
    page.get_by_label("Degree of the light").press("ArrowLeft")
    assert page.evaluate("viewer.state.degree") == pages.DEGREE - 1
    page.get_by_label("Exposure").press("ArrowRight")
    assert page.evaluate("viewer.state.exposure") == pytest.approx(2**0.1)
    page.locator("select").first.select_option("Light 2")
    assert page.evaluate("viewer.state.index") == 1


def test_the_ball_mirrors_the_light_and_turns_it(page):
    _, _, light, _ = pages.example()
    page.evaluate("new Promise(requestAnimationFrame)")
    ball = "viewer.overlay.balls[0].context.getImageData(0, 0, 80, 80).data"
    picture = read(page, ball, np.uint8).reshape(80, 80, 4)
    facts = page.evaluate("viewer.scene.camera")
    camera = imaging.Camera(*(np.array(facts[key]) for key in ("position", "target", "up")))
    axes = np.array(camera._axes()) * [[1], [1], [-1]]  # to the right, upwards, towards the eye
    at = (np.array([[40, 40], [20, 60], [70, 30]]) + 0.5) / 40 - 1  # row and column
    x, y = at[:, 1], -at[:, 0]
    z = np.sqrt(1 - x**2 - y**2)
    mirrored = np.stack([2 * z * x, 2 * z * y, 2 * z * z - 1], axis=-1) @ axes
    radiance = np.asarray(harmonics.evaluate(mirrored, pages.DEGREE)) @ light.T
    found = picture[[40, 20, 70], [40, 60, 30], :3]
    assert abs(found - levels(radiance, 1.5)).max() <= 0.6
    page.locator(".jaxsh-ball").first.drag_to(
        page.locator(".jaxsh-ball").first,
        source_position={"x": 20, "y": 40},
        target_position={"x": 60, "y": 40},
    )
    assert page.evaluate("viewer.state.rotation[0][1]") < -0.05


def test_a_lost_context_comes_back(page):
    before = colors(page)
    page.evaluate(LOSE_AND_RESTORE)
    np.testing.assert_array_equal(colors(page), before)


def test_transfer_in_clusters_is_unpacked(browser, tmp_path):
    mesh, made, light, albedo = pages.example(300, 4)
    small = transfer.compress(made, clusters=6, components=5)
    path = viewer.export_html(tmp_path / "small.html", small, light, mesh.faces, albedo)
    page = opened(browser, path, [])
    shaded = transfer.shade_diffuse(light, small.decompressed(), albedo)
    assert abs(levels(colors(page)) - levels(shaded)).max() < 0.1
    page.context.close()


@pytest.mark.parametrize("size", [(1280, 800), (390, 844)])
def test_all_of_the_panel_can_be_reached(page, size):
    page.set_viewport_size({"width": size[0], "height": size[1]})
    for label in ("Exposure", "Intensity of the light", "Degree of the light"):
        page.get_by_label(label).scroll_into_view_if_needed()
        assert page.get_by_label(label).bounding_box()["width"] > 100
    assert page.evaluate("document.documentElement.scrollWidth") <= size[0]
    box = page.locator("canvas").first.bounding_box()
    assert box["height"] > 0.5 * size[1]


HARNESS = """async ([code, header, text]) => {
  const { default: widget } = await import(URL.createObjectURL(
    new Blob([code], { type: "text/javascript" })));
  const listeners = {};
  const state = { lights: header.lights, height: 300, moved: {} };
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  globalThis.model = {
    get: (name) => state[name],
    set: (name, value) => { state[name] = value; listeners[`change:${name}`]?.(); },
    on: (name, call) => { listeners[name] = call; },
    off: (name) => { delete listeners[name]; },
    // As Jupyter sends it: one of several parts of a message, which start anywhere.
    send: (message) => {
      const whole = new Uint8Array(bytes.length + 1);
      whole.set(bytes, 1);
      const view = new DataView(whole.buffer, 1, bytes.length);
      setTimeout(() => listeners["msg:custom"]({ kind: "scene", header }, [view]));
    },
  };
  const el = document.body.appendChild(document.createElement("div"));
  globalThis.clean = widget.render({ model: globalThis.model, el });
  globalThis.listeners = listeners;
  await new Promise((done) => setTimeout(done, 200));
  globalThis.viewer = el.firstChild.viewer;
}"""


def test_the_widget_draws_and_follows_its_light(browser, file):
    _, made, light, albedo = pages.example()
    header, arrays, _ = pages.parts(file)
    page = browser.new_context().new_page()
    page.add_style_tag(content=styles())
    page.evaluate(HARNESS, [script("widget"), header, base64.b64encode(arrays).decode()])
    shaded = transfer.shade_diffuse(light, made, albedo)
    assert abs(levels(colors(page)) - levels(shaded)).max() < 0.1
    page.evaluate("(lights) => model.set('lights', lights)", (0.5 * light[None]).tolist())
    assert abs(levels(colors(page)) - levels(0.5 * shaded)).max() < 0.1
    assert page.locator("canvas").first.bounding_box()["height"] == 300
    # What Python did not move anew stays as it is on the page.
    page.evaluate("model.set('moved', { exposure: 2 }); viewer.set({ exposure: 3 })")
    page.evaluate("model.set('moved', { exposure: 2, degree: 4 })")
    assert page.evaluate("[viewer.state.exposure, viewer.state.degree]") == [3, 4]
    page.evaluate("clean()")
    assert page.evaluate("Object.keys(listeners)") == []
    page.context.close()
