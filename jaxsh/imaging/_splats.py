"""Splats of 3D Gaussian splatting, whose colors are spherical harmonics: PLY files and arrays."""

import dataclasses
import math
import os
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Array, Float

from .._core.checks import as_float, as_path, check_choice, check_coefficients, check_type
from .._core.files import check_place, put_in_place
from .._core.words import reason
from ..harmonics import conventions, convert
from ..harmonics._convention import axes_rows
from ._light_files import SplatArrays, put_splats, read_splat_arrays, splats_problem

_HALF = math.sqrt(0.5)
# What puts an axis of the file up: where its x, y and z land in ours, and the same turn about x as
# w and x of a quaternion.
_TURNS = {
    "z": (("+x", "+y", "+z"), (1.0, 0.0)),
    "y": (("+x", "+z", "-y"), (_HALF, _HALF)),
    "-y": (("+x", "-z", "+y"), (_HALF, -_HALF)),
}


def _floats(name: str) -> Callable[[Any], Array]:
    return lambda value: as_float(value, name)


def _floats_or_none(name: str) -> Callable[[Any], Array | None]:
    return lambda value: None if value is None else as_float(value, name)


class Splats(eqx.Module):
    """Holds splats: Gaussians in space, each with a color that depends on the direction of view.

    The color of splat n from an eye is max(0, ½ + Σ_k coefficients[n, :, k] · y_k(d)), with d from
    the eye to the splat; it is what a picture stores, not radiance. The rest is as the file has it,
    before the functions that renderers apply.

    **Arguments**

    - `positions`: (n, 3).
    - `coefficients`: (n, 3, K), in our own convention.
    - `opacities`: (n,), before the sigmoid; or None.
    - `scales`: (n, s), before the exponential; s is 3, or 2 for discs; or None.
    - `rotations`: (n, 4), quaternions w, x, y, z of any length; or None.

    Raises `ValueError` for shapes that do not fit.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import harmonics, imaging
    >>> splats = imaging.Splats(jnp.zeros((5, 3)), jnp.zeros((5, 3, 16)))
    >>> toward = splats.positions - jnp.array([0.0, -4.0, 0.0])
    >>> jnp.maximum(0.5 + harmonics.synthesize(splats.coefficients, toward), 0).shape
    (5, 3)
    """

    positions: Float[Array, "n 3"] = eqx.field(converter=_floats("positions"))
    coefficients: Float[Array, "n 3 k"] = eqx.field(converter=_floats("coefficients"))
    opacities: Float[Array, " n"] | None = eqx.field(
        default=None, converter=_floats_or_none("opacities")
    )
    scales: Float[Array, "n s"] | None = eqx.field(
        default=None, converter=_floats_or_none("scales")
    )
    rotations: Float[Array, "n 4"] | None = eqx.field(
        default=None, converter=_floats_or_none("rotations")
    )

    def __check_init__(self):
        shape = self.coefficients.shape
        check_coefficients("coefficients", self.coefficients)
        if len(shape) != 3 or shape[1] != 3:
            raise ValueError(f"expected coefficients (n, 3, K), got shape {shape}")
        count = shape[0]
        wanted = {"positions": [(count, 3)], "opacities": [(count,)], "rotations": [(count, 4)]}
        wanted["scales"] = [(count, 3), (count, 2)]
        for name, shapes in wanted.items():
            array = getattr(self, name)
            if array is not None and array.shape not in shapes:
                raise ValueError(
                    f"expected {name} {' or '.join(map(str, shapes))}, for the {count} of the "
                    f"coefficients, got shape {array.shape}"
                )


def read_splats(path: str | os.PathLike[str], *, up: Literal["z", "y", "-y"] = "z") -> Splats:
    """Read the splats of a PLY file, as 3D Gaussian splatting writes them; degrees 0 to 4.

    Takes x y z, f_dc_0 to 2, f_rest_… (all of red first, 0, 9, 24, 45 or 72 of them), opacity,
    scale_… and rot_0 to 3. Normals of zero are left out; other properties are too, with a
    `UserWarning` that names them. A million splats of degree 3 take about a second.

    **Arguments**

    - `up`: the axis of the file that points up. The file does not say: by default it is taken as it
      is, z up, and every number stays as it is to the last bit, but for the signs of the harmonics.
      "y" turns positions, rotations and colors as `geometry.read_mesh` does, (x, y, z) →
      (x, -z, y); "-y" turns scenes of cameras whose y points down, (x, y, z) → (x, z, -y).

    **Returns** `Splats` in float32, or in float64 where the file has doubles and JAX's x64 is on.

    Raises `FileNotFoundError` for a missing file, and `ValueError`, naming the file and the
    problem, for a damaged one, one without splats, another number of coefficients, and NaN or
    infinite values; an opacity may be infinite. Runs on the host.

    **Example**

    >>> import pathlib, tempfile
    >>> import jax.numpy as jnp
    >>> from jaxsh import imaging
    >>> splats = imaging.Splats(jnp.zeros((5, 3)), jnp.ones((5, 3, 4)))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = imaging.write_splats(pathlib.Path(folder) / "a.ply", splats)
    ...     imaging.read_splats(path).coefficients.shape
    (5, 3, 4)
    """
    path = as_path(path)
    check_choice("up", up, _TURNS)
    if path.suffix.lower() != ".ply":
        raise ValueError(f"{path}: cannot read {path.suffix or 'no extension'}, only .ply")
    if not path.is_file():
        raise FileNotFoundError(f"{path}: there is no such file of splats")
    try:
        arrays, ignored = read_splat_arrays(path.read_bytes())
        arrays = _turned(_in_jax_types(arrays), up)
    except MemoryError as error:
        raise ValueError(f"{path}: damaged, or too large for memory") from error
    except ValueError as error:
        raise ValueError(f"{path}: {reason(error, 350)}") from error
    if ignored:
        warnings.warn(f"{path}: {reason(ignored, 600)}", stacklevel=2)
    return Splats(**arrays._asdict())


