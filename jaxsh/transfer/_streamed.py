"""Shading of a transfer on disk, block by block."""

import functools
from collections.abc import Callable, Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._core.checks import check_known
from ._material import Material
from ._store_stream import stream
from ._stored import StoredTransfer
from ._transfer import Transfer


def streamed_diffuse(
    shade: Callable[..., Array],
    light: Float[Array, "..."],
    transfer: StoredTransfer,
    albedo: Float[Array | np.ndarray, "..."],
) -> Float[np.ndarray, "... v 3"]:
    """Shade each block by `shade(light, transfer, albedo)`; the arguments are checked."""
    lights, albedos = _on_host("light", light), _on_host("albedo", albedo)

    def of(rows: slice, block: Transfer) -> Array:
        return shade(_own(lights, rows), block, albedos[rows] if albedos.ndim == 2 else albedos)

    return _shaded(transfer, ("coefficients",), of)


def streamed_fluence(
    product: Callable[..., Array], light: Float[Array, "..."], transfer: StoredTransfer
) -> Float[np.ndarray, "... v 3"]:
    """Multiply each block by `product(light, transfer)`; the arguments are checked."""
    lights = _on_host("light", light)

    def of(rows: slice, block: Transfer) -> Array:
        return product(_own(lights, rows), block)

    return _shaded(transfer, ("coefficients",), of)


def streamed_glossy(
    shade: Callable[..., Array],
    light: Float[Array, "..."],
    transfer: StoredTransfer,
    eye: Float[Array, " 3"],
    material: Material,
) -> Float[np.ndarray, "... v 3"]:
    """Shade each block by `shade(light, transfer, eye, material)`; the arguments are checked."""
    lights, place = _on_host("light", light), _on_host("eye", eye)
    diffuse = _on_host("material", material.diffuse)
    specular = _on_host("material", material.specular)
    name, lobe = material.lobe
    lobe = _on_host("material", lobe)

    def of(rows: slice, block: Transfer) -> Array:
        own = Material(
            diffuse[rows] if diffuse.ndim == 2 else diffuse,
            specular[rows] if specular.ndim == 2 else specular,
            **{name: lobe[rows] if lobe.ndim else lobe},
        )
        return shade(_own(lights, rows), block, place, own)

    return _shaded(transfer, ("coefficients", "positions", "normals"), of)


def _shaded(
    transfer: StoredTransfer, arrays: Sequence[str], shade: Callable[[slice, Transfer], Array]
) -> np.ndarray:
    """Put together the colors (..., V, 3) that a function gives for each block.

    Only `arrays` are read; the others of the transfers are zero.
    """
    colors = None

    @functools.cache
    def zeros(rows: int) -> tuple[Array, Array]:
        return jnp.zeros((rows, 3), transfer.dtype), jnp.zeros((rows, 0), jnp.int32)

    def give(rows: slice, *read: Array) -> tuple[slice, Array]:
        held = dict(zip(arrays, read, strict=True))
        left, neighbors = zeros(len(read[0]))
        positions, normals = held.get("positions", left), held.get("normals", left)
        block = Transfer(held["coefficients"], positions, normals, neighbors, **transfer.kind)
        return rows, shade(rows, block)

    for rows, part in stream(transfer._store, arrays, give, keep=False):
        if colors is None:
            colors = np.empty((*part.shape[:-2], transfer.num_points, 3), part.dtype)
        colors[..., rows, :] = part
    assert colors is not None
    return colors


def _on_host(name: str, array: Array | np.ndarray) -> np.ndarray:
    # From there it goes to whichever device has the block.
    check_known(name, array)
    return np.asarray(array)


def _own(lights: np.ndarray, rows: slice) -> np.ndarray:
    one_each = lights.ndim > 2 and lights.shape[-3] != 1
    return lights[..., rows, :, :] if one_each else lights
