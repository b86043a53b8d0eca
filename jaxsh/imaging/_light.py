"""Lights as coefficients: from files of other packages, and to them."""

import dataclasses
import math
import os
import warnings
from pathlib import Path
from typing import Literal

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import (
    as_host_float,
    as_path,
    check_choice,
    check_coefficients,
    check_finite,
    check_size,
)
from .._core.files import Content, check_place, put_in_place
from .._core.words import reason
from ..harmonics import Convention, conventions, convert, rotate
from ..harmonics._convention import axes_rows
from ..harmonics._conventions import look_up
from ._light_files import (
    FORMATS,
    SAYS,
    Stored,
    cmgen_file,
    gltf_file,
    npz_file,
    read_stored,
    three_file,
)

_OWN = "jaxsh"
# What a format is written in: its own conventions, or, of arrays, any.
_SAID = {
    ".json": ("three.js",),
    ".txt": tuple(SAYS),
    ".gltf": ("gltf",),
    ".glb": ("gltf",),
    ".npz": (),
    ".npy": (),
}


def read_light(
    path: str | os.PathLike[str],
    *,
    convention: str | Convention | None = None,
    up: Literal["z", "y"] | None = None,
    which: str | int | None = None,
) -> Float[Array, "*batch 3 k"]:
    """Read coefficients that another package wrote, as light in our own convention: z up.

    - `.json`: a LightProbe of three.js, by itself or in a scene, times its intensity; or a bare
      list of numbers, flat or in rows.
    - `.txt`: what Filament's cmgen prints, whose comments say whether it is radiance (`--sh`),
      irradiance or irradiance "pre-scaled" (`sh.txt`); or any three numbers a line.
    - `.gltf`, `.glb`: the scene's light of EXT_lights_image_based, times its intensity, turned by
      its rotation; as Babylon.js reads it, since the specification leaves signs open.
    - `.npz`: what `write_light` wrote, or an array "coefficients" beside a "convention", or any.
    - `.npy`: any array.

    Irradiance becomes the radiance that gives it; three.js' y is our z: (x, y, z) → (x, -z, y), as
    in `geometry.read_mesh(up="y")`. One channel gives three equal ones.

    **Arguments**

    - `convention`: what the numbers are, a name of `harmonics.conventions()` or a `Convention`.
      Needed where the file does not say; replaces what it says elsewhere.
    - `up`: the axis of the file that points up, "z" or "y", right-handed. By default that of the
      convention.
    - `which`: the name or the place of the light, where a file holds several; of an array in .npz.

    **Returns** light (3, K), or (..., 3, K) from arrays that hold more; in the dtype of an array,
    halves as float32, in JAX's default float type from text.

    Raises `FileNotFoundError` for a missing file, and `ValueError`, naming the file and the
    problem, for any other fault: a damaged file, one of another kind than its name says, other
    counts than the convention has, NaN and infinite values. Runs on the host.

    **Example**

    >>> import pathlib, tempfile
    >>> from jaxsh import imaging
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder) / "sh.txt"
    ...     _ = path.write_text("(0.5, 0.5, 0.5); // L00, irradiance, pre-scaled base")
    ...     imaging.read_light(path).shape
    (3, 1)
    """
    path = as_path(path)
    _check_options(convention, up)
    which = _as_place(which)
    _check_suffix(path, "read")
    if not path.is_file():
        raise FileNotFoundError(f"{path}: there is no such light")
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # what is infinite is met as such
            return _in_ours(read_stored(path, which), convention, up)
    except MemoryError as error:
        raise ValueError(f"{path}: damaged, or too large for memory") from error
    except ValueError as error:
        raise ValueError(f"{path}: {reason(error, 350)}") from error


def _check_options(convention: str | Convention | None, up: str | None) -> None:
    if convention is not None:
        look_up("convention", convention)
    if up is not None:
        check_choice("up", up, ("z", "y"))


