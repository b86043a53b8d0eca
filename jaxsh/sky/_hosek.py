"""Radiance of Hosek and Wilkie's sky (2012), from the tables that the `mitsuba` wheel carries."""

import importlib.util
import math
import pathlib
import struct

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import align, check_batches
from .._core.host import read_only_cache
from .._core.linalg import einsum
from ._angles import angles, directions, parameter
from ._validity import Check, check_option, check_range, check_sun

# The tables hold the spectrum's integral with the color matching: kcd/m² are 0.683 of it.
_KILOLUMENS_PER_WATT = 0.683

_FILE = pathlib.Path("data", "sunsky", "sunsky_datasets.bin")

# Mitsuba's container of named arrays, all of it little-endian.
_MAGIC = b"tensor_file\x00\x01\x00"
_DTYPES = dict(enumerate(("i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f2", "f4", "f8"), 1))


def hosek_radiance(
    view: Float[ArrayLike, "*views 3"],
    sun: Float[ArrayLike, "*suns 3"],
    turbidity: Float[ArrayLike, "*turbidities"],
    albedo: Float[ArrayLike, "*albedos"] = 0.3,
    *,
    check: Check = "raise",
) -> Float[Array, "*out 3"]:
    """Radiance of Hosek and Wilkie's sky without the sun's disc, linear sRGB in kcd/m²: (..., 3).

    The model's own RGB fit, linear between the whole turbidities 1 to 10 and between the ground
    albedos 0 and 1, and a quintic Bézier curve in the cube root of the sun's elevation. The
    tables are read when first used from `mitsuba` (`pip install mitsuba`; it is not imported).

    **Arguments**

    - `view`, `sun`: (..., 3), of any length; `turbidity` (...) in [1, 10]; `albedo` (...) of the
      ground in [0, 1], the same in each channel. Batches broadcast. Differentiable in all.
    - `check`: what becomes of values beyond those ranges and of a sun below the horizon: raises,
      warns or is allowed (the nearest value in range is then used).

    Zero below the horizon. Kinks: the cones at the sun and the antisolar point, whole
    turbidities; next to the horizon the derivatives grow without bound for the sun
    (elevation^-2/3) and the view (cos^-1/2), and on it they are set to zero. Raises `ImportError`
    where mitsuba is not installed.

    The model's own sun is not read. Beside this sky `sun_radiance`, which is Preetham's, is too
    dark for a low sun: its luminance is 2.6 % of that of Hosek and Wilkie's sun (2013) at turbidity
    6 and an elevation of 5°, and 87 % at turbidity 3 and 30°.

    **Example**

    >>> import importlib.util
    >>> import numpy as np
    >>> from jaxsh import sky
    >>> if importlib.util.find_spec("mitsuba"):
    ...     up, sun = np.array([0.0, 0.0, 1.0]), np.array([0.6, 0.0, 0.8])
    ...     assert sky.hosek_radiance(up, sun, 3.0).shape == (3,)
    """
    check_option(check)
    view, sun = directions(view, "view"), directions(sun, "sun")
    dtype = jnp.result_type(view, sun)
    turbidity, albedo = parameter(turbidity, dtype, "turbidity"), parameter(albedo, dtype, "albedo")
    check_batches(
        view=view.shape, sun=sun.shape, turbidity=(*turbidity.shape, 1), albedo=(*albedo.shape, 1)
    )
    check_range("turbidity", turbidity, check, 1.0, 10.0)
    check_range("albedo", albedo, check, 0.0, 1.0)
    check_sun(sun, check)
    return _radiance(view, sun, turbidity, albedo, jnp.asarray(_tables(), dtype))


@jax.jit
def _radiance(view, sun, turbidity, albedo, tables):
    turbidity, albedo, view, sun = align(turbidity[..., None], albedo[..., None], view, sun)
    geometry = angles(view, sun)
    parts = _interpolated(tables, geometry.theta_sun, turbidity[..., 0], albedo[..., 0])
    channels = [_channel(part, geometry) for part in parts]
    color = _KILOLUMENS_PER_WATT * jnp.stack(jnp.broadcast_arrays(*channels), axis=-1)
    return jnp.where((geometry.cos_view >= 0)[..., None], color, 0)


