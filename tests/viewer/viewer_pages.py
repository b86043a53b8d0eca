"""A small mesh with its transfer and a light, and what a page that holds them is made of."""

import base64
import functools
import gzip
import json
import os
import re
import shutil
from pathlib import Path

import jax.numpy as jnp
import numpy as np

from jaxsh import geometry, transfer

DEGREE = 10
ARRAYS = re.compile(r'<script type="text/plain" id="arrays">(.*?)</script>', re.DOTALL)
HEADER = re.compile(r'<script type="application/json" id="header">(.*?)</script>', re.DOTALL)
SCRIPT = re.compile(r'<script type="module">(.*?)</script>', re.DOTALL)


@functools.cache
def example(vertices: int = 300, degree: int = DEGREE):
    """A knot, a transfer with coefficients of many sizes, a light and an albedo; all float32."""
    rng = np.random.default_rng(16)
    mesh = geometry.knot(vertices)
    bands = np.repeat(np.arange(degree + 1), 2 * np.arange(degree + 1) + 1)
    falloff = 1 / (1 + bands) ** 2
    coefficients = rng.normal(size=(len(mesh.vertices), len(bands))) * falloff
    coefficients[:, 0] += 2.5
    light = rng.normal(size=(3, len(bands))) * falloff * 0.3
    light[:, 0] += [1.2, 1.0, 0.8]
    neighbors = np.arange(len(coefficients), dtype=np.int32)[:, None]
    arrays = (coefficients, mesh.vertices, mesh.normals)
    made = transfer.Transfer(*(jnp.asarray(a, jnp.float32) for a in arrays), neighbors)
    albedo = rng.uniform(0.2, 0.9, size=(len(coefficients), 3)).astype(np.float32)
    return mesh, made, light.astype(np.float32), albedo


def parts(page: Path) -> tuple[dict, bytes, str]:
    """The header, the arrays' bytes and the script of a page."""
    text = page.read_text("utf-8")
    (arrays,), (header,), (script,) = (each.findall(text) for each in (ARRAYS, HEADER, SCRIPT))
    return json.loads(header), gzip.decompress(base64.b64decode(arrays)), script


def chromium() -> str | None:
    """The path of a Chromium that is installed, or of the one that CHROMIUM names."""
    names = ("chromium", "chromium-browser", "google-chrome")
    found = [path for name in names if (path := shutil.which(name))]
    return os.environ.get("CHROMIUM") or (found[0] if found else None)


@functools.cache
def textured(rows: int = 24, columns: int = 48) -> geometry.Mesh:
    """A sphere with UV, colors of its vertices, and two materials with a texture each, or none."""
    rng = np.random.default_rng(18)
    v, u = np.meshgrid(np.linspace(0, 1, rows + 1), np.linspace(0, 1, columns + 1), indexing="ij")
    theta, phi = np.pi * (1 - v.ravel()), 2 * np.pi * u.ravel()
    ring = np.sin(theta)
    points = np.stack([ring * np.cos(phi), ring * np.sin(phi), np.cos(theta)], axis=1)
    at = np.arange(rows * (columns + 1)).reshape(rows, columns + 1)[:, :-1].ravel()
    low = np.stack([at, at + 1, at + columns + 2], axis=1)
    high = np.stack([at, at + columns + 2, at + columns + 1], axis=1)
    # Those at a pole have no area.
    faces = np.concatenate([low[columns:], high[:-columns]]).astype(np.int32)
    third = (points[faces].mean(axis=1)[:, 2] > 0.4).astype(np.int32)
    third[points[faces].mean(axis=1)[:, 2] < -0.5] = -1

    def texture(height, width):
        picture = rng.integers(60, 256, (height, width, 4)).astype(np.uint8)
        picture[..., 3] = 255
        return picture

    materials = (
        geometry.BaseColor("belt", (0.9, 0.8, 0.7, 1.0), texture(4, 8)),
        geometry.BaseColor("cap", (0.5, 0.9, 0.6, 1.0), texture(3, 5), wrap="clamp"),
    )
    colors = np.stack([0.6 + 0.4 * u.ravel(), 0.5 + 0.5 * v.ravel(), 1 - 0.5 * v.ravel()], axis=1)
    colors = np.concatenate([colors, np.ones((len(colors), 1))], axis=1)
    arrays = (points, points, np.stack([u.ravel(), v.ravel()], axis=1), colors)
    points, normals, uv, colors = (jnp.asarray(one, jnp.float32) for one in arrays)
    return geometry.Mesh(
        points, jnp.asarray(faces), normals, uv, colors, jnp.asarray(third), materials
    )
