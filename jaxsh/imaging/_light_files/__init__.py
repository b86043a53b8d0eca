"""Files of lights: a reader and a writer each format, in the file's own convention."""

from pathlib import Path

from ._arrays import npz_file, read_npy, read_npz
from ._cmgen import SAYS, cmgen_file, read_cmgen
from ._gltf import read_gltf
from ._gltf_write import gltf_file
from ._splat_ply import SplatArrays, put_splats, read_splat_arrays, splats_problem
from ._stored import Stored
from ._three import read_three, three_file

__all__ = [
    "FORMATS",
    "SAYS",
    "SplatArrays",
    "Stored",
    "cmgen_file",
    "gltf_file",
    "npz_file",
    "put_splats",
    "read_splat_arrays",
    "read_stored",
    "splats_problem",
    "three_file",
]

_READERS = {
    ".json": read_three,
    ".txt": read_cmgen,
    ".gltf": read_gltf,
    ".glb": read_gltf,
    ".npz": read_npz,
    ".npy": read_npy,
}
FORMATS = tuple(_READERS)


def read_stored(path: Path, which: str | int | None) -> Stored:
    """Read coefficients as a file has them. Raises `ValueError` that does not name the file."""
    return _READERS[path.suffix.lower()](path, which)