def _as_place(which: str | int | None) -> str | int | None:
    """The name or the place of a light, a place as a Python int."""
    return which if which is None or isinstance(which, str) else check_size("which", which, 0)


def _check_suffix(path: Path, what: str) -> None:
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        hint = f"splats are for imaging.{what}_splats" if suffix == ".ply" else f"only {FORMATS}"
        raise ValueError(f"{path}: cannot {what} {suffix or 'no extension'}: {hint}")


def _facts(convention: str | Convention, up: str | None, layout: str | None) -> Convention:
    """Give the convention of a file's numbers: its layout and axes may be others than usual."""
    facts = look_up("convention", convention)
    changed = {"axes": f"{up}-up"} if up else {}
    if layout:
        changed["layout"] = layout
    return dataclasses.replace(facts, **changed)


def _in_ours(
    stored: Stored, convention: str | Convention | None, up: str | None
) -> Float[Array, "*batch 3 k"]:
    convention = convention or stored.convention
    if convention is None:
        raise ValueError(
            "it does not say its convention: say convention=, a name of harmonics.conventions() "
            'such as "jaxsh"'
        )
    facts = _facts(convention, up, stored.layout)
    values = _floats(stored.values)
    if values.ndim == 1 and facts.layout == "channels-last":
        # No square is three times another: it is one channel or three of them.
        one = math.isqrt(values.size) ** 2 == values.size
        values = values.reshape(-1, 1 if one or values.size % 3 else 3)
    light = np.asarray(convert(values, facts, _OWN))
    if stored.single and light.ndim > 2:
        raise ValueError(
            f"expected one light, got numbers of shape {values.shape}, which are {len(values)} in "
            f"the layout {facts.layout!r}"
        )
    if light.ndim == 1 or light.shape[-2] == 1:
        rows = light if light.ndim > 1 else light[None]
        light = np.broadcast_to(rows, (*rows.shape[:-2], 3, rows.shape[-1]))
    if light.shape[-2] != 3:
        raise ValueError(f"expected light of three channels, (..., 3, K), got shape {light.shape}")
    if not np.isfinite(light).all():
        raise ValueError(f"its numbers are beyond the range of {light.dtype}")
    if stored.rotation is None:
        return jnp.asarray(light)
    axes = axes_rows(facts.axes)
    rotation = axes.T @ stored.rotation @ axes
    return rotate(light, rotation.astype(light.dtype))


def _floats(values: np.ndarray) -> Float[np.ndarray, "..."]:
    """Give floating point of a type that JAX has."""
    kind = values.dtype
    if kind.kind not in "fiu" or (kind.kind != "f" and kind.itemsize < 4) or not values.size:
        raise ValueError(f"expected real numbers, got dtype {kind} and shape {values.shape}")
    if bad := int((~np.isfinite(values)).sum()):
        raise ValueError(f"{bad} of its {values.size} numbers are NaN or infinite")
    values = values.astype(np.float32 if kind.kind == "f" and kind.itemsize < 8 else np.float64)
    return values.astype(jnp.result_type(float)) if kind.itemsize > 4 else values


