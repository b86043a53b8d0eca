"""What a call at full size is, and the arguments that many of them have: shapes without numbers."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxsh import transfer

V, DEGREE = 50_000, 10
K = (DEGREE + 1) ** 2


class Call(NamedTuple):
    """A function of arrays alone, at full size, and what loops it may have on an accelerator."""

    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    # Trips of nested loops, multiplied, and the number of loops that run until a value says so.
    # More than two trips, or any such loop, need a reason.
    trips: int = 2
    open: int = 0
    why: str = ""
    # Lowered with its derivative in reverse mode, by all floats among arguments and results.
    reverse: bool = True


def of(function, *arguments, trips=2, open=0, why="", reverse=True):
    """A `Call`; constants are bound in `function`, a `lambda` or a partial."""
    return Call(function, arguments, trips, open, why, reverse)


def floats(*shape: int):
    return jax.ShapeDtypeStruct(shape, jnp.float32)


def integers(*shape: int):
    return jax.ShapeDtypeStruct(shape, jnp.int32)


def booleans(*shape: int):
    return jax.ShapeDtypeStruct(shape, jnp.bool)


def shapes(tree):
    """The shapes of a tree of arrays: of what is the same at full size, made in float32."""

    def shape(leaf):
        if not isinstance(leaf, jax.Array | np.ndarray):
            return leaf
        return jax.ShapeDtypeStruct(leaf.shape, narrow(leaf.dtype))

    return jax.tree.map(shape, tree)


def narrow(dtype):
    return jnp.dtype(jnp.float32) if jnp.issubdtype(dtype, jnp.floating) else dtype


def made_by(function, *arguments):
    """The shapes of what a function makes of shapes."""
    return jax.eval_shape(function, *arguments)


def baked(vertices: int = V, degree: int = DEGREE) -> transfer.Transfer:
    """A transfer of full size."""
    make = transfer.Transfer
    width = (degree + 1) ** 2
    points = floats(vertices, 3)
    return made_by(make, floats(vertices, width), points, points, integers(vertices, 16))


def material(vertices: int = V) -> transfer.Material:
    """A color for each vertex, one lobe for all."""
    return made_by(transfer.Material, floats(vertices, 3), floats(), floats())
