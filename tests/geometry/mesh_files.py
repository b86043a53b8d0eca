"""Mesh files put together by hand, and what is read from them."""

import warnings

import numpy as np

from jaxsh.geometry import read_mesh

SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
POINTS = "".join(f"{x} {y} {z}\n" for x, y, z in SQUARE)
# Codes of sRGB, decoded (IEC 61966-2-1).
LINEAR = {0: 0.0, 51: 0.033104767, 128: 0.21586050, 255: 1.0}


def read(path, data, **options):
    """Read bytes or text with a warning or none, and give it without the file's name."""
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    with warnings.catch_warnings(record=True) as record:
        warnings.simplefilter("always")
        mesh = read_mesh(path, **options)
    assert len(record) <= 1
    said = [str(one.message).removeprefix(f"{path}: ") for one in record]
    return mesh, said[0] if said else ""


def corners(mesh, what="vertices"):
    return np.asarray(getattr(mesh, what))[np.asarray(mesh.faces)]
