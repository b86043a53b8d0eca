"""The base of all methods: typed options, and the checks that they share."""

import abc
import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import as_float, check_cosine, check_options, check_type
from .._core.known import is_concrete
from ..harmonics import degree_of
from ..transfer import AbstractTransfer, Material, Transfer
from ..transfer._glossy_kernels import checked_eye, checked_material, checked_one_light
from ._result import AdaptiveResult
from ._sharing import inside_shard_map


class AbstractMethod(eqx.Module):
    """Shades V vertices with less work than `transfer.shade_glossy`; its fields are the options.

    The methods are `Masks`, `Levels`, `TwoStage`, `Anchors` and `Tiles`. `shade` calls them.

    **Example**

    >>> from jaxsh import adaptive
    >>> isinstance(adaptive.Levels(base=1), adaptive.AbstractMethod)
    True
    """

    def __new__(cls, *_, **options):
        # Python names the unknown option; this names the one that was meant, too.
        check_options(cls.__name__, options, [field.name for field in dataclasses.fields(cls)])
        return super().__new__(cls)

    @abc.abstractmethod
    def __call__(
        self,
        light: Float[ArrayLike, "3 k"],
        transfer: AbstractTransfer,
        eye: Float[ArrayLike, " 3"],
        material: Material,
    ) -> AdaptiveResult:
        """Shade a frame."""


def checked_frame(light, transfer: AbstractTransfer, eye, material: Material):
    """Casts light, eye and material to the transfer's dtype; one light of degree 2 or above."""
    check_type("transfer", transfer, AbstractTransfer)
    check_cosine(transfer)
    count, dtype = transfer.num_points, transfer.dtype
    light = checked_one_light(light, count, transfer.degree, dtype)
    if degree_of(light.shape[-1]) < 2:
        raise ValueError(f"expected a light of degree 2 or above, got {degree_of(light.shape[-1])}")
    return light, checked_eye(eye, dtype), checked_material(material, count, dtype)


def check_set(kind: str, num_points: int, degree: int, transfer: AbstractTransfer) -> None:
    """Raises `ValueError` unless a set is of as many vertices and of the degree of a transfer."""
    check_type("transfer", transfer, AbstractTransfer)
    if num_points != transfer.num_points or degree != transfer.degree:
        raise ValueError(
            f"expected {kind} of {transfer.num_points} vertices and degree {transfer.degree}, got "
            f"{num_points} and {degree}"
        )


def check_whole_degree(kind: str, light: Array, degree: int) -> None:
    """Raises `ValueError` unless a light is of a set's degree."""
    if degree_of(light.shape[-1]) != degree:
        raise ValueError(
            f"expected a light of the {kind}' degree, {degree}, got {degree_of(light.shape[-1])}"
        )


def check_one_lobe(material: Material, count: int) -> None:
    check_type("material", material, Material)
    name, lobe = material.lobe
    if lobe.ndim:
        raise ValueError(f"expected one {name}, got one for each of {count} vertices")


def one_exponent(material: Material, count: int) -> Float[Array, ""]:
    check_one_lobe(material, count)
    if material.exponent is None:
        raise ValueError(
            "expected a material with an exponent, got a roughness: tiles take the same lobe at "
            "every vertex, but GGX's changes with the angle of view; take transfer.shade_glossy, "
            "fixed_view, fixed_light or another method"
        )
    return material.exponent


def checked_scalar(name: str, value: ArrayLike) -> Float[Array, ""]:
    """Returns a number; raises `ValueError` for other shapes, and where it is known not to be >= 0.

    A Python number keeps no dtype of its own.
    """
    array = as_float(value, name)
    if array.ndim:
        raise ValueError(f"expected {name} as a number, got shape {array.shape}")
    if is_concrete(array) and not np.asarray(array) >= 0:
        raise ValueError(f"{name} must be >= 0, got {float(array):g}")
    return array


def plain_transfer(name: str, transfer: AbstractTransfer) -> Transfer:
    """Returns the coefficients that a method needs; raises `ValueError` where they are not held."""
    check_type("transfer", transfer, AbstractTransfer)
    plain = transfer.glossy_form(transfer.degree)
    if not isinstance(plain, Transfer):
        raise ValueError(
            f"method {name!r} needs the transfer's coefficients, got a {type(plain).__name__}"
        )
    return plain


def check_neighbors(name: str, transfer: Transfer) -> None:
    """Raises `ValueError` where there are no neighbors, or out of reach inside `shard_map`."""
    if transfer.surface != "vertices" and transfer.neighbors.shape[1] <= 1:
        raise ValueError(
            f"{name} with rings or smoothing looks at neighbors, which {transfer.surface} do not "
            "have: give rings=0 and smoothing=False, or a Transfer with a table of neighbors"
        )
    if inside_shard_map(transfer):
        raise ValueError(
            f"{name} with rings or smoothing looks at neighbors, which other devices may have: "
            "call it outside shard_map"
        )


def check_known(name: str, *trees) -> None:
    """Raises `ValueError` for arrays whose values are being traced."""
    if any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(trees)):
        raise ValueError(
            f"{name} looks at the values of its arguments and cannot be traced: call it before "
            "jit, vmap or grad, and give them the result"
        )


def scalars(dtype: jnp.dtype, **values: ArrayLike) -> dict[str, Float[Array, ""]]:
    """Casts checked numbers."""
    return {name: checked_scalar(name, value).astype(dtype) for name, value in values.items()}
