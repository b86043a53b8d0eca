"""The viewer's pure JavaScript, run by Node on numbers from Python; skipped where there is none."""

import json
import os
import shutil
import subprocess
from importlib.resources import files
from pathlib import Path

import numpy as np
import pages
import pytest
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
    assert "pass 7" in run.stdout
