"""Open relit GLB files and a lightmap in three.js, and compare its pixels with Python's.

python tools/compare_with_three.py FOLDER

FOLDER is three.js' package, as `npm pack three` fetches it, unpacked. Needs the package playwright
and a Chromium that is installed; `CHROMIUM=path` names one. Software draws.
"""

import base64
import dataclasses
import functools
import http.server
import os
import shutil
import sys
import tempfile
import threading
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.ndimage import binary_erosion

from jaxsh import geometry, imaging, sphere, transfer

WIDTH, HEIGHT, EXPOSURE = 400, 300, 0.6
GRAY = jnp.array([0.5, 0.4, 0.3])
PAGE = """<!doctype html>
<script type="importmap">{"imports": {"three": "./three/build/three.module.js"}}</script>
<script type="module">
import * as THREE from "three";
import { EXRLoader } from "./three/examples/jsm/loaders/EXRLoader.js";
import { GLTFLoader } from "./three/examples/jsm/loaders/GLTFLoader.js";
globalThis.revision = THREE.REVISION;
globalThis.draw = async ({ file, map, color, camera, width, height }) => {
  const renderer = new THREE.WebGLRenderer({ antialias: false, preserveDrawingBuffer: true });
  renderer.setSize(width, height, false);
  const { scene } = await new GLTFLoader().loadAsync(file);
  if (map) {
    const lightMap = await new EXRLoader().loadAsync(map);
    lightMap.channel = 0;
    lightMap.repeat.y = -1;
    lightMap.offset.y = 1;
    const material = new THREE.MeshLambertMaterial({ color: new THREE.Color(...color), lightMap });
    scene.traverse((one) => { if (one.isMesh) one.material = material; });
  }
  const view = new THREE.PerspectiveCamera(camera.fov, width / height, 0.1, 100);
  view.position.set(...camera.position);
  view.lookAt(...camera.target);
  const world = new THREE.Scene();
  world.background = new THREE.Color(0);
  world.add(scene);
  renderer.render(world, view);
  const gl = renderer.getContext();
  const pixels = new Uint8Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  let text = "";
  for (const byte of pixels) text += String.fromCharCode(byte);
  return btoa(text);
};
</script>"""


def ball(rows: int = 24, columns: int = 48) -> geometry.Mesh:
    """A ball with UV and a painted texture."""
    v, u = np.meshgrid(np.linspace(0, 1, rows + 1), np.linspace(0, 1, columns + 1), indexing="ij")
    v, u = v.ravel(), u.ravel()
    ring = np.sin(np.pi * v)
    points = [ring * np.cos(2 * np.pi * u), ring * np.sin(2 * np.pi * u), -np.cos(np.pi * v)]
    points = jnp.asarray(np.stack(points, axis=1), jnp.float32)
    at = np.arange(rows * (columns + 1)).reshape(rows, columns + 1)[:, :-1].ravel()
    low = np.stack([at, at + 1, at + columns + 2], axis=1)[columns:]
    high = np.stack([at, at + columns + 2, at + columns + 1], axis=1)[:-columns]
    faces = np.concatenate([low, high]).astype(np.int32)
    y, x = np.mgrid[:8, :16]
    codes = [90 + 10 * x, 80 + 20 * y, 200 - 9 * x, 255 + 0 * x]
    texture = np.stack(codes, axis=2).astype(np.uint8)
    return geometry.Mesh(
        points,
        jnp.asarray(faces),
        points,
        jnp.asarray(np.stack([u, v], axis=1), jnp.float32),
        None,
        jnp.zeros(len(faces), jnp.int32),
        (geometry.BaseColor("paint", (0.9, 0.8, 0.7, 1.0), texture),),
    )


