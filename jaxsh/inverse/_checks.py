"""Checks of a fit's data before it starts, and of how it ended."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import (
    as_float,
    check_cosine,
    check_flag,
    check_number,
    check_size,
    check_type,
    described,
)
from .._core.known import is_concrete
from ..transfer import Transfer
from ..transfer._glossy_kernels import checked_albedo
from ._result import Recovered


def check_data(
    observed: Float[ArrayLike, "..."],
    transfer: Transfer,
    albedo: Float[ArrayLike, "..."],
    weights: Float[ArrayLike, "..."] | None,
) -> tuple[Float[Array, "v 3"], Float[Array, "..."], Float[Array, " v"]]:
    """Converts observed, albedo and weights to the transfer's dtype.

    Without weights they are one, and zero at a point that has neither coefficients nor a normal:
    with such ones a transfer is filled up for several devices.

    Raises `ValueError` for shapes that do not fit, and, where values are known, for data that
    are not finite, all zero, or weighted by less than 0.
    """
    check_type("transfer", transfer, Transfer)
    check_cosine(transfer)
    dtype, count = transfer.coefficients.dtype, len(transfer.coefficients)
    observed = as_float(observed, "observed").astype(dtype)
    albedo = as_float(checked_albedo(albedo, count, dtype), "albedo")
    if weights is None:
        weight = _where_there_is_one(transfer.coefficients, transfer.normals)
    else:
        weight = as_float(weights, "weights").astype(dtype)
    _check_shapes(observed, weight, count)
    _check_values(observed, weight)
    return observed, albedo, weight


@jax.jit
def _where_there_is_one(coefficients, normals) -> Array:
    sees = jnp.any(coefficients != 0, axis=-1)
    return (sees | jnp.any(normals != 0, axis=-1)).astype(coefficients.dtype)


def check_solver(tolerance: float | None, max_steps: int, throw: bool) -> None:
    """Raises `ValueError` for options of a solver that are out of range."""
    if tolerance is not None:
        check_number("tolerance", tolerance, above=0.0)
    check_size("max_steps", max_steps)
    check_flag("throw", throw)


def check_bounds(name: str, bounds: tuple[float, float]) -> tuple[float, float]:
    """The bounds as Python numbers; raises unless they are 0 < low < high."""
    check_type(name, bounds, tuple, list)
    if len(bounds) != 2:
        raise ValueError(f"{name} must be bounds (low, high), got {described(bounds)}")
    low, high = (check_number(f"a bound of {name}", bound, above=0.0) for bound in bounds)
    if not low < high:
        raise ValueError(f"{name} must be bounds 0 < low < high, got {bounds}")
    return low, high


def check_end(recovered: Recovered, what: str, *, throw: bool) -> None:
    """Raises `RuntimeError` where a fit of `what` has not converged, if it may and can."""
    statistics = recovered.statistics
    if throw and is_concrete(statistics.steps) and not recovered.converged:
        raise RuntimeError(
            f"{what} not found in {int(statistics.steps)} steps from {statistics.starts} starts, "
            f"residual {float(statistics.residual):.1e}: {recovered.message} throw=False gives "
            "the best that was met"
        )


def _check_shapes(observed: Array, weights: Array, count: int) -> None:
    if observed.shape != (count, 3):
        raise ValueError(f"expected observed ({count}, 3), got shape {observed.shape}")
    if weights.shape != (count,):
        raise ValueError(f"expected weights ({count},), got shape {weights.shape}")


def _check_values(observed: Array, weights: Array) -> None:
    if not (is_concrete(observed) and is_concrete(weights)):
        return
    numbers, trust = np.asarray(observed), np.asarray(weights)
    if not (np.isfinite(trust) & (trust >= 0)).all():
        raise ValueError("weights must be finite and at least 0")
    bad = int((~np.isfinite(numbers[trust > 0])).sum())
    if bad:
        raise ValueError(f"{bad} numbers of observed are NaN or infinite: give them weight 0")
    if not np.any(numbers[trust > 0]):
        raise ValueError("observed is zero wherever it has a weight: there is no light to recover")
