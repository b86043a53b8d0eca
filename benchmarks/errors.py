"""Errors of the basis in float32 beside those of the peers."""

from collections.abc import Iterator
from typing import Any

import jax
import numpy as np

from experiments.runner import Column
from jaxsh import harmonics

from ._sections import Cores, Section

DEGREES = 6, 10, 13, 20, 30


def timings(cores: Cores, rounds: int, dtype: str) -> Iterator[dict[str, Any]]:
    """One row for each degree."""
    return map(_errors, DEGREES)


def _errors(degree: int) -> dict[str, Any]:
    """Largest float32 error over directions all around, dense near the poles, and along the axes,
    against SciPy in float64."""
    from . import _peers

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


SECTION = Section(
    name="errors",
    title="Largest float32 error of the basis",
    intro="Over directions all around, dense near the poles, and along the axes, against SciPy in "
    "float64.",
    columns=[Column(name, name) for name in ("degree", "ours", "sphericart", "e3nn")],
    timings=timings,
    cores=("all",),
    peers=("sphericart-jax", "e3nn-jax", "scipy"),
)
