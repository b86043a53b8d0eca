"""Pixels of a picture, or vertices, as the rows that a fit takes."""

from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float

from .._core.checks import as_finite, as_float, check_vectors, described
from ..transfer import AbstractTransfer, StoredTransfer, Transfer, unshadowed
from ._checks import check_data


class Rows(NamedTuple):
    """Pixels or vertices, one a row, checked and in one dtype."""

    observed: Float[Array, "v 3"]
    transfer: Transfer
    albedo: Float[Array, "..."]
    weights: Float[Array, " v"]


def as_rows(
    observed: Float[ArrayLike, "..."],
    surface: Transfer | Float[ArrayLike, "..."],
    albedo: Float[ArrayLike, "..."],
    weights: Float[ArrayLike, "..."] | None,
    mask: Bool[ArrayLike, "..."] | None,
    degree: int,
) -> Rows:
    """Flattens observed (..., 3), and what belongs to it, to V rows.

    A surface of normals (..., 3) becomes an unshadowed transfer of the degree; a `Transfer` stays
    as it is. Where the mask is false, or a normal is not finite or zero, the weight is 0; albedo
    and weights may then be no numbers. Raises as `check_data` does, and for shapes that do not fit.
    """
    observed, albedo = as_float(observed, "observed"), as_float(albedo, "albedo")
    given = isinstance(surface, Transfer)
    if not given and isinstance(surface, AbstractTransfer | StoredTransfer):
        stored = isinstance(surface, StoredTransfer)
        instead = "its .load()" if stored else "the Transfer that it was made of"
        raise TypeError(
            f"expected normals or a Transfer, got a {type(surface).__name__}: give {instead}"
        )
    normals = surface.normals if given else as_float(surface, "normals")
    check_vectors("normals", normals)
    if normals.ndim < 2:
        raise ValueError(f"expected normals (V, 3) or (H, W, 3), got shape {normals.shape}")
    if observed.shape != normals.shape:
        raise ValueError(f"expected observed {normals.shape}, got shape {observed.shape}")
    places = normals.shape[:-1]
    each = albedo.ndim > 1 and albedo.shape[:-1] == places
    if each:
        albedo = albedo.reshape(-1, albedo.shape[-1])
    elif len(places) > 1 and albedo.ndim > 1:
        raise ValueError(
            f"expected albedo as a number, (3,), {(*places, 1)} or {(*places, 3)}, got shape "
            f"{albedo.shape}"
        )
    seen = jnp.all(jnp.isfinite(normals), axis=-1) & jnp.any(normals != 0, axis=-1)
    if mask is not None:
        seen = seen & _as_mask(mask, places)
    normals = normals.reshape(-1, 3)
    transfer = surface if given else unshadowed(jnp.zeros_like(normals), normals, degree)
    if weights is None:
        weights = seen.reshape(-1).astype(transfer.dtype)
    else:
        weights = as_float(weights, "weights")
        if weights.shape == places:  # where nothing is seen they need be no numbers
            weights = jnp.where(seen, weights, 0)
        weights = of_places("weights", weights, places)
    if each:
        albedo = jnp.where(weights[:, None] > 0, albedo, 0)
    data = check_data(observed.reshape(-1, 3), transfer, albedo, weights)
    return Rows(data[0], transfer, *data[1:])


def _as_mask(mask: Any, places: tuple[int, ...]) -> Bool[Array | np.ndarray, "..."]:
    """Converts to booleans, one of each place; raises `ValueError` for anything else."""
    try:
        array = mask if isinstance(mask, Array) else np.asarray(mask)
    except ValueError:  # lists of several lengths
        array = np.empty(0)
    if array.shape != places or array.dtype != bool:
        raise ValueError(f"expected mask {places} of booleans, got {described(mask)}")
    return array


def of_places(name: str, value: Float[ArrayLike, "..."], places: tuple[int, ...]) -> Array:
    """Flattens finite numbers, one of each pixel or vertex; raises `ValueError` for others."""
    value = as_finite(value, name)
    if value.shape != places:
        raise ValueError(f"expected {name} {places}, got shape {value.shape}")
    return value.reshape(-1)
