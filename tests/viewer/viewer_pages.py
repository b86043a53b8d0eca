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
