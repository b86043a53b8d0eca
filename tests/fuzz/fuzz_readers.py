"""What a reader may do with any bytes: read them, or refuse them in one sentence."""

import time
import warnings
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from fuzz_files import LIGHTS, MESHES, PICTURES
from fuzz_pictures import CODES

from jaxsh import geometry, imaging, transfer

SECONDS = 2.0
MEMORY = 250 << 20
_ARRAYS = ("vertices", "faces", "normals", "uv", "colors", "face_material")


class Fault(AssertionError):
    """Says what a reader did that it may not."""


def read_path(path: Path) -> Path:
    """Give the path of the file that is read and named."""
    return path.with_name("scene.obj") if path.suffix == ".mtl" else path


def read(kind: str, path: Path):
    """Read a file by the public function for its format, materials by the mesh that has them."""
    if kind == "mtl":
        return geometry.read_mesh(read_path(path))
    if kind in MESHES:
        return geometry.read_mesh(path)
    if kind in PICTURES:
        encoding = "srgb" if kind in CODES else None
        try:
            return imaging.read_environment(path, encoding=encoding)
        except ValueError as error:
            if "repair=True" not in str(error):
                raise
            _check_words(str(error), path)
            warnings.warn(f"{path}: repaired", UserWarning, stacklevel=2)
        return imaging.read_environment(path, encoding=encoding, repair=True)
    if kind == "splats.ply":
        return imaging.read_splats(path)
    if kind in LIGHTS:
        return imaging.read_light(path, convention="jaxsh" if kind == "light.npy" else None)
    return transfer.load(path)


class Outcome(NamedTuple):
    """Holds what a reader gave, None where it refused the file, and whether it warned."""

    result: Any
    warned: bool


def check(kind: str, path: Path) -> Outcome:
    """Read a file; raise `Fault` where that ends in anything but a result or a refusal.

    A refusal is a `ValueError` of one sentence with the file's name in it. A warning is a
    `UserWarning` that names the file. Time is the process's own: a busy machine is no fault.
    """
    with warnings.catch_warnings(record=True) as met:
        warnings.simplefilter("always")
        started = time.process_time()
        try:
            result = read(kind, path)
        except ValueError as error:
            result = None
            _check_words(str(error), path)
            if type(error) is not ValueError:
                raise Fault(f"refused by {type(error).__name__}: {error}") from error
            if out_of_memory := _out_of_memory(error):
                raise Fault(f"asked for too much memory: {error}") from out_of_memory
        except BaseException as error:
            raise Fault(f"{type(error).__name__}: {error}") from error
        taken = time.process_time() - started
    if taken > SECONDS:
        raise Fault(f"took {taken:.1f} s")
    for one in met:
        if one.category is not UserWarning:
            raise Fault(f"{one.category.__name__}: {one.message} ({one.filename}:{one.lineno})")
        _check_words(str(one.message), path, 700)
    if result is not None:
        _check_result(kind, result)
    return Outcome(result, bool(met))


def _check_words(message: str, path: Path, most: int = 400) -> None:
    rest = message.replace(str(read_path(path)), "", 1)
    if rest == message:
        raise Fault(f"does not name the file: {message}")
    if len(rest) > most or not rest.isprintable():
        raise Fault(f"is no sentence: {message[:1000]!r}")


def _out_of_memory(error: BaseException | None) -> MemoryError | None:
    while error is not None and not isinstance(error, MemoryError):
        error = error.__cause__ or error.__context__
    return error


def _check_result(kind: str, result) -> None:
    """Check that what came holds together by itself."""
    if kind in MESHES:
        # In NumPy, which compiles nothing.
        vertices, faces, normals, uv, colors, chosen = (
            None if array is None else np.asarray(array)
            for array in (getattr(result, name) for name in _ARRAYS)
        )
        ok = np.isfinite(vertices).all() and len(faces) > 0
        ok = ok and 0 <= faces.min() <= faces.max() < len(vertices)
        ok = ok and np.abs(np.linalg.norm(normals, axis=1) - 1).max() < 1e-3
        for array in (uv, colors):
            ok = ok and (array is None or bool(np.isfinite(array).all()))
        ok = ok and (chosen is None or -1 <= chosen.min() <= chosen.max() < len(result.materials))
    elif kind in PICTURES:
        pixels = np.asarray(result)
        ok = bool(np.isfinite(pixels).all()) and pixels.min() >= 0 and pixels.max() > 0
    elif kind in LIGHTS:
        light = np.asarray(result.coefficients if kind == "splats.ply" else result)
        ok = light.ndim > 1 and light.shape[-2] == 3 and bool(np.isfinite(light).all())
    else:
        neighbors = np.asarray(result.neighbors)
        ok = neighbors.size == 0 or 0 <= neighbors.min() <= neighbors.max() < len(result.positions)
    if not ok:
        raise Fault(f"gave what does not hold together: {result}")


def limit_memory(size: int) -> None:
    """Let this process address ten times a file and 250 MB more than now, where Linux says.

    Allocators address more than they use, of which `work` allows 200 MB.
    """
    import resource

    held = Path("/proc/self/statm")
    if held.exists():
        pages = int(held.read_text().split()[0])
        most = pages * resource.getpagesize() + 10 * size + MEMORY
        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        resource.setrlimit(resource.RLIMIT_AS, (most, hard))