def write_files(folder: Path, mesh: geometry.Mesh, raster: imaging.Raster) -> dict[str, Any]:
    """Write what three.js opens, by name; beside it the radiance that Python sees, and options."""
    light = sphere.project_lat_long(imaging.studio(), 3)
    made = transfer.unshadowed(mesh.vertices, mesh.normals, 3)
    white = transfer.shade_diffuse(light, made, 1.0)
    # Cut at each vertex, as the file has it.
    seen = imaging.interpolate(raster, jnp.clip(EXPOSURE * white, 0, 1))
    imaging.write_relit(folder / "vertices.glb", mesh, white, exposure=EXPOSURE)
    imaging.write_relit(folder / "textured.glb", mesh, white, exposure=EXPOSURE, textured=True)

    texels = geometry.texels(mesh, (256, 128))
    at_texels = transfer.unshadowed(texels.positions, texels.normals, 3)
    lit = transfer.shade_diffuse(light, at_texels, imaging.base_color(mesh, texels))
    imaging.write_relit(folder / "texels.glb", texels, lit, exposure=EXPOSURE)
    irradiance = transfer.shade_diffuse(light, at_texels, jnp.pi)
    imaging.write_lightmap(folder / "light.exr", texels, irradiance)
    bare = dataclasses.replace(texels.mesh, materials=(), face_material=None)
    geometry.write_mesh(folder / "bare.glb", bare)

    def between(values: Float[Array, "n 3"]) -> Float[Array, "h w 3"]:
        assert raster.uv is not None
        return imaging.sample_texture(texels.image(values), raster.uv)

    lambert = {"file": "bare.glb", "map": "light.exr", "color": GRAY.tolist()}
    return {
        "colors of vertices": (seen, {"file": "vertices.glb"}),
        "with its texture": (imaging.base_color(mesh, raster) * seen, {"file": "textured.glb"}),
        "light at texels": (EXPOSURE * between(lit), {"file": "texels.glb"}),
        "lightmap": (GRAY / jnp.pi * between(irradiance), lambert),
    }


def main(package: Path) -> None:
    from playwright.sync_api import sync_playwright

    mesh = ball()
    camera = imaging.Camera.facing(mesh, width=WIDTH, height=HEIGHT)
    raster = imaging.rasterize(mesh, camera)
    inside = binary_erosion(np.asarray(raster.mask), np.ones((3, 3)))

    def y_up(point: Any) -> list[float]:
        x, y, z = np.asarray(point).tolist()
        return [x, z, -y]

    place = {"position": y_up(camera.position), "target": y_up(camera.target)}
    given = {"camera": place | {"fov": float(camera.fov_y)}, "width": WIDTH, "height": HEIGHT}
    chromium = os.environ.get("CHROMIUM") or shutil.which("chromium")
    software = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with tempfile.TemporaryDirectory() as name, sync_playwright() as started:
        folder = Path(name)
        (folder / "three").symlink_to(package.resolve())
        (folder / "page.html").write_text(PAGE, "utf-8")
        files = write_files(folder, mesh, raster)
        handler = functools.partial(_Silent, directory=name)
        with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
            threading.Thread(target=server.serve_forever, daemon=True).start()
            browser = started.chromium.launch(
                executable_path=chromium, args=[*software, "--no-sandbox"]
            )
            page = browser.new_page()
            page.goto(f"http://127.0.0.1:{server.server_port}/page.html")
            page.wait_for_function("globalThis.draw !== undefined")
            print(f"three.js r{page.evaluate('revision')}, {inside.sum()} pixels inside the ball")
            for what, (radiance, options) in files.items():
                text = page.evaluate("(options) => draw(options)", given | options)
                drawn = np.frombuffer(base64.b64decode(text), np.uint8)
                drawn = drawn.reshape(HEIGHT, WIDTH, 4)[::-1, :, :3]
                ours = np.rint(255 * np.asarray(imaging.tone_map(radiance)))
                apart = abs(drawn - ours).max(axis=-1)[inside]
                share = 100 * (apart <= 1).mean()
                print(f"{what}: {share:.2f} % within a step of 8 bits, at most {apart.max():.0f}")
            browser.close()
            server.shutdown()


class _Silent(http.server.SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: Any) -> None:
        pass


if __name__ == "__main__":
    main(Path(sys.argv[1]))
