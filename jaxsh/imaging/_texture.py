"""Pictures looked up at texture coordinates: bilinear, and mip-mapped where the step is known."""

import functools
from typing import NamedTuple, get_args

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .._core.checks import as_float, check_choice
from .._core.pictures import Wrap, as_picture, as_radiance, check_values
from .._core.xla import keep_rows, rounded_once


def sample_texture(
    texture: Float[Array, "h w c"],
    uv: Float[Array, "*shape 2"],
    footprint: Float[Array, "*shape 2 2"] | None = None,
    *,
    wrap: Wrap = "repeat",
) -> Float[Array, "*shape c"]:
    """Look up a picture at texture coordinates: bilinear, with a `footprint` mip-mapped too.

    `texture` (h, w, c) has its top row at v = 1 and u to the right, so that (0, 0) is the lower
    left corner, and texel (i, j) is centered at u = (j + ½)/w, v = 1 - (i + ½)/h. With `uv`
    (..., 2) it gives (..., c) in the dtype of `texture`. Give linear values: 8-bit sRGB by
    `srgb_decode(picture / 255)`.

    - `footprint` (..., 2, 2): the change of (u, v) over a step to the right and over one down in
      the picture that is drawn, in its columns; `Raster` has it. Where the longer of both is ρ >
      √3 texels, coarser levels of the picture are looked up, blended between the two nearest
      (Williams 1983). Each level is the mean over the areas of its texels, whatever the size.
      Level log₂(ρ/√3) looks as far around as a mean over the step does: its texels and the look-up
      between them have a variance of 4^level/12 + 4^level/6, the step ρ²/12. OpenGL's log₂ ρ is
      that of `√3 * footprint`, and blurs more (`python -m experiments run surfaces.levels`).
      Without a footprint, what is finer than the steps is sampled as it is, and flickers.
    - `wrap`: what stands beyond [0, 1]: "repeat" the picture again, "clamp" its outermost texels,
      or "mirror" the picture turned over.

    Raises `ValueError` for wrong shapes, integers and an unknown `wrap`, and, on a CPU, for a
    texture with NaN or infinite values, at which it looks once. NaN coordinates give NaN.

    Linear and differentiable in `texture`; in `uv` and `footprint` too, with kinks between texels
    and levels, where a slope is that of one side. Runs under `jit` and `vmap`; shards over the
    leading axis of `uv`, where `texture` is whole on each device. Its levels take a third more
    memory than the texture.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import imaging
    >>> texture = jnp.arange(4.0).reshape(2, 2, 1)  # 0 and 1 above 2 and 3
    >>> uv = jnp.array([[0.25, 0.25], [0.5, 0.5], [0.75, 0.75]])
    >>> imaging.sample_texture(texture, uv).ravel().tolist()
    [2.0, 1.5, 1.0]
    """
    check_choice("wrap", wrap, get_args(Wrap))
    texture = as_picture("texture", texture)
    check_values("texture", texture)
    uv = as_radiance("uv", uv)
    if uv.ndim == 0 or uv.shape[-1] != 2:
        raise ValueError(f"expected uv (..., 2) with u and v last, got shape {uv.shape}")
    if footprint is None:
        return keep_rows(
            functools.partial(_sample_texture, wrap), texture, uv, like=uv, axis=0, out=0
        )
    footprint = as_float(footprint, "footprint").astype(uv.dtype)
    if footprint.shape != (*uv.shape, 2):
        raise ValueError(
            f"expected footprint {(*uv.shape, 2)}, the change of u and v over two steps, got shape "
            f"{footprint.shape}"
        )
    return keep_rows(
        functools.partial(_sample_texture, wrap), texture, uv, footprint, like=uv, axis=0, out=0
    )


class Pyramid(NamedTuple):
    """Holds pictures one after the other in one array, each with its coarser levels or without.

    The rest is known at trace time: of each level, where it starts and its size; of each picture,
    its first and its last level.
    """

    texels: Float[Array, "t c"]
    start: Int[np.ndarray, " level"]
    height: Int[np.ndarray, " level"]
    width: Int[np.ndarray, " level"]
    first: Int[np.ndarray, " picture"]
    last: Int[np.ndarray, " picture"]


def pyramid(pictures: list[Float[Array, "_ _ c"]], *, levels: bool) -> Pyramid:
    """Put pictures into one array, with `levels` halved down to one texel."""
    stored, first, last = [], [], []
    for picture in pictures:
        first.append(len(stored))
        stored.append(picture)
        while levels and max(stored[-1].shape[:2]) > 1:
            stored.append(_halved(_halved(stored[-1], 0), 1))
        last.append(len(stored) - 1)
    height, width = np.array([level.shape[:2] for level in stored], np.int32).T
    end = np.cumsum(height * width, dtype=np.int32)
    return Pyramid(
        jnp.concatenate([level.reshape(-1, level.shape[-1]) for level in stored]),
        end - height * width,
        height,
        width,
        np.array(first, np.int32),
        np.array(last, np.int32),
    )


