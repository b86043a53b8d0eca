"""Products of matrices, in one of two precisions: the only place that states one.

Accelerators multiply float32 matrices in fewer bits by default: TF32 on NVIDIA's, bfloat16 on TPUs.
That would cost projections, fits and rotations three of their digits. So everything is multiplied
in full, but for shading where the user sets JAX's own switch, `jax.default_matmul_precision`. It
is part of the key by which `jax.jit` finds compiled code. `docs/devices.md` says what it costs.
"""

import functools
import math
from collections.abc import Callable
from typing import ParamSpec, TypeVar

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

_FULL = jax.lax.Precision.HIGHEST
_FEW = 5

_P = ParamSpec("_P")
_T = TypeVar("_T")


def in_full(function: Callable[_P, _T]) -> Callable[_P, _T]:
    """Decorates what prepares, projects or fits, to multiply in full whatever the switch says.

    For what shares its kernels with shading, and for the products inside other libraries' solvers.
    """

    @functools.wraps(function)
    def exact(*args: _P.args, **kwargs: _P.kwargs) -> _T:
        with jax.default_matmul_precision("highest"):
            return function(*args, **kwargs)

    return exact


def matmul(a: ArrayLike, b: ArrayLike) -> Array:
    return jnp.matmul(a, b, precision=_FULL)


def dot(a: ArrayLike, b: ArrayLike) -> Array:
    return jnp.dot(a, b, precision=_FULL)


def einsum(subscripts: str, *operands: ArrayLike) -> Array:
    return jnp.einsum(subscripts, *operands, precision=_FULL)


def tensordot(a: ArrayLike, b: ArrayLike) -> Array:
    """Sums over the last axis of `a` and the first one of `b`."""
    return jnp.tensordot(a, b, 1, precision=_FULL)


def triangle(tall: Float[Array, "v p"]) -> Float[Array, "r p"]:
    """R of tall = QR, which has the singular values and right singular vectors of `tall`.

    On a mesh each device makes its own of its rows, and one is made of these: no device then needs
    the rows of another.
    """
    devices = math.prod(jax.typeof(tall).sharding.mesh.axis_sizes)
    if devices > 1:
        rows = jnp.pad(tall, ((0, -len(tall) % devices), (0, 0)))
        parts = rows.reshape(devices, -1, tall.shape[1])
        tall = jnp.linalg.qr(parts, mode="r").reshape(-1, tall.shape[1])
    return jnp.linalg.qr(tall, mode="r")


def shading_matmul(a: ArrayLike, b: ArrayLike) -> Array:
    """a @ b of what is shown, in the precision that the user has chosen."""
    return jnp.matmul(a, b, precision=_chosen(a, b))


def shading_tensordot(a: ArrayLike, b: ArrayLike) -> Array:
    """`tensordot` of what is shown, in the precision that the user has chosen."""
    return jnp.tensordot(a, b, 1, precision=_chosen(a, b))


def shading_tall_product(
    tall: Float[Array, "v k"], rows: Float[Array, "n k"]
) -> Float[Array, "v n"]:
    """tall @ rowsᵀ of what is shown."""

    def plain(tall, rows):
        return shading_matmul(tall, rows.T)

    # XLA's CPU kernel is faster with whole eights of rows, but for a few, as of one light. A GPU
    # would write them all, and read them again.
    def filled(tall, rows):
        return plain(tall, jnp.pad(rows, ((0, missing), (0, 0))))[:, : len(rows)]

    missing = -len(rows) % 8
    if not missing or len(rows) < _FEW:
        return plain(tall, rows)
    return jax.lax.platform_dependent(tall, rows, cpu=filled, default=plain)


def _chosen(a: ArrayLike, b: ArrayLike) -> jax.lax.Precision | None:
    # The switch is for 32 bits: some of its values are refused for others, or would round them.
    switch = jax.config.jax_default_matmul_precision  # pyright: ignore[reportAttributeAccessIssue]
    wide = jnp.result_type(a, b).itemsize > 4
    return _FULL if switch is None or wide else None  # None: as the switch says
