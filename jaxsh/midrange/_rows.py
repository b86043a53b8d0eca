"""Vectors as three arrays x, y and z, of any shape: for long arrays on the CPU the fastest."""

from jaxtyping import Array

Rows = tuple[Array, Array, Array]


def dot(a: Rows, b: Rows) -> Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
