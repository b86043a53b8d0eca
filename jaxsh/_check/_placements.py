"""The 48 placements of axes: permutations of x, y, z with signs, and what they do to a basis."""

import itertools

import numpy as np
from jaxtyping import Float

from .._core.host import read_only_cache
from ..harmonics import legendre, orders
from ..harmonics._turns import axes_blocks

_NAMES = "xyz"


@read_only_cache(maxsize=1)
def placements() -> Float[np.ndarray, "48 3 3"]:
    """All A that place axes upon axes: another's (x, y, z) is A times ours; the identity first."""
    found = [
        np.eye(3)[list(order)] * np.array(signs)[:, None]
        for order in itertools.permutations(range(3))
        for signs in itertools.product((1.0, -1.0), repeat=3)
    ]
    return np.stack(found)


@read_only_cache(maxsize=16)
def turned(degree: int) -> Float[np.ndarray, "48 k k"]:
    """T of each placement A, so that u = T c are the coefficients in the other's axes."""
    found = np.zeros((48, (degree + 1) ** 2, (degree + 1) ** 2))
    for matrix, placement in zip(found, placements(), strict=True):
        turn = tuple(map(tuple, placement.astype(int).tolist()))
        for l, block in enumerate(axes_blocks(turn, degree)):
            matrix[l * l : (l + 1) ** 2, l * l : (l + 1) ** 2] = block
    return found


@read_only_cache(maxsize=16)
def grid(degree: int) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]]:
    """Directions and weights, in float64, exact for products of two functions of this degree."""
    z, rows = np.polynomial.legendre.leggauss(degree + 1)
    phi = 2 * np.pi * (np.arange(2 * degree + 1) + 0.25) / (2 * degree + 1)
    r = np.sqrt(1 - z**2)[:, None]
    x, y = r * np.cos(phi), r * np.sin(phi)
    directions = np.stack([x, y, np.broadcast_to(z[:, None], x.shape)], axis=-1).reshape(-1, 3)
    return directions, np.repeat(rows, len(phi)) * 2 * np.pi / len(phi)


def values(directions: Float[np.ndarray, "*n 3"], degree: int) -> Float[np.ndarray, "*n k"]:
    """The basis at unit directions, by NumPy in float64: nothing to compile."""
    x, y, z = np.moveaxis(directions, -1, 0)
    phi, m = np.arctan2(y, x)[..., None], orders(degree)
    azimuth = np.where(m < 0, np.sin(-m * phi), np.cos(m * phi))
    return np.moveaxis(legendre(z.ravel(), degree), 0, -1).reshape(*z.shape, -1) * azimuth


def said(placement: np.ndarray) -> str:
    """A placement in words: which of its axes is up, its handedness, its axes in ours."""
    up = int(np.flatnonzero(placement[:, 2])[0])
    sign = "" if placement[up, 2] > 0 else "−"
    axes = ", ".join(_axis(row) for row in placement)
    mirrored = ", left-handed" if np.linalg.det(placement) < 0 else ""
    return f"{sign}{_NAMES[up]} up{mirrored} (its x, y, z are our {axes})"


def _axis(row: np.ndarray) -> str:
    place = int(np.flatnonzero(row)[0])
    return ("" if row[place] > 0 else "−") + _NAMES[place]
