"""Textured meshes and texels in a real browser: each pixel has the color that Python gives it.

Needs what `test_browser.py` needs, and is skipped without.
"""

import dataclasses
from collections.abc import Callable
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
import pytest
import viewer_pages as pages
from scipy.ndimage import binary_erosion
from test_browser import CHROMIUM, LOSE_AND_RESTORE, colors, levels, opened, read

from jaxsh import geometry, imaging, midrange, transfer, viewer
from jaxsh.viewer._lamp import lamp_radiance

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium, which is not here"),
]
WIDTH, HEIGHT, EXPOSURE, DEGREE = 192, 144, 3.0, 3
LIGHT = pages.example(300, DEGREE)[2]
LAMP = viewer.Lamp(
    midrange.Sphere(jnp.array([0.8, -2.0, 1.2]), jnp.array(0.2), jnp.array([60.0, 50.0, 40.0]))
)
MATERIAL = transfer.Material(0.9, 0.3, 8.0)


class Case(NamedTuple):
    """Holds a page, its transfer, and what carries numbers at its points to a picture's pixels."""

    page: Any
    made: transfer.Transfer
    mesh: geometry.Mesh
    camera: imaging.Camera
    raster: imaging.Raster
    carried: Callable

    def picture(self, width: int = WIDTH) -> np.ndarray:
        pixels = read(self.page, f"viewer.pixels({width}, {HEIGHT})", np.uint8)
        return pixels.reshape(HEIGHT, width, 4)

    def check(self, expected) -> None:
        """Compare pixels, of which 995 of 1000 must be within a step of 8 bits: edges need not."""
        picture, on_object = self.picture(), np.asarray(self.raster.mask)
        assert (on_object == (picture[..., 3] > 0)).mean() > 0.998
        inside = binary_erosion(on_object, np.ones((3, 3)))
        wanted = np.rint(levels(expected, EXPOSURE))
        apart = abs(picture[..., :3] - wanted).max(axis=-1)[inside]
        assert len(apart) > 8000
        assert wanted[inside].std() > 15
        assert (apart <= 1).mean() >= 0.995  # 0.9992 and more here


@pytest.fixture(scope="module", params=["vertices", "texels"])
def case(request, browser, tmp_path_factory):
    mesh = pages.textured()
    camera = imaging.Camera.facing(mesh, width=WIDTH, height=HEIGHT)
    raster = imaging.rasterize(mesh, camera)
    surface = mesh if request.param == "vertices" else geometry.texels(mesh, (96, 48))
    if request.param == "vertices":
        made = transfer.unshadowed(mesh.vertices, mesh.normals, DEGREE)
    else:
        made = transfer.unshadowed(surface.positions, surface.normals, DEGREE)
        made = dataclasses.replace(made, surface="texels")

    def carried(values):
        if surface is mesh:
            return imaging.interpolate(raster, values)
        return imaging.sample_texture(surface.image(values), raster.uv, wrap="clamp")

    path = viewer.export_html(
        tmp_path_factory.mktemp("surface") / "sphere.html",
        made,
        LIGHT,
        surface,
        MATERIAL,
        textured=True,
        camera=camera,
        exposure=EXPOSURE,
        lamp=LAMP,
        values={"fifth": np.arange(made.num_points) % 5},
    )
    faults = []
    page = opened(browser, path, faults)
    yield Case(page, made, mesh, camera, raster, carried)
    page.context.close()
    assert faults == []


def test_pixels_have_texture_and_gloss(case):
    page, made = case.page, case.made
    white = transfer.shade_diffuse(LIGHT, made, 0.9)
    shine = transfer.shade_glossy(LIGHT, made, case.camera.position, MATERIAL) - white
    lit = imaging.base_color(case.mesh, case.raster) * case.carried(white)
    case.check(lit + case.carried(shine))
    assert abs(levels(colors(page)) - levels(white)).max() < 0.1
    # The gloss that was shown a moment ago is gone.
    page.evaluate("viewer.set({ gloss: 0 })")
    case.check(lit)
    page.evaluate("viewer.reset()")


def test_a_lamp_near_the_mesh_has_the_texture_too(case):
    white = lamp_radiance(LAMP, case.made, DEGREE, 0.9)
    case.page.evaluate("viewer.set({ index: 1 })")
    case.check(imaging.base_color(case.mesh, case.raster) * case.carried(white))
    case.page.evaluate("viewer.reset()")


def test_a_lost_context_comes_back_with_its_pictures(case):
    before = case.picture()
    case.page.evaluate(LOSE_AND_RESTORE)
    np.testing.assert_array_equal(case.picture(), before)


def test_two_sides_have_light_of_their_own(case):
    page = case.page
    page.evaluate("viewer.set({ gloss: 0 }); viewer.set({ compare: true }); viewer.choose(1)")
    page.evaluate("viewer.set({ index: 0, gloss: 0, intensity: 0.5, degree: 3 })")
    signal = jnp.asarray(case.picture(2 * WIDTH)[..., :3] / np.float32(255))
    page.evaluate("viewer.reset()")
    left, right = np.split(np.asarray(imaging.srgb_decode(signal)), 2, axis=1)
    lit = (left > 0.2) & (left < 0.9)
    assert lit.sum() > 5000
    assert abs(right[lit] / left[lit] - 0.5).max() < 0.02  # half a step of each


def test_a_click_finds_the_point_and_levels_are_flat(case):
    page = case.page
    target = np.array([0.21, -0.3, 0.17])
    page.evaluate(
        "(target) => viewer.set({ camera: { ...viewer.state.camera, target } })", target.tolist()
    )
    page.evaluate("viewer.pick()")
    origin = np.asarray(case.camera.position, np.float32)
    ray = (target - origin).astype(np.float32)
    hit = geometry.ray_scene(case.mesh).closest_hit(origin[None], ray[None] / np.linalg.norm(ray))
    corners = np.asarray(case.mesh.vertices)[np.asarray(case.mesh.faces)[hit.face[0]]]
    apart = np.linalg.norm(np.asarray(case.made.positions) - hit.barycentric[0] @ corners, axis=1)
    assert page.evaluate("viewer.state.vertex") == apart.argmin()
    page.evaluate("viewer.reset(); viewer.set({ look: 2, over: 1 })")
    inside = binary_erosion(np.asarray(case.raster.mask), np.ones((3, 3)))
    shown = case.picture()[..., :3][inside]
    page.evaluate("viewer.reset()")
    assert len(np.unique(shown, axis=0)) == 5