def write_splats(
    path: str | os.PathLike[str], splats: Splats, *, up: Literal["z", "y", "-y"] = "z"
) -> Path:
    """Write splats as a binary PLY that 3D Gaussian splatting reads, and return its path.

    With the properties in the order of its own `save_ply`, normals of zero among them.
    `read_splats` with the same `up` gives the same splats back: to the last bit for "z", to
    rounding of rotations and coefficients for the others.

    **Arguments**

    - `splats`: `Splats`, in float32 or float64.
    - `up`: the axis of the file that points up.

    Makes missing folders. An existing file is replaced once the new one is complete. Raises
    `ValueError` for arrays that do not make splats, NaN and infinite values and another extension,
    and `OSError` where the file cannot be written. Runs on the host.

    **Example**

    >>> import pathlib, tempfile
    >>> import jax.numpy as jnp
    >>> from jaxsh import imaging
    >>> splats = imaging.Splats(jnp.zeros((5, 3)), jnp.ones((5, 3, 4)))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     imaging.write_splats(pathlib.Path(folder) / "a.ply", splats, up="y").name
    'a.ply'
    """
    path = as_path(path)
    check_type("splats", splats, Splats)
    check_choice("up", up, _TURNS)
    if path.suffix.lower() != ".ply":
        raise ValueError(f"{path}: cannot write {path.suffix or 'no extension'}, only .ply")
    arrays = SplatArrays(
        np.asarray(splats.positions),
        np.asarray(splats.coefficients),
        *(
            None if one is None else np.asarray(one)
            for one in (splats.opacities, splats.scales, splats.rotations)
        ),
    )
    if problem := splats_problem(arrays):
        raise ValueError(f"{path}: cannot be written: {problem}")
    check_place(path)
    put_in_place({path: lambda file: put_splats(file, _turned(arrays, up, back=True))})
    return path


def _in_jax_types(arrays: SplatArrays) -> SplatArrays:
    """Cast to what JAX has, and check once more: float32 cannot hold all that float64 can."""
    with np.errstate(over="ignore"):
        cast: dict[str, Any] = {
            name: None if one is None else _in_jax_type(one)
            for name, one in arrays._asdict().items()
        }
        arrays = SplatArrays(**cast)
    if problem := splats_problem(arrays):
        raise ValueError(problem)
    return arrays


def _in_jax_type(array: np.ndarray) -> np.ndarray:
    return array.astype(jax.dtypes.canonicalize_dtype(array.dtype), copy=False)


def _turned(arrays: SplatArrays, up: str, *, back: bool = False) -> SplatArrays:
    """Bring splats from the file's axes and signs into ours, or back."""
    axes, (a, b) = _TURNS[up]
    coefficients = _in_convention(arrays.coefficients, axes, back)
    if up == "z":
        return arrays._replace(coefficients=coefficients)
    rows = axes_rows(axes)
    positions = arrays.positions @ (rows.T if back else rows).astype(arrays.positions.dtype)
    rotations = arrays.rotations
    if rotations is not None:
        a, b = rotations.dtype.type(a), rotations.dtype.type(-b if back else b)
        w, x, y, z = rotations.T
        # (a + b i)(w + x i + y j + z k)
        rotations = np.stack([a * w - b * x, a * x + b * w, a * y - b * z, a * z + b * y], axis=1)
    return arrays._replace(positions=positions, rotations=rotations, coefficients=coefficients)


def _in_convention(
    coefficients: Float[np.ndarray, "n 3 k"], axes: tuple[str, str, str], back: bool
) -> Float[np.ndarray, "n 3 k"]:
    """Convert many functions at once, by what becomes of each basis function."""
    facts = dataclasses.replace(
        conventions()["gaussian-splatting"], layout="coefficients-last", axes=axes
    )
    unit = _in_jax_type(np.eye(coefficients.shape[-1], dtype=coefficients.dtype))
    matrix = np.asarray(convert(unit, *(("jaxsh", facts) if back else (facts, "jaxsh"))))
    matrix = matrix.astype(coefficients.dtype)
    signs = np.diagonal(matrix)
    if (matrix == np.diag(signs)).all():  # to the last bit, also where XLA gives zero
        return coefficients * signs
    return coefficients @ matrix
