"""A basis, given as a function: its whole matrix over ours, and what that is."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ..harmonics import conventions, convert, degrees
from ..harmonics._tables import exact_grid
from ._decide import Case, cases, decide
from ._given import MOST, Light, Reading
from ._known import judge
from ._matching import constants, described, match
from ._space import Space, space
from ._verdict import Verdict
from ._words import factor, facts, percent

# Constants written with three digits are as far off.
_TOLERANCE = 4e-3
# Up to this degree functions are looked at one by one.
_MATCHED = 4


class Seen(NamedTuple):
    """A basis over ours: b_i = Σ_j matrix_ij y_j, and what is left of each function, relatively."""

    matrix: Float[np.ndarray, "k k"]
    beyond: Float[np.ndarray, " k"]
    notes: tuple[str, ...]


def check_basis(function: Callable) -> Verdict:
    """The verdict on a basis."""
    seen = _look(function)
    matrix, degree = seen.matrix, math.isqrt(len(seen.matrix)) - 1
    if degree == 0:
        return _constant(seen)
    table = space(degree, degree, basis=True)
    found = [_as_case(matrix, table)]
    decision = decide(found, table)
    tests, whole = _tests(seen)
    if decision.best.error <= _TOLERANCE and whole:
        verdict = judge(found, decision, table, strength=True, basis=True)
        return replace(verdict, notes=(*seen.notes, *tests, *verdict.notes))
    return _faulty(seen, found[0], table, tests)


def _constant(seen: Seen) -> Verdict:
    """The verdict on one function, which shows its constant and nothing else."""
    if seen.beyond[0] >= 0.02:
        return Verdict(decided=False, summary="one function, and no constant", notes=seen.notes)
    size = float(seen.matrix[0, 0])
    alike = []
    for name, known in conventions().items():
        if isinstance(known.order, str):
            plain = replace(known, layout="coefficients-last", quantity="radiance")
            scale = float(convert(np.ones(1), plain, "jaxsh")[0])
            if abs(size / scale - 1) <= _TOLERANCE:
                alike.append(name)
    return Verdict(
        decided=False,
        summary=f"one function, the constant {factor(size / math.sqrt(4 * math.pi))}",
        agree=tuple(alike),
        open=("axes, signs and orders show from degree 1 on",),
        notes=seen.notes,
    )


def _as_case(matrix: np.ndarray, table: Space) -> Case:
    """The basis as coefficients of K lights, each of one of our functions."""
    reading = Reading("coefficients-last", matrix.T, one_channel=True)
    return cases([reading], {len(matrix): [Light(np.eye(len(matrix)))]}, table)[0]


def _look(function: Callable) -> Seen:
    notes = []
    first = _called(function, exact_grid(0, 0).directions, notes)
    count = first.shape[1]
    if count == 0 or math.isqrt(count) ** 2 != count:
        raise ValueError(
            "expected the basis to give (..., K) values with K = (degree + 1)² = 1, 4, 9, 16, …, "
            f"got {count} for a direction"
        )
    degree = math.isqrt(count) - 1
    if degree > MOST:
        raise ValueError(f"expected a basis of degree {MOST} or less, got degree {degree}")
    # Exact for functions of up to four degrees above, of which it shows what is beyond.
    grid = exact_grid(2 * (degree + 4), degree)
    basis = _called(function, grid.directions, [])
    if not np.isfinite(basis).all():
        raise ValueError("expected finite values of the basis, got NaN or infinite ones")
    at_axes = np.concatenate([np.eye(3), -np.eye(3)])
    with np.errstate(all="ignore"):
        if not np.isfinite(_called(function, at_axes, [])).all():
            notes.append("it gives NaN or infinite values in the direction of an axis")
    matrix = (basis * grid.weights[:, None]).T @ grid.basis.T
    whole = grid.weights @ basis**2
    inside = np.sum(matrix**2, axis=1)
    beyond = np.sqrt(np.maximum(1 - inside / np.where(whole > 0, whole, 1), 0)) * (whole > 0)
    matrix[np.abs(matrix) < 1e-9 * np.abs(matrix).max()] = 0.0
    return Seen(matrix, np.where(beyond < 1e-6, 0.0, beyond), tuple(notes))


def _called(function: Callable, directions: np.ndarray, notes: list[str]) -> np.ndarray:
    """Values (N, K), whatever way the function takes directions and gives values."""
    count = len(directions)
    try:
        result = _real(function(directions.copy()))
        good = result.ndim == 2 and count in result.shape
    except (TypeError, ValueError, IndexError):
        good, result = False, directions
    if not good:
        result = np.stack([_real(function(one.copy())).ravel() for one in directions])
    elif result.shape[0] != count:
        notes.append("its values come as (K, N); (N, K) is expected")
        result = result.T
    return result


def _real(result) -> np.ndarray:
    """Values in float64; raises `ValueError` for complex ones and what is no array of numbers."""
    array = np.asarray(result)
    if array.dtype.kind not in "fiub" and not jnp.issubdtype(array.dtype, jnp.floating):
        raise ValueError(f"expected real values of the basis, got dtype {array.dtype}")
    return array.astype(np.float64)


def _tests(seen: Seen) -> tuple[list[str], bool]:
    """Orthonormality and invariance under rotation, in words, and whether the space is whole."""
    matrix, notes = seen.matrix, []
    sizes = np.linalg.norm(matrix, axis=1)
    unit = matrix / np.maximum(sizes, np.finfo(float).tiny)[:, None]
    gram = unit @ unit.T - np.eye(len(unit))
    far = np.unravel_index(int(np.abs(gram).argmax()), gram.shape)
    if np.abs(gram[far]) > 0.01 and sizes.min() > 0:
        first, second = sorted(map(int, far))
        notes.append(
            f"not orthogonal: functions {first} and {second} overlap by {gram[first, second]:.2g}"
        )
    elif np.ptp(sizes) > 0.01 * sizes.max():
        notes.append(
            f"orthogonal, not orthonormal: norms from {factor(sizes.min())} to "
            f"{factor(sizes.max())}"
        )
    singular = np.linalg.svd(unit, compute_uv=False)
    whole = bool(singular[-1] > 1e-3 and seen.beyond.max() < 0.02)
    if not whole:
        degree = math.isqrt(len(matrix)) - 1
        out = np.flatnonzero(seen.beyond >= 0.02)
        why = "its functions depend on each other"
        if sizes.min() == 0:
            why = f"function {int(sizes.argmin())} is zero"
        elif len(out):
            number = int(out[seen.beyond[out].argmax()])
            why = (
                f"function {number} is no polynomial of degree {degree}: "
                f"{percent(float(seen.beyond[number]))} of it is beyond"
            )
        notes.append(f"not a rotation-invariant space: {why}")
    return notes, whole


def _faulty(seen: Seen, case: Case, table: Space, tests: list[str]) -> Verdict:
    """Name the convention with the most functions in common, and what the others are."""
    light = np.eye(len(seen.matrix))
    if table.degree > _MATCHED:  # what breaks a rule does so in the first degrees
        count = (_MATCHED + 1) ** 2
        low, table = seen.matrix[:count, :count], space(_MATCHED, _MATCHED, basis=True)
        return _faulty(
            seen._replace(matrix=low),
            _as_case(low, table),
            table,
            [*tests, f"beyond degree {_MATCHED} functions were not looked at one by one"],
        )
    matched = match(seen.matrix.T, light, table, _TOLERANCE)
    convention = table.convention(matched.at, "coefficients-last")
    said = facts(convention, basis=True, gray=True)
    notes = (*seen.notes, *tests)
    right = int(matched.right.sum())
    if 2 * right <= len(matched.right):
        turned = _turned_otherwise(seen.matrix)
        return Verdict(
            decided=False,
            summary=turned or "no known convention: most of its functions are in none",
            faults=(),
            notes=notes,
        )
    faults = described(
        list(matched.faults), constants(convention.normalization, table.degree), table.degree
    )
    scale = 1.0 if abs(matched.scale - 1) <= _TOLERANCE else matched.scale
    return Verdict(
        decided=False,
        summary=f"{', '.join(said.values())}, but for {len(matched.right) - right} of "
        f"{len(matched.right)} functions",
        found=convention,
        scale=scale,
        residual=float(case.fits.error[matched.at]),
        faults=tuple(faults),
        notes=notes,
    )


def _turned_otherwise(matrix: Float[np.ndarray, "k k"]) -> str:
    """Says of a basis that is orthonormal in each degree that its axes lie askew."""
    l = degrees(math.isqrt(len(matrix)) - 1)
    if len(matrix) < 4 or np.abs(matrix[l[:, None] != l]).max() > 0.01 * np.abs(matrix).max():
        return ""
    gram = matrix @ matrix.T
    if np.abs(gram - gram[0, 0] * np.eye(len(gram))).max() > 0.01 * gram[0, 0]:
        return ""
    return (
        "orthonormal and invariant under rotation, but mixed within its degrees: in axes turned by "
        "no quarter turns, or a basis of its own"
    )
