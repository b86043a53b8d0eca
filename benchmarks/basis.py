"""Values, gradients and reverse mode of the basis beside sphericart, e3nn and SciPy."""

import functools
from collections.abc import Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from experiments.shared.timing import interleaved, ratio
from jaxsh import harmonics

from . import _peers

# SciPy is measured where one call of it ends in a second or so, e3nn where it compiles in seconds.
_SCIPY_COUNT, _E3NN_COUNT = 10_000, 10_000


def timings(degree: int, count: int, dtype, rounds: int) -> Iterator[dict[str, Any]]:
    """One row per quantity. Ours is `axis=0`; peers have their own layout."""
    generator = np.random.default_rng(0)
    vectors = generator.normal(size=(count, 3))
    vectors = jnp.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True), dtype)
    cotangent = jnp.asarray(generator.normal(size=((degree + 1) ** 2, count)), dtype)
    ours = functools.partial(harmonics.evaluate, axis=0)

    values = {
        "ours": lambda v: ours(v, degree),
        "sphericart": lambda v: _peers.sphericart_values(v, degree),
        "solid": lambda v: _peers.sphericart_solid(v, degree),
        "floor": _writer((degree + 1) ** 2),
    }
    if count <= _E3NN_COUNT and dtype == np.float32:
        values["e3nn"] = lambda v: _peers.e3nn_values(v, degree)
    scipy = {}
    if count <= _SCIPY_COUNT and dtype == np.float64:
        host = np.asarray(vectors)
        scipy["scipy"] = lambda: _peers.scipy_values(host, degree)
    gradients = {
        "ours": lambda v: harmonics.evaluate_with_gradient(v, degree, axis=0),
        "sphericart": lambda v: _peers.sphericart_gradient(v, degree),
        "floor": _writer(4 * (degree + 1) ** 2),
    }
    reverse = {
        "ours": _peers.pullback(ours, degree, cotangent),
        "sphericart": _peers.pullback(_peers.sphericart_values, degree, cotangent.T),
        "floor": _writer((degree + 1) ** 2),
    }
    quantities = [("values", values), ("with gradient", gradients), ("reverse", reverse)]
    for quantity, functions in quantities:
        calls = {
            name: functools.partial(jax.jit(function), vectors)
            for name, function in functions.items()
        }
        times = interleaved(calls | (scipy if quantity == "values" else {}), rounds=rounds)
        row = {
            "quantity": quantity,
            "dtype": np.dtype(dtype).name,
            "degree": degree,
            "count": count,
            "ours_ms": times["ours"].median_ms,
            "compile_s": times["ours"].first_seconds,
            "over_floor": ratio(times["ours"], times["floor"]),
        }
        peers = ("sphericart", "solid", "e3nn", "scipy")
        yield row | {
            peer: ratio(times[peer], times["ours"]) if peer in times else None for peer in peers
        }


def errors(degree: int) -> dict[str, Any]:
    """Largest float32 error over directions all around, dense near the poles, and along the axes,
    against SciPy in float64."""
    generator = np.random.default_rng(1)
    around = generator.normal(size=(10_000, 3))
    polar = generator.normal(size=(10_000, 3))
    polar[:, :2] *= 10 ** generator.uniform(-3, 0, (10_000, 1))
    vectors = np.concatenate([around, polar, np.eye(3), -np.eye(3)])
    vectors = (vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)).astype(np.float32)
    exact = _peers.scipy_values(vectors, degree)
    rivals = {
        "ours": harmonics.evaluate,
        "sphericart": _peers.sphericart_values,
        "e3nn": _peers.e3nn_values,
    }
    row: dict[str, Any] = {"degree": degree}
    for name, values in rivals.items():
        result = np.asarray(jax.jit(values, static_argnums=1)(vectors, degree))
        row[name] = float(np.max(np.abs(result - exact)))
    return row


def _writer(rows: int):
    """The floor: write an output of this size once, with next to no arithmetic."""
    scale = np.linspace(0.5, 1.0, rows)[:, None]
    return lambda v: jnp.asarray(scale, v.dtype) * v[:, 0][None]
