"""What the filtering methods are given, looked at before it is traced."""

import operator
from typing import TypedDict

import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float

from .._core.checks import as_float, is_concrete
from ..harmonics import degree_of
from ..transfer._glossy_kernels import checked_eye, checked_light, checked_material
from ._filter import Filter
from ._result import AdaptiveResult

OUTSIDE = ("level", "base")


class FilterOptions(TypedDict, total=False):
    """Keywords of the filtering methods; `shade_masks` says what they mean."""

    threshold: Float[ArrayLike, ""]
    diffuse_threshold: Float[ArrayLike, ""]
    exposure: Float[ArrayLike, ""]
    base: int
    outside: str
    rings: int
    smoothing: bool
    previous: AdaptiveResult | None
    leave: Float[ArrayLike, ""]
    distant: bool
    normalized: bool


def checked(
    light,
    transfer,
    eye,
    material,
    *,
    threshold: ArrayLike = 0.02,
    diffuse_threshold: ArrayLike = 0.01,
    exposure: ArrayLike = 1.0,
    base: int = 2,
    outside: str = "level",
    rings: int = 0,
    smoothing: bool = False,
    previous: AdaptiveResult | None = None,
    leave: ArrayLike = 1.0,
    distant: bool = False,
    normalized: bool = True,
):
    """Arguments of `filtered`, in the transfer's dtype."""
    light, transfer, eye, material = checked_frame(light, transfer, eye, material)
    count, dtype = transfer.num_points, light.dtype
    target, base, rings = degree_of(light.shape[-1]), operator.index(base), operator.index(rings)
    if not 0 <= base <= target:
        raise ValueError(f"expected base from 0 to the light's degree, {target}, got {base}")
    if rings < 0:
        raise ValueError(f"expected rings >= 0, got {rings}")
    if outside not in OUTSIDE:
        raise ValueError(f"expected outside to be one of {OUTSIDE}, got {outside!r}")
    scalars = {
        "threshold": threshold,
        "diffuse_threshold": diffuse_threshold,
        "exposure": exposure,
        "leave": leave,
    }
    scalars = {name: checked_scalar(name, value, dtype) for name, value in scalars.items()}
    reached = None if previous is None else checked_previous(previous, count)
    options = Filter(
        {"specular": scalars["threshold"], "diffuse": scalars["diffuse_threshold"]},
        scalars["exposure"],
        scalars["leave"],
        base,
        rings,
        smoothing,
        outside,
        distant,
        normalized,
    )
    return light, transfer, eye, material, options, reached


def checked_frame(light, transfer, eye, material):
    count, dtype = transfer.num_points, transfer.dtype
    light = checked_light(light, count, transfer.degree, dtype)
    if light.ndim > 2:
        raise ValueError(f"expected one light (3, K) for all vertices, got shape {light.shape}")
    if degree_of(light.shape[-1]) < 2:
        raise ValueError(f"expected a light of degree 2 or above, got {degree_of(light.shape[-1])}")
    return light, transfer, checked_eye(eye, dtype), checked_material(material, count, dtype)


def checked_scalar(name, value, dtype):
    value = as_float(value)
    if value.ndim:
        raise ValueError(f"expected {name} as a number, got shape {value.shape}")
    if is_concrete(value) and not np.asarray(value) >= 0:
        raise ValueError(f"{name} must be >= 0, got {value}")
    return value.astype(dtype)


def checked_previous(previous, count):
    reached = previous.reached
    if {"diffuse", "specular"} - set(reached) or any(len(one) != count for one in reached.values()):
        raise ValueError(f"expected previous as a result of this method for {count} vertices")
    return {name: jnp.asarray(one) for name, one in reached.items()}
