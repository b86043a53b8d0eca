"""What a device can do at most: its memory and its matrix units, measured, beside the vendor's."""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

# Bytes and operations per second, dense, of NVIDIA's data sheets: H200 (2024), H100 SXM (2023)
# and A100 80 GB SXM (2021).
VENDOR = {
    "H200": {"bandwidth": 4.8e12, "float32": 67e12, "tf32": 494.7e12},
    "H100": {"bandwidth": 3.35e12, "float32": 67e12, "tf32": 494.7e12},
    "A100": {"bandwidth": 2.039e12, "float32": 19.5e12, "tf32": 156e12},
}


class Probe(NamedTuple):
    """One limit: what is run, on what, and how many bytes or operations that is."""

    unit: str
    amount: float
    function: Callable[..., Any]
    arguments: tuple


def probes(count: int, side: int) -> Iterator[tuple[str, Probe]]:
    """Copy, read and write `count` numbers; multiply two square matrices, fully and in TF32."""
    numbers = jnp.ones(count, jnp.float32)
    bytes_of = 4.0 * count
    yield "copy", Probe("B/s", 2 * bytes_of, lambda x: x + 1, (numbers,))
    yield "read", Probe("B/s", bytes_of, jnp.sum, (numbers,))
    one = jnp.float32(1)
    yield "write", Probe("B/s", bytes_of, lambda x: jnp.broadcast_to(x, (count,)) + 1, (one,))
    square = jnp.ones((side, side), jnp.float32)
    operations = 2.0 * side**3
    for name, precision in (("float32", "highest"), ("tf32", "tensorfloat32")):
        yield name, Probe("FLOP/s", operations, _product(precision), (square, square))
    yield "call", Probe("1/s", 1.0, lambda x: x + 1, (one,))


def _product(precision: str):
    def product(a, b):
        with jax.default_matmul_precision(precision):
            return jnp.matmul(a, b)

    return product


def vendor(kind: str) -> dict[str, float] | None:
    """The data sheet's figures of a device, where they are known."""
    return next((figures for name, figures in VENDOR.items() if name in kind), None)
