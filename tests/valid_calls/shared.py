"""What a call is, and the arguments that many of them have."""

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from jaxsh import geometry, midrange, transfer

RNG = np.random.default_rng(14)
V, K = 6, 9


class Call(NamedTuple):
    """A function and valid arguments by name, in its order."""

    function: Callable[..., Any]
    arguments: dict[str, Any]
    # Arguments that must be finite, where they are at hand.
    finite: frozenset[str] = frozenset()
    # Runs in NumPy, reads files, or looks at values: cannot be traced.
    host: bool = False
    # Arguments that take much: a path, a name, a string or a number.
    free: frozenset[str] = frozenset()
    # Only what is refused at once is tried.
    slow: bool = False


def floats(*shape: int):
    return RNG.uniform(0.2, 1.0, size=shape)


def of(function, *, finite: str = "", free: str = "path", host=False, slow=False, **arguments):
    """A `Call`; names are in one string, separated by spaces."""
    names = frozenset(finite.split()), frozenset(free.split())
    return Call(function, arguments, names[0], host or slow, names[1], slow)


@functools.cache
def made():
    """A transfer of degree 2."""
    normals = RNG.normal(size=(V, 3))
    return transfer.unshadowed(jnp.asarray(normals), jnp.asarray(normals), 2)


@functools.cache
def knot():
    return geometry.knot(300)


def eye():
    return np.array([0.0, -3.0, 1.0])


def material():
    return transfer.Material(floats(V, 3), 0.5, 8.0)


def lamp():
    corners = [[0.0, 0.0, 1.0], [0.0, 3.0, 1.0], [2.0, 3.0, 1.0], [2.0, 0.0, 1.0]]
    return midrange.Polygon(np.array(corners), np.ones(3))
