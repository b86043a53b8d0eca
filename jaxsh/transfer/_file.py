"""Transfer in a file: NumPy's .npz with a name and a version, and nothing that could run."""

import os
import zipfile
from pathlib import Path
from typing import Any, get_args

import jax
import jax.numpy as jnp
import numpy as np

from .._core.checks import as_path, check_choice, check_type
from .._core.files import check_place, put_in_place
from .._core.npy import from_npz, text_of
from .._core.words import reason
from ..harmonics import degree_of
from ._surfaces import SurfaceKind
from ._transfer import Transfer

# Version 1 holds vertices with the cosine, and is what those are written as; 2 holds any points.
_FORMAT, _VERSIONS = "jaxsh transfer", (1, 2)
_NONE = np.array(0)
_FIELDS = {"coefficients": "f", "positions": "f", "normals": "f", "neighbors": "i"}


def save(path: str | os.PathLike[str], transfer: Transfer) -> Path:
    """Write a transfer to a file, which holds every array to the last bit, and return its path.

    An existing file is replaced, once the new one is complete. Makes missing folders. NumPy
    reads the file too: `numpy.load(path)["coefficients"]`. Raises `ValueError` for arrays that do
    not make a transfer, and `OSError` where the file cannot be written. Runs on the host; arrays
    shared out between devices are written whole.

    **Example**

    >>> import pathlib, tempfile
    >>> from jaxsh import geometry, transfer
    >>> baked = transfer.bake(geometry.knot(300), degree=1, directions=64)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = transfer.save(pathlib.Path(folder) / "knot.npz", baked)
    ...     transfer.load(path).coefficients.shape
    (300, 4)
    """
    path = as_path(path)
    check_type("transfer", transfer, Transfer)
    arrays = {name: np.asarray(getattr(transfer, name)) for name in _FIELDS}
    if problem := _problem(arrays):
        raise ValueError(f"{path}: cannot be written: {problem}")
    check_place(path)
    plain = transfer.surface == "vertices" and transfer.cosine
    labels = {"format": np.array(_FORMAT), "version": np.array(_VERSIONS[0 if plain else 1])}
    if not plain:
        labels |= {"surface": np.array(transfer.surface), "cosine": np.array(transfer.cosine)}
    put_in_place({path: lambda file: np.savez(file, allow_pickle=False, **labels, **arrays)})
    return path


def load(path: str | os.PathLike[str]) -> Transfer:
    """Read the transfer that `save` wrote. Float64 becomes float32 where JAX's x64 is off.

    Raises `FileNotFoundError` for a missing file, and `ValueError`, naming the file and the
    problem, for one that is truncated or damaged, of another kind, or of a newer version. Runs on
    the host.

    **Example**

    >>> import pathlib, tempfile
    >>> from jaxsh import geometry, transfer
    >>> baked = transfer.bake(geometry.knot(300), degree=1, shadows=False)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = transfer.save(pathlib.Path(folder) / "knot.npz", baked)
    ...     bool((transfer.load(path).coefficients == baked.coefficients).all())
    True
    """
    path = as_path(path)
    if path.is_dir():
        raise FileNotFoundError(f"{path}: a folder, not a transfer file: open reads stores")
    if not path.is_file():
        raise FileNotFoundError(f"{path}: there is no such transfer file")
    if not zipfile.is_zipfile(path):
        raise ValueError(f"{path}: not a transfer file, or a truncated one")
    try:
        arrays = from_npz(path, ["format", "version", "surface", "cosine", *_FIELDS])
        kind, version = text_of(arrays.pop("format", _NONE)), arrays.pop("version", _NONE)
        written = reason(text_of(version), 40)
    except Exception as error:  # a damaged archive may raise anything
        raise ValueError(f"{path}: damaged: {reason(error)}") from error
    if kind != _FORMAT:
        raise ValueError(f"{path}: not a transfer file")
    if version.shape or version.dtype.kind != "i" or version not in _VERSIONS:
        raise ValueError(
            f"{path}: written as version {written}, but this jaxsh reads 1 and {_VERSIONS[-1]}"
        )
    about = {name: arrays.pop(name, _NONE) for name in ("surface", "cosine")}
    kind = {} if version == 1 else _kind(path, **about)
    # As read, and once more in JAX's types: float32 cannot hold all that float64 can.
    for change in (lambda array: array, _in_jax_types):
        arrays = {name: change(array) for name, array in arrays.items()}
        if problem := _problem(arrays):
            raise ValueError(f"{path}: damaged: {problem}")
    return Transfer(**{name: jnp.asarray(arrays[name]) for name in _FIELDS}, **kind)


def _kind(path: Path, surface: np.ndarray, cosine: np.ndarray) -> dict[str, Any]:
    """Give what a file says of the points that its rows are."""
    try:
        said = text_of(surface)
        check_choice("surface", said, get_args(SurfaceKind))
        if cosine.shape or cosine.dtype != bool:
            raise ValueError(f"cosine has dtype {cosine.dtype} and shape {cosine.shape}")
    except Exception as error:  # a text that is none may raise anything
        raise ValueError(f"{path}: damaged: {reason(error)}") from error
    return {"surface": said, "cosine": bool(cosine)}


def _in_jax_types(array: np.ndarray) -> np.ndarray:
    with np.errstate(over="ignore"):
        return array.astype(jax.dtypes.canonicalize_dtype(array.dtype.newbyteorder("=")))


def _problem(arrays: dict[str, np.ndarray]) -> str | None:
    """Say why arrays are not those of a transfer; None where they are."""
    for name, kind in _FIELDS.items():
        if name not in arrays:
            return f"it holds no {name}"
        array = arrays[name]
        if array.dtype.kind != kind or array.dtype.itemsize > 8 or array.ndim != 2:
            return f"{name} have dtype {array.dtype} and shape {array.shape}"
        if bad := int((~np.isfinite(array)).sum()):
            return f"{bad} of {array.size} {name} are NaN or infinite"
    count, width = arrays["coefficients"].shape
    if arrays["positions"].shape != (count, 3) or arrays["normals"].shape != (count, 3):
        return f"positions or normals are not ({count}, 3), as its coefficients want"
    neighbors = arrays["neighbors"]
    if len(neighbors) != count or not ((neighbors >= 0) & (neighbors < count)).all():
        return f"neighbors do not name vertices 0 to {count - 1} for each of {count}"
    try:
        degree_of(width)
    except ValueError as error:
        return str(error)
    return None