def _channel(parts, geometry):
    """Radiance in one channel: Hosek and Wilkie 2012, eqs. 8 and 9, times the mean."""
    a, b, c, d, e, f, g, h, i, mean = parts
    cosine, cos_gamma = geometry.cos_view, geometry.cos_gamma
    up = cosine > 0
    root = jnp.where(up, jnp.sqrt(jnp.where(up, cosine, 1)), 0)
    halo = (1 + cos_gamma * cos_gamma) / (1 + i * i - 2 * i * cos_gamma) ** 1.5
    towards_horizon = 1 + a * jnp.exp(b / (jnp.where(up, cosine, 0) + 0.01))
    around_sun = c + d * jnp.exp(e * geometry.gamma) + f * cos_gamma * cos_gamma
    return towards_horizon * (around_sun + g * halo + h * root) * mean


def _interpolated(tables, theta_sun, turbidity, albedo):
    """Ten numbers for each of three channels, every one an array of the suns' shape."""
    # Sums, since a broadcast array would not be sharded as the others are.
    zero = jnp.zeros_like(theta_sun + turbidity + albedo)
    theta_sun, turbidity, albedo = theta_sun + zero, turbidity + zero, albedo + zero
    elevation = math.pi / 2 - theta_sun
    up = elevation > 0
    along = jnp.where(up, jnp.cbrt(jnp.where(up, elevation, 1) / (math.pi / 2)), 0)
    curve = [math.comb(5, k) * along**k * (1 - along) ** (5 - k) for k in range(6)]
    turbidity, albedo = jnp.clip(turbidity, 1, 10), jnp.clip(albedo, 0, 1)
    hats = [jnp.maximum(1 - jnp.abs(turbidity - k), 0) for k in range(1, 11)]
    along, hats, albedo = (jnp.stack(t, axis=-1) for t in (curve, hats, [1 - albedo, albedo]))
    weights = hats[..., None, None] * albedo[..., None, :, None] * along[..., None, None, :]
    weights = weights.reshape(*zero.shape, -1)
    numbers = einsum("...w,wcp->cp...", weights, tables.reshape(-1, *tables.shape[3:]))
    return [tuple(channel) for channel in numbers]


@read_only_cache(maxsize=None)
def _tables() -> Float[np.ndarray, "10 2 6 3 10"]:
    """Nine shape parameters and the mean, by turbidity, albedo, control point, channel."""
    tensors = read_tensors(_table_path())
    shapes, means = tensors["sky_params_rgb"], tensors["sky_rad_rgb"]
    return np.concatenate([shapes, means[..., None]], axis=-1)


def _table_path() -> pathlib.Path:
    found = importlib.util.find_spec("mitsuba")
    # Once imported, mitsuba puts an extension module of its own folder in its place.
    origin = found.origin if found else None
    if origin and (path := pathlib.Path(origin).parent / _FILE).is_file():
        return path
    raise ImportError(
        "hosek_radiance reads its tables from the mitsuba package: `pip install mitsuba` "
        f"brings them in {_FILE.as_posix()}"
    )


def read_tensors(path: pathlib.Path) -> dict[str, np.ndarray]:
    """Reads arrays by name. Raises `ValueError` that names a file that is not one."""
    data = path.read_bytes()
    if not data.startswith(_MAGIC):
        raise ValueError(f"{path}: not a tensor file of version 1.0")
    try:
        return _read(data)
    except (struct.error, ValueError, KeyError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: damaged tensor file ({error})") from error


def _read(data: bytes) -> dict[str, np.ndarray]:
    """Reads a count, then for each: length and name, rank, type, offset, extents."""
    (count,), at = struct.unpack_from("<I", data, len(_MAGIC)), len(_MAGIC) + 4
    tensors = {}
    for _ in range(count):
        (length,) = struct.unpack_from("<H", data, at)
        name = data[at + 2 : at + 2 + length].decode()
        at += 2 + length
        rank, kind, offset = struct.unpack_from("<HBQ", data, at)
        shape = struct.unpack_from(f"<{rank}Q", data, at + 11)
        at += 11 + 8 * rank
        dtype = np.dtype("<" + _DTYPES[kind])
        flat = np.frombuffer(data, dtype, int(np.prod(shape)), offset)
        tensors[name] = flat.reshape(shape)
    return tensors
