"""Small valid files of every format that is read, as bytes: what the fuzzer starts from."""

import functools
from pathlib import Path

import fuzz_lights
import fuzz_meshes
import fuzz_pictures
import numpy as np
from fuzz_archives import archive
from fuzz_pictures import PNG, npy


def _transfer() -> list[bytes]:
    files = []
    for kind in ("<f4", "<f8"):
        arrays = {
            "format": np.array("jaxsh transfer"),
            "version": np.array(1),
            "coefficients": (np.arange(20, dtype=kind) / 8).reshape(5, 4),
            "positions": (np.arange(15, dtype=kind) / 4).reshape(5, 3),
            "normals": np.tile(np.array([0, 0.6, 0.8], kind), (5, 1)),
            "neighbors": np.arange(10).reshape(5, 2).astype("<i4") % 5,
        }
        files.append(arrays)
    clusters = {
        "format": np.array("jaxsh compressed transfer"),
        "version": np.array(2),
        "surface": np.array("points"),
        "cosine": np.array(True),
        "weights": (np.arange(10, dtype="i1") - 5).reshape(2, 5),
        "cluster": np.arange(5, dtype="u1") % 2,
        "codes": np.arange(24, dtype="<i2").reshape(2, 3, 4),
        "scales": np.arange(1, 7, dtype="<f4").reshape(2, 3) / 8,
    }
    files.append(
        clusters | {name: files[0][name] for name in ("positions", "normals", "neighbors")}
    )
    return [
        archive({f"{name}.npy": npy(array) for name, array in arrays.items()}) for arrays in files
    ]


_MAKERS = fuzz_meshes.MAKERS | fuzz_pictures.MAKERS | {"npz": _transfer} | fuzz_lights.MAKERS
MESHES, PICTURES, FORMATS = tuple(fuzz_meshes.MAKERS), tuple(fuzz_pictures.MAKERS), tuple(_MAKERS)
LIGHTS = tuple(fuzz_lights.MAKERS)


@functools.cache
def seeds(kind: str) -> list[bytes]:
    """Give the valid files of a format."""
    return _MAKERS[kind]()


# What a file may name, beside it.
BESIDE = {
    "mtl": {"scene.obj": seeds("obj")[1], "red.png": PNG},
    "obj": {
        "scene.mtl": b"newmtl red\nKd 1 0 0\nmap_Kd red.png\nnewmtl blue\nKd 0 0 1\nd 0.5\n",
        "red.png": PNG,
    },
}


def put_beside(path: Path) -> None:
    """Write what a file names into its folder; beside materials, the mesh that has them."""
    for name, data in BESIDE.get(path.suffix[1:], {}).items():
        (path.parent / name).write_bytes(data.replace(b"scene.mtl", path.name.encode()))
