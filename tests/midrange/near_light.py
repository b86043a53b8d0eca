"""A small light whose coefficients are differentiated by JAX, and a mesh's transfer for it."""

import functools
import itertools
from math import factorial, prod

import jax
import jax.numpy as jnp
import numpy as np

from jaxsh.harmonics import evaluate
from jaxsh.midrange import (
    Expansion,
)
from jaxsh.transfer import Transfer

_EMITTERS = np.array([[1.9, 0.3, 0.8], [-1.2, 1.6, 0.5], [0.1, -1.4, -1.7]])


def point_lights(position, degree):
    """(3, K): a red, a green and a blue emitter, c = y(s/|s|)/|s|²."""
    s = jnp.asarray(_EMITTERS, position.dtype) - position[None]
    return evaluate(s, degree) / jnp.sum(s * s, axis=-1, keepdims=True)


def expand(points, degree, order=1):
    """Expansions around points (n, 3), by nested forward derivatives."""
    points = jnp.asarray(points)
    return Expansion(points, _terms(points, degree, order))


@functools.partial(jax.jit, static_argnums=(1, 2))
def _terms(points, degree, order):
    derivatives = [lambda p: point_lights(p, degree)]
    for _ in range(order):
        derivatives.append(jax.jacfwd(derivatives[-1]))

    def terms(point):
        tensors = [d(point) for d in derivatives]
        columns = []
        for q, tensor in enumerate(tensors):
            for axes in itertools.combinations_with_replacement(range(3), q):
                repeated = prod(factorial(axes.count(axis)) for axis in range(3))
                columns.append(tensor[(..., *axes)] / repeated)
        return jnp.stack(columns, axis=-1)

    return jax.vmap(terms)(points)


def random_transfer(rng, count, degree, dtype=np.float64):
    """V vertices in the unit cube around the origin, with coefficients of any kind."""
    x = rng.uniform(-0.5, 0.5, (count, 3)).astype(dtype)
    coefficients = rng.normal(size=(count, (degree + 1) ** 2)).astype(dtype)
    table = jnp.zeros((count, 1), jnp.int32)
    return Transfer(jnp.asarray(coefficients), jnp.asarray(x), jnp.asarray(x), table)
