"""The products of matrices in a program, and how they are multiplied."""

from collections.abc import Iterator

import jax
import jax.numpy as jnp
from jax.extend import core

FULL = jax.lax.Precision.HIGHEST


def precisions(program: core.Jaxpr) -> Iterator[object]:
    """The precision of each product of matrices, on all platforms."""
    for equation in program.eqns:
        precision = equation.params.get("precision")
        if equation.primitive is core.primitives.dot_general_p and is_inexact(equation.outvars[0]):
            yield precision[0] if isinstance(precision, tuple) else precision
        for inner in jax.tree.leaves(tuple(equation.params.values()), is_leaf=is_program):
            if is_program(inner):
                yield from precisions(getattr(inner, "jaxpr", inner))


def is_inexact(value) -> bool:
    return jnp.issubdtype(value.aval.dtype, jnp.inexact)


def is_program(value) -> bool:
    return isinstance(value, core.Jaxpr | core.ClosedJaxpr)
