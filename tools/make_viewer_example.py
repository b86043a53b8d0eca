"""Make the page and the pictures of `docs/viewer.md`: a knot under several lights, and a vase.

python tools/make_viewer_example.py docs [--pictures]

The pictures, with `--pictures` these alone, need the package playwright and a Chromium that is
installed; `CHROMIUM=path` names one.
"""

import os
import shutil
import sys
import tempfile
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


def make_textured(path: Path) -> Path:
    """A vase with a painted texture, lit texel by texel: 256 × 256, the UV as it was turned."""
    rows, columns = 49, 97
    v, u = np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 1, columns), indexing="ij")
    radius = 0.35 + 0.22 * np.sin(5.2 * v + 0.3) + 0.05 * v
    angle = 2 * np.pi * u
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), 1.7 * v], axis=2)
    at = np.arange((rows - 1) * columns).reshape(rows - 1, columns)[:, :-1].ravel()
    faces = np.concatenate(
        [
            np.stack([at, at + 1, at + columns + 1], 1),
            np.stack([at, at + columns + 1, at + columns], 1),
        ]
    ).astype(np.int32)
    y, x = np.mgrid[:512, :1024] / 512
    bands = np.sin(40 * y + 4 * np.sin(8 * np.pi * x)) > 0.2
    leaves = np.sin(16 * np.pi * x) * np.sin(12 * np.pi * y + 3) > 0.55
    texture = np.full((512, 1024, 4), 255, np.uint8)
    texture[..., :3] = np.where(bands[..., None], [214, 158, 92], [236, 226, 204])
    texture[leaves, :3] = [46, 82, 104]
    vertices = jnp.asarray(points.reshape(-1, 3), jnp.float32)
    mesh = geometry.Mesh(
        vertices,
        jnp.asarray(faces),
        geometry.vertex_normals(vertices, jnp.asarray(faces)),
        jnp.asarray(np.stack([u, v], axis=2).reshape(-1, 2), jnp.float32),
        None,
        jnp.zeros(len(faces), jnp.int32),
        (geometry.BaseColor("glaze", texture=texture, double_sided=True),),
    )
    texels = geometry.texels(mesh, 256)
    baked = transfer.bake(texels, DEGREE, directions=512, bounces=1, albedo=0.6, progress=False)
    studio = sphere.project_lat_long(imaging.studio(), DEGREE) * harmonics.window("hann", DEGREE)
    gloss = transfer.Material(1.0, 0.05, 24.0)
    title = "A vase, lit texel by texel"
    return viewer.export_html(path, baked, studio, texels, gloss, textured=True, title=title)


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


TEXTURED = (("viewer-texels", (960, 560), False, "viewer.set({})"),)


def make_pictures(page: Path, folder: Path, pictures: tuple = PICTURES) -> None:
    from playwright.sync_api import sync_playwright

    chromium = os.environ.get("CHROMIUM") or shutil.which("chromium")
    software = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    options = [*software, "--no-sandbox", "--disable-dev-shm-usage"]
    with sync_playwright() as started:
        browser = started.chromium.launch(executable_path=chromium, args=options)
        for name, (width, height), dark, state in pictures:
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
    with tempfile.TemporaryDirectory() as folder:
        vase = make_textured(Path(folder) / "vase.html")
        make_pictures(vase, docs / "images", TEXTURED)
