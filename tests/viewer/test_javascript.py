"""The viewer's pure JavaScript, run by Node on numbers from Python; skipped where there is none."""

import json
import os
import shutil
import subprocess
from importlib.resources import files
from pathlib import Path

import matplotlib
import numpy as np
import pytest
import viewer_pages as pages
from scipy.spatial.transform import Rotation

from jaxsh import harmonics, imaging, viewer

NODE = shutil.which("node")


def turns(rng) -> list[dict]:
    half, identity = np.diag([-1.0, -1.0, 1.0]), np.eye(3)
    made = []
    for rotation in (identity, half, *Rotation.random(3, random_state=rng).as_matrix()):
        coefficients = rng.normal(size=121)
        expected = np.asarray(harmonics.rotate(coefficients, rotation))
        made.append({"coefficients": coefficients, "expected": expected, "rotation": rotation})
    return made


def basis_at(rng) -> list[dict]:
    directions = rng.normal(size=(6, 3))
    directions[0] = 0, 0, -1
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    values = np.asarray(harmonics.evaluate(directions, 10))
    return [{"direction": d, "expected": v} for d, v in zip(directions, values, strict=True)]


def cameras(rng) -> list[dict]:
    """Points on rays through pixel centers, and where those are from -1 to 1, upwards."""
    made = []
    for up in ([0.0, 0.0, 1.0], [0.3, 0.1, -1.0]):
        position, target = np.array([1.0, -4.0, 2.0]), np.array([0.2, 0.1, 0.0])
        camera = imaging.Camera(position, target, np.array(up), fov_y=35.0, width=6, height=4)
        origins, directions = map(np.asarray, camera.rays())
        points = origins + directions * rng.uniform(1, 9, size=(24, 1))
        across, over = np.meshgrid((np.arange(6) + 0.5) / 3 - 1, 1 - (np.arange(4) + 0.5) / 2)
        facts = {"position": position, "target": target, "up": up, "fovY": 35.0, "aspect": 1.5}
        pixels = np.stack([across.ravel(), over.ravel()], axis=-1)
        made.append({"camera": facts, "points": points, "pixels": pixels})
    return made


def picked(rng, mesh) -> list[dict]:
    """Rays, and the vertex nearest to where each first solves o + t d = a + u b + v c; or None."""
    corners = np.asarray(mesh.vertices, np.float64)[np.asarray(mesh.faces)]
    made = []
    for _ in range(12):
        origin = rng.normal(size=3)
        origin *= 5 / np.linalg.norm(origin)
        direction = rng.uniform(-0.8, 0.8, size=3) - origin
        ways = np.broadcast_to(-direction, corners[:, 0].shape)
        edges = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        right = (origin - corners[:, 0])[..., None]
        u, v, t = np.linalg.solve(np.stack([*edges, ways], axis=-1), right)[..., 0].T
        hit = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), t, np.inf)
        face = hit.argmin()
        apart = np.linalg.norm(corners[face] - origin - hit[face] * direction, axis=1)
        # By the weights, which rank corners of a long triangle otherwise than distances do.
        largest = np.argmax([1 - u[face] - v[face], u[face], v[face]])
        found = None if np.isinf(hit[face]) else int(mesh.faces[face, largest])
        assert found is None or apart[largest] < 0.2
        made.append({"origin": origin, "direction": direction, "expected": found})
    return made


@pytest.mark.skipif(NODE is None, reason="needs node, which is not here")
def test_pure_javascript_agrees_with_python(rng, tmp_path):
    mesh, made, light, albedo = pages.example()
    page = viewer.export_html(tmp_path / "a.html", made, light, mesh.faces, albedo)
    header, arrays, _ = pages.parts(page)
    numbers = {
        "folder": str(files("jaxsh.viewer").joinpath("js")),
        "turns": turns(rng),
        "basisAt": basis_at(rng),
        "cameras": cameras(rng),
        "header": header | {"first": np.asarray(mesh.vertices[0])},
        "bytes": len(arrays),
        "ramp": matplotlib.colormaps["viridis"](np.linspace(0, 1, 256))[:, :3],
        "transferOf": {"vertex": 123, "expected": np.asarray(made.coefficients)[123]},
        "picked": picked(rng, mesh),
        "text": pages.ARRAYS.search(page.read_text("utf-8"))[1],
    }
    path = tmp_path / "numbers.json"
    path.write_text(json.dumps(numbers, default=lambda array: array.tolist()))
    run = subprocess.run(
        [NODE, "--test", str(Path(__file__).with_name("pure.test.mjs"))],
        env=os.environ | {"VIEWER_NUMBERS": str(path)},
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    assert "pass 11" in run.stdout
