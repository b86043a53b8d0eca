"""Transfer in a file: NumPy's .npz with a name and a version, and nothing that could run."""

import os
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, get_args

import jax
import numpy as np

from .._core.checks import as_path, check_choice, check_type
from .._core.files import check_place, put_in_place
from .._core.host import put
from .._core.npy import from_npz, text_of
from .._core.words import reason
from ..harmonics import degree_of
from ._compressed import CompressedTransfer
from ._surfaces import SurfaceKind
from ._transfer import Transfer

_NONE = np.array(0)


class _Format(NamedTuple):
    """Says what a file of a form holds: kind of number and number of axes of each array."""

    form: type[Transfer] | type[CompressedTransfer]
    versions: tuple[int, ...]
    fields: dict[str, tuple[str, int]]
    problem: Callable[[dict[str, np.ndarray]], str | None]  # of arrays of these kinds

    def version_of(self, transfer: Transfer | CompressedTransfer) -> int:
        """Return the oldest version that can hold it."""
        usual = transfer.surface == "vertices" and transfer.cosine
        return self.versions[0 if usual else -1]


def save(path: str | os.PathLike[str], transfer: Transfer | CompressedTransfer) -> Path:
    """Write a transfer to a file, which holds every array to the last bit, and return its path.

    An existing file is replaced, once the new one is complete. Makes missing folders. NumPy
    reads the file too: `numpy.load(path)["coefficients"]`. Raises `ValueError` for arrays that do
    not make a transfer, and `OSError` where the file cannot be written. Runs on the host; arrays
    shared out between devices are written whole. Takes a `CompressedTransfer` too.

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
    check_type("transfer", transfer, Transfer, CompressedTransfer)
    name, kind = next((n, k) for n, k in _FORMATS.items() if isinstance(transfer, k.form))
    arrays = {field: np.asarray(getattr(transfer, field)) for field in kind.fields}
    if problem := _problem(kind, arrays):
        raise ValueError(f"{path}: cannot be written: {problem}")
    check_place(path)
    version = kind.version_of(transfer)
    labels = {"format": np.array(name), "version": np.array(version)}
    if version == _SAYS:
        labels |= {"surface": np.array(transfer.surface), "cosine": np.array(transfer.cosine)}
    put_in_place({path: lambda file: np.savez(file, allow_pickle=False, **labels, **arrays)})
    return path


def load(path: str | os.PathLike[str]) -> Transfer | CompressedTransfer:
    """Read the transfer that `save` wrote, in its form.

    Float64 becomes float32 where JAX's x64 is off.
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
        names = {name for kind in _FORMATS.values() for name in kind.fields}
        arrays = from_npz(path, ["format", "version", "surface", "cosine", *sorted(names)])
        kind = _FORMATS.get(text_of(arrays.pop("format", _NONE)))
        version = arrays.pop("version", _NONE)
        written = reason(text_of(version), 40)
    except Exception as error:  # a damaged archive may raise anything
        raise ValueError(f"{path}: damaged: {reason(error)}") from error
    if kind is None:
        raise ValueError(f"{path}: not a transfer file")
    if version.shape or version.dtype.kind != "i" or version not in kind.versions:
        known = " and ".join(map(str, kind.versions))
        raise ValueError(f"{path}: written as version {written}, but this jaxsh reads {known}")
    about = {name: arrays.pop(name, _NONE) for name in ("surface", "cosine")}
    said = _kind(path, **about) if version == _SAYS else {}
    # As read, and once more in JAX's types: float32 cannot hold all that float64 can.
    for change in (lambda array: array, _in_jax_types):
        arrays = {name: change(arrays[name]) for name in kind.fields if name in arrays}
        if problem := _problem(kind, arrays):
            raise ValueError(f"{path}: damaged: {problem}")
    return kind.form(**{name: put(arrays[name]) for name in kind.fields}, **said)


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


def _problem(kind: _Format, arrays: dict[str, np.ndarray]) -> str | None:
    """Say why arrays are not those of a transfer in this form; None where they are."""
    for name, (number, axes) in kind.fields.items():
        if name not in arrays:
            return f"it holds no {name}"
        array = arrays[name]
        # A kind of number, or one with its bytes.
        right = array.dtype.str[1:].startswith(number) and array.dtype.itemsize <= 8
        if not right or array.ndim != axes:
            return f"{name} have dtype {array.dtype} and shape {array.shape}"
        if bad := int((~np.isfinite(array)).sum()):
            return f"{bad} of {array.size} {name} are NaN or infinite"
    return kind.problem(arrays)


def _plain_problem(arrays: dict[str, np.ndarray]) -> str | None:
    count, width = arrays["coefficients"].shape
    return _points_problem(arrays, count) or _width_problem(width)


def _compressed_problem(arrays: dict[str, np.ndarray]) -> str | None:
    clusters, parts, width = arrays["codes"].shape
    number, count = arrays["weights"].shape
    if arrays["scales"].shape != (clusters, parts) or parts != number + 1:
        return (
            f"scales and codes are not those of {number} components, one more for the mean: they "
            f"have shapes {arrays['scales'].shape} and {arrays['codes'].shape}"
        )
    cluster = arrays["cluster"]
    if len(cluster) != count or not (cluster < clusters).all():
        return f"cluster does not name one of {clusters} for each of {count} points"
    return _points_problem(arrays, count) or _width_problem(width)


def _points_problem(arrays: dict[str, np.ndarray], count: int) -> str | None:
    if arrays["positions"].shape != (count, 3) or arrays["normals"].shape != (count, 3):
        return f"positions or normals are not ({count}, 3), as its coefficients want"
    neighbors = arrays["neighbors"]
    if len(neighbors) != count or not ((neighbors >= 0) & (neighbors < count)).all():
        return f"neighbors do not name vertices 0 to {count - 1} for each of {count}"
    return None


def _width_problem(width: int) -> str | None:
    try:
        degree_of(width)
    except ValueError as error:
        return str(error)
    return None


_POINTS = {"positions": ("f", 2), "normals": ("f", 2), "neighbors": ("i", 2)}
_SAYS = 2  # the version that says what its points are; those of 1 are vertices, with the cosine
_FORMATS = {
    "jaxsh transfer": _Format(
        Transfer, (1, _SAYS), {"coefficients": ("f", 2)} | _POINTS, _plain_problem
    ),
    "jaxsh compressed transfer": _Format(
        CompressedTransfer,
        (_SAYS,),
        {"weights": ("i1", 2), "cluster": ("u", 1), "codes": ("i2", 3), "scales": ("f", 2)}
        | _POINTS,
        _compressed_problem,
    ),
}
