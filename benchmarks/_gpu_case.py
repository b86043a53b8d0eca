"""What a case of `python -m benchmarks.gpu` is."""

from collections.abc import Callable
from typing import Any, NamedTuple

# What `jax.default_matmul_precision` is for each precision.
SWITCH = {"float32": None, "tf32": "tensorfloat32"}


class Case(NamedTuple):
    """A function to compile, its arguments, and what one call of it comes to.

    `traffic` are the bytes of arguments and results, read or written once; `operations` those of
    its matrix products, None where it has none to speak of: then XLA's count stands beside. `limit`
    names what it is measured against, `goal` the share of that to be reached on an H200.
    """

    name: str
    function: Callable[..., Any]
    arguments: tuple
    items: float
    unit: str
    traffic: float | None
    limit: str = "copy"
    operations: float | None = None
    goal: float | None = None
    precision: str = "float32"
    compiled: bool = True

    @property
    def switch(self) -> str | None:
        """The value of `jax.default_matmul_precision` that it runs under."""
        return SWITCH[self.precision]