def sample(
    pyramid: Pyramid,
    picture: Int[Array, "*shape"] | int,
    uv: Float[Array, "*shape 2"],
    squared: Float[Array, "*shape"] | None,
    wrap: Wrap,
) -> Float[Array, "*shape c"]:
    """Look up a picture of a pyramid at each place; `squared` is the step there, in texels²."""
    if squared is None:
        return _bilinear(pyramid, jnp.asarray(pyramid.first)[picture], uv, wrap)
    first, last = jnp.asarray(pyramid.first)[picture], jnp.asarray(pyramid.last)[picture]
    level = jnp.log2(jnp.maximum(squared / 3, 1)) / 2
    level = jnp.minimum(level, (last - first).astype(level.dtype))
    finer = jnp.floor(level)
    share = (level - finer).astype(pyramid.texels.dtype)[..., None]
    here = first + finer.astype(jnp.int32)
    one = _bilinear(pyramid, here, uv, wrap)
    other = _bilinear(pyramid, jnp.minimum(here + 1, last), uv, wrap)
    return one * (1 - share) + other * share


def longer_step(
    footprint: Float[Array, "*shape 2 2"], height: Array | int, width: Array | int
) -> Float[Array, "*shape"]:
    """The square of the longer of two steps, in texels of a picture."""
    width, height = (jnp.asarray(n, footprint.dtype) for n in (width, height))
    right, down = (
        (footprint[..., 0, k] * width) ** 2 + (footprint[..., 1, k] * height) ** 2 for k in (0, 1)
    )
    return jnp.maximum(right, down)


@functools.partial(jax.jit, static_argnums=0)
def _sample_texture(wrap: Wrap, texture, uv, footprint=None):
    levels = pyramid([texture], levels=footprint is not None)
    squared = None if footprint is None else longer_step(footprint, *texture.shape[:2])
    return sample(levels, 0, uv, squared, wrap)


def _bilinear(pyramid: Pyramid, level: Int[Array, "*shape"], uv, wrap: Wrap):
    """Look up one level at each place, between its four nearest texels."""
    start, height, width = (
        jnp.asarray(table)[level] for table in (pyramid.start, pyramid.height, pyramid.width)
    )
    place = functools.partial(_place, wrap=wrap)
    row, column = rounded_once(place, uv, height.astype(uv.dtype), width.astype(uv.dtype))
    dtype = pyramid.texels.dtype
    i, j = jnp.floor(row), jnp.floor(column)
    down, right = ((x - n).astype(dtype)[..., None] for x, n in ((row, i), (column, j)))
    i, j = i.astype(jnp.int32), j.astype(jnp.int32)

    def along(i):
        line = start + _inside(i, height, wrap) * width
        left, after = (pyramid.texels[line + _inside(k, width, wrap)] for k in (j, j + 1))
        return left * (1 - right) + after * right

    return along(i) * (1 - down) + along(i + 1) * down


def _place(uv, height, width, wrap: Wrap):
    """Row and column of each place, counted in texels from the center of the first."""
    if wrap == "clamp":
        uv = jnp.clip(uv, -1, 2)  # beyond, texels do not change, and whole numbers stay small
    elif wrap == "repeat":
        uv = uv - jnp.floor(uv)
    else:
        uv = uv - 2 * jnp.floor(uv / 2)
    return (1 - uv[..., 1]) * height - 0.5, uv[..., 0] * width - 0.5


def _inside(index, count, wrap: Wrap):
    """The texel that stands for one beyond the edge."""
    if wrap == "clamp":
        return jnp.clip(index, 0, count - 1)
    if wrap == "repeat":
        return index % count
    turned = index % (2 * count)
    return jnp.minimum(turned, 2 * count - 1 - turned)


def _halved(picture: Float[Array, "h w c"], axis: int) -> Float[Array, "half_h half_w c"]:
    """Halve a picture along an axis, rounding down, by the mean over the area of each new texel."""
    count = picture.shape[axis]
    half = count // 2
    if count == 1:
        return picture
    even, odd = (jax.lax.slice_in_dim(picture, k, 2 * half, 2, axis) for k in (0, 1))
    if count == 2 * half:
        return (even + odd) / 2
    # A new texel is 2 + 1/half wide: the part of one, a whole one, and the part of a third.
    shape = [1, 1, 1]
    shape[axis] = half
    k = np.arange(half).reshape(shape)
    after = jax.lax.slice_in_dim(picture, 2, count, 2, axis)
    first, third = (jnp.asarray(n / count, picture.dtype) for n in (half - k, k + 1))
    return even * first + odd * (half / count) + after * third
