"""Count how many changes of light a second the viewer draws: the figures of `docs/viewer.md`.

python tools/measure_viewer.py [--vertices 50000] [--degree 10] [--chromium-options=...]
python tools/measure_viewer.py --texels 256 [--degree 10]

The second is of a square of 256 × 256 texels with a texture of 1024 × 1024, and a knot that stands
in its light; with `--clusters 64` its transfer is compressed.

Needs the package playwright and a Chromium that is installed; `CHROMIUM=path` names one. As it
stands all is drawn in software (SwiftShader), so that every machine can say something; with
`--chromium-options=""` the browser takes the graphics processor that it finds. On a machine that
has other work, the CPU time of all of the browser's processes (Linux) says more than the clock.
"""

import argparse
import dataclasses
import os
import shutil
import tempfile
from pathlib import Path

import jax.numpy as jnp
import numpy as np

from jaxsh import geometry, transfer, viewer

SOFTWARE = "--use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader"
# Milliseconds for each of some changes, whose last pixel is waited for.
MEASURE = """([change, seconds]) => {
  const viewer = document.getElementById("viewer").viewer;
  const { gl } = viewer.renderer;
  const pixel = new Uint8Array(4);
  const turned = (angle) => {
    const [c, s] = [Math.cos(angle), Math.sin(angle)];
    return [[c, -s, 0], [s, c, 0], [0, 0, 1]];
  };
  const changes = {
    whole: (i) => { viewer.set({ rotation: turned(i / 50) }); viewer.draw(); },
    light: (i) => { viewer.set({ rotation: turned(i / 50) }); viewer.light(); },
    overlay: () => viewer.overlay.show(),
    exposure: () => { viewer.set({ exposure: 1 }); viewer.draw(); },
  };
  const start = performance.now();
  let count = 0;
  while (performance.now() - start < 1000 * seconds || count < 5) {
    changes[change](++count);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  }
  return [count, (performance.now() - start) / count];
}"""
FACTS = """() => {
  const { canvas, renderer: { gl } } = document.getElementById("viewer").viewer;
  const debug = gl.getExtension("WEBGL_debug_renderer_info");
  const name = gl.getParameter(debug ? debug.UNMASKED_RENDERER_WEBGL : gl.RENDERER);
  return [name, canvas.width, canvas.height];
}"""
CHANGES = {
    "whole": "a change of light",
    "light": "  of which turning its coefficients",
    "overlay": "  of which the mirror ball",
    "exposure": "a change of exposure alone",
}


def cpu_seconds() -> float:
    """CPU time of all processes that descend from this one; zero where /proc is not."""
    times, parents = {}, {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rsplit(")", 1)[1].split()
        except OSError:  # ended
            continue
        parents[int(folder.name)] = int(fields[1])
        times[int(folder.name)] = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def ours(process: int) -> bool:
        while process in parents:
            process = parents[process]
            if process == os.getpid():
                return True
        return False

    return sum(time for process, time in times.items() if ours(process))


def square(side: int) -> geometry.Texels:
    """Two faces with a texture of sums of sines, and the texels of a picture over them."""
    corners = np.array([[-1.0, 1.2, -1], [1, 1.2, -1], [1, 1.2, 1], [-1, 1.2, 1]])
    mesh = geometry.make_mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    x, y = np.meshgrid(np.arange(1024), np.arange(1024))
    waves = np.stack([np.sin(x / 9 + y / 31), np.sin(x / 17), np.sin(x * y / 2e4), 1 + 0 * x], 2)
    texture = np.rint(127.5 + 127.5 * waves).astype(np.uint8)
    mesh = dataclasses.replace(
        mesh,
        uv=(mesh.vertices[:, ::2] + 1) / 2,
        materials=(geometry.BaseColor(texture=texture),),
        face_material=jnp.zeros(2, jnp.int32),
    )
    return geometry.texels(mesh, side)


def main(
    vertices: int, texels: int, clusters: int, degree: int, options: str, seconds: float
) -> None:
    from playwright.sync_api import sync_playwright

    if texels:
        surface = square(texels)
        before = geometry.ray_scene([surface.mesh, geometry.knot(2000)])
        made = transfer.bake(surface, degree, directions=256, scene=before, progress=False)
        if clusters:
            made = transfer.compress(made, clusters=clusters, components=8, progress=False)
    else:
        surface = geometry.knot(vertices)
        made = transfer.unshadowed(surface.vertices, surface.normals, degree)
    light = np.random.default_rng(0).normal(size=(3, (degree + 1) ** 2)) * 0.1
    light[:, 0] = 2.0
    chromium = os.environ.get("CHROMIUM") or shutil.which("chromium")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as started:
        page = viewer.export_html(Path(folder) / "knot.html", made, light, surface)
        print(
            f"{made.num_points} {made.surface}, degree {degree}: {page.stat().st_size / 1e6:.1f} MB"
        )
        arguments = [*options.split(), "--no-sandbox", "--disable-dev-shm-usage"]
        browser = started.chromium.launch(executable_path=chromium, args=arguments)
        shown = browser.new_page(viewport={"width": 1072, "height": 600})
        shown.goto(page.as_uri())
        shown.locator("main canvas").first.wait_for()
        shown.wait_for_timeout(1000)
        name, width, height = shown.evaluate(FACTS)
        print(f"{name}, {os.cpu_count()} CPU cores, {width} x {height} pixels")
        for change, said in CHANGES.items():
            before = cpu_seconds()
            count, each = shown.evaluate(MEASURE, [change, seconds])
            busy = 1000 * (cpu_seconds() - before) / count
            print(f"{said}: {each:.1f} ms, {1000 / each:.0f} a second; {busy:.1f} ms of CPU time")
        browser.close()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Count changes of light a second.")
    parser.add_argument("--vertices", type=int, default=50_000)
    parser.add_argument("--texels", type=int, default=0, help="along a side, instead of vertices")
    parser.add_argument("--clusters", type=int, default=0, help="of the texels' transfer")
    parser.add_argument("--degree", type=int, default=10)
    parser.add_argument("--chromium-options", default=SOFTWARE)
    parser.add_argument("--seconds", type=float, default=3.0)
    given = parser.parse_args()
    main(
        given.vertices,
        given.texels,
        given.clusters,
        given.degree,
        given.chromium_options,
        given.seconds,
    )
