"""Make the page and the pictures of `docs/viewer.md`: a knot under several lights.

python tools/make_viewer_example.py docs [--pictures]

The pictures, with `--pictures` these alone, need the package playwright and a Chromium that is
installed; `CHROMIUM=path` names one.
"""

import os
import shutil
import sys
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike

from jaxsh import adaptive, geometry, harmonics, imaging, midrange, sphere, transfer, viewer

DEGREE = 6


def make_page(path: Path) -> Path:
    mesh = geometry.knot(4000)
    baked = transfer.bake(mesh, degree=DEGREE, directions=1024, bounces=1, progress=False)
    studio = sphere.project_lat_long(imaging.studio(), DEGREE)
    lights = {
        "studio, softened": studio * harmonics.window("hann", DEGREE),
        "studio as it is": studio,
    }
    ball = midrange.Sphere(
        jnp.array([0.6, -0.85, 0.6]), jnp.array(0.1), jnp.array([90.0, 75.0, 55.0])
    )
    return viewer.export_html(
        path,
        baked,
        jnp.stack(list(lights.values())),
        mesh.faces,
        albedo=np.array([0.8, 0.62, 0.48]),
        names=[*lights, "clear sky: drag the sun", "a lamp: drag it"],
        sky=viewer.Sky(),
        lamp=viewer.Lamp(ball),
        values=values_of(mesh, baked, studio),
        title="A knot to relight",
    )


def values_of(mesh: geometry.Mesh, baked: transfer.Transfer, light: ArrayLike) -> dict:
    """What the vertices see of an even sky, and to which degree Lee & Kim's filter goes there."""
    seen = baked.coefficients[:, 0] * np.sqrt(4 / np.pi)  # 1 without shadows and bounces
    material = transfer.Material(0.5, 0.3, 20.0)
    eye = imaging.Camera.facing(mesh).position
    method = adaptive.Levels(threshold=0.1, rings=1)
    result = adaptive.shade(light, baked, eye, material, method)
    kept = np.asarray(result.shown_degree["specular"])
    return {
        "Even light that arrives": np.asarray(seen),
        "Glossy degree kept (Lee & Kim)": kept,
    }


# Each picture: its name, its size, whether it is dark, and what the page is set to.
PICTURES = (
    (
        "viewer",
        (1200, 640),
        False,
        # The sky on side B, softened; a vertex of the knot.
        "viewer.set({ compare: true }); viewer.choose(1); "
        "viewer.set({ index: 2, window: 'hann' }); viewer.choose(0); viewer.pick(340, 245)",
    ),
    ("viewer-lamp", (960, 540), False, "viewer.set({ index: 3 })"),
    ("viewer-levels", (960, 560), False, "viewer.chooseLook(3)"),
    ("viewer-phone", (390, 760), True, "viewer.chooseLook(1)"),
)


def make_pictures(page: Path, folder: Path) -> None:
    from playwright.sync_api import sync_playwright

    chromium = os.environ.get("CHROMIUM") or shutil.which("chromium")
    software = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    options = [*software, "--no-sandbox", "--disable-dev-shm-usage"]
    with sync_playwright() as started:
        browser = started.chromium.launch(executable_path=chromium, args=options)
        for name, (width, height), dark, state in PICTURES:
            shown = browser.new_page(
                viewport={"width": width, "height": height},
                color_scheme="dark" if dark else "light",
                device_scale_factor=1,
            )
            shown.goto(page.resolve().as_uri())
            shown.locator("main canvas").first.wait_for()
            shown.evaluate("globalThis.viewer = document.getElementById('viewer').viewer")
            shown.evaluate(state)
            shown.wait_for_timeout(1000)
            shown.screenshot(path=folder / f"{name}.png")
            shown.close()
        browser.close()


if __name__ == "__main__":
    docs = Path(sys.argv[1])
    if "--pictures" not in sys.argv:
        make_page(docs / "examples" / "viewer.html")
    make_pictures(docs / "examples" / "viewer.html", docs / "images")