def write_light(
    path: str | os.PathLike[str],
    light: Float[ArrayLike, "*batch 3 k"],
    *,
    convention: str | Convention | None = None,
    up: Literal["z", "y"] | None = None,
) -> Path:
    """Write light to a file that another package reads, and return its path.

    - `.json`: a LightProbe for three.js' ObjectLoader.
    - `.txt`: as Filament's cmgen prints it, "filament" (pre-scaled irradiance, its `sh.txt`)
      unless `convention` is "filament-sh" or "filament-irradiance".
    - `.gltf`, `.glb`: a scene with the light of EXT_lights_image_based alone. The extension wants
      pictures for reflections as well: six small ones show the light itself.
    - `.npz`: an array "coefficients", in any convention, with the convention's name and facts, so
      that `read_light` needs no more; any batch in front. Without conversion to the last bit.
    - `.npy`: the same array alone. `read_light` has to be told its convention.

    `.json`, `.gltf`, `.glb` and sh.txt end at degree 2: what is above is left out, with a
    `UserWarning`.

    **Arguments**

    - `light`: (3, K) in our own convention; (..., 3, K) in `.npz` and `.npy`.
    - `convention`: of the numbers in the file; by default its package's, and ours in arrays.
    - `up`: the axis of the file that points up, "z" or "y". By default that of the convention.

    Makes missing folders. An existing file is replaced once the new one is complete. Raises
    `ValueError` for light that is not finite, an unknown extension, a convention that the format
    cannot say, and where `harmonics.convert` does, and `OSError` where the file cannot be written.
    Runs on the host.

    **Example**

    >>> import pathlib, tempfile
    >>> import jax.numpy as jnp
    >>> from jaxsh import imaging
    >>> light = jnp.eye(3, 9)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = imaging.write_light(pathlib.Path(folder) / "probe.json", light)
    ...     bool(jnp.abs(imaging.read_light(path) - light).max() < 1e-6)
    True
    """
    path = as_path(path)
    _check_options(convention, up)
    light = as_host_float(light, "light")
    check_finite("light", light, wait=True)
    light = light.astype(np.float32) if light.dtype.itemsize < 4 else light
    degree = check_coefficients("light", light)
    if light.ndim < 2 or light.shape[-2] != 3:
        raise ValueError(f"expected light (..., 3, K), got shape {light.shape}")
    suffix = path.suffix.lower()
    _check_suffix(path, "write")
    said = _SAID[suffix]
    convention = convention or (said[0] if said else _OWN)
    if said and convention not in said:
        raise ValueError(f"{path}: a {suffix} is in {' or '.join(said)}: write .npz for others")
    if said and light.ndim != 2:
        raise ValueError(f"{path}: a {suffix} holds one light (3, K), got shape {light.shape}")
    check_place(path)
    facts = _facts(convention, up, None)
    try:
        fitted = _fitted(light, facts.degree, bool(said))
        values = np.asarray(convert(fitted, _OWN, facts))
    except ValueError as error:
        raise ValueError(f"{path}: cannot be written: {reason(error, 350)}") from error
    if not np.isfinite(values).all():
        raise ValueError(f"{path}: cannot be written: its numbers go beyond {values.dtype}")
    put_in_place({path: _content(suffix, fitted, values, convention, facts)})
    if facts.degree is not None and degree > facts.degree:
        warnings.warn(
            f"{path}: left out what is above degree {facts.degree}, the last that it holds",
            stacklevel=2,
        )
    return path


def _content(
    suffix: str,
    light: Float[np.ndarray, "*batch 3 k"],
    values: Float[np.ndarray, "..."],
    convention: str | Convention,
    facts: Convention,
) -> Content:
    name = convention if isinstance(convention, str) else None
    if name and conventions()[name].axes != facts.axes:  # it is not what has that name
        name = None
    match suffix:
        case ".json":
            return three_file(values)
        case ".txt":
            return cmgen_file(values, str(name))
        case ".gltf" | ".glb":
            return gltf_file(values, light, facts, binary=suffix == ".glb")
        case ".npz":
            return npz_file(values, name, facts)
    return lambda file: np.save(file, values, allow_pickle=False)


def _fitted(
    light: Float[np.ndarray, "*batch 3 k"], degree: int | None, fill: bool
) -> Float[np.ndarray, "*batch 3 n"]:
    """Cut off what is above a degree, and fill up with zeros to it."""
    if degree is None:
        return light
    missing = (degree + 1) ** 2 - light.shape[-1]
    if missing > 0:
        return np.pad(light, ((0, 0), (0, missing))) if fill else light
    return light[..., : (degree + 1) ** 2]
