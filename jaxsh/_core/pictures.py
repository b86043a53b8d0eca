"""Checks of pictures: radiance in floats, height and width before channels, twice as wide as high.

What a mistaken picture would give is a picture too, so each mistake is named with the way to mend
it. All but the values is known at trace time.
"""

from typing import Any, Literal

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .checks import check_finite, said_dtype
from .host import put
from .known import at_hand, on_host

# What stands beyond the edges of a texture.
Wrap = Literal["repeat", "clamp", "mirror"]


def as_radiance(name: str, value: Any) -> Float[Array, "..."]:
    """Convert to a JAX array of floats, of any shape.

    Raises `ValueError` for what is none: also integers, which hold a picture's code and no light.
    """
    array = value
    if not isinstance(value, Array):
        try:
            plain = on_host(value)
            array = jnp.asarray(value) if plain is None else plain
        except (TypeError, ValueError) as error:
            if isinstance(error, jax.errors.JAXTypeError):  # of tracing
                raise
            kind = type(value).__name__
            raise ValueError(f"expected {name} as an array of floats, got {kind}") from None
    if not jnp.issubdtype(array.dtype, jnp.floating):
        raise ValueError(f"expected {name} in floats, got {said_dtype(array.dtype)}")
    return array if isinstance(array, Array) else put(array)


def as_picture(name: str, value: Any, *, lat_long: bool = False) -> Float[Array, "h w c"]:
    """Convert to a picture (height, width, channels), with `lat_long` one of the whole sphere.

    Raises `ValueError` for another shape and as `as_radiance` does.
    """
    array = as_radiance(name, value)
    check_shape(name, array.shape, lat_long=lat_long)
    return array


def check_shape(name: str, shape: tuple[int, ...], *, lat_long: bool = False) -> None:
    """Refuse what is no picture (height, width, channels), with the way to make it one."""
    hint = ""
    if len(shape) == 2:
        hint = "; a gray one needs a last axis of length 1"
    elif len(shape) == 4:
        hint = "; for a batch use jax.vmap"
    elif len(shape) == 3 and _channels_first(shape):
        hint = "; channels come last, see jax.numpy.moveaxis"
    elif len(shape) == 3 and 0 not in shape:
        if lat_long:
            _check_lat_long(name, *shape[:2])
        return
    raise ValueError(f"expected {name} (height, width, channels), got shape {shape}{hint}")


def check_values(name: str, picture: Array) -> None:
    """Refuse NaN and infinities of a picture at hand on a CPU, at which it looks once."""
    if at_hand(picture):
        check_finite(name, picture, wait=True)


def check_result(name: str, picture: Array, result: Array) -> None:
    """Refuse NaN and infinities of a picture, where sums over it are at hand on a CPU.

    The sums are few and the picture is large: only where they are not finite is it looked at.
    """
    if at_hand(result) and not np.isfinite(np.asarray(result)).all():
        check_finite(name, picture, wait=True)


def _channels_first(shape: tuple[int, ...]) -> bool:
    """(3, height, width), and not a picture of three rows."""
    first, height, width = shape
    return first in (1, 3, 4) and width > 4 and (height != 2 * first or width == 2 * height)


def _check_lat_long(name: str, height: int, width: int) -> None:
    if 2 * width >= 3 * height:
        return
    known = {
        (1, 1): ", the shape of an angular map or a cube's face: see imaging.read_environment",
        (4, 3): ", the shape of a vertical cross: see imaging.read_environment",
        (3, 4): ", the shape of a horizontal cross: see imaging.read_environment",
        (6, 1): ", the shape of a cube: see imaging.read_environment",
        (2, 1): "; is it transposed?",
    }
    likely = [hint for (h, w), hint in known.items() if height * w == width * h]
    raise ValueError(
        f"expected {name} to be lat-long, about twice as wide as high, got width {width} and "
        f"height {height}{''.join(likely)}"
    )
