"""The 48 placements of axes: permutations of x, y, z with signs, and what they do to a basis."""

import itertools

import numpy as np
from jaxtyping import Float

from .._core.host import read_only_cache
from ..harmonics import legendre, orders
from ..harmonics._turns import axes_blocks


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


def values(directions: Float[np.ndarray, "*n 3"], degree: int) -> Float[np.ndarray, "*n k"]:
    """The basis at unit directions, by NumPy in float64: nothing to compile."""
    x, y, z = np.moveaxis(directions, -1, 0)
    phi, m = np.arctan2(y, x)[..., None], orders(degree)
    azimuth = np.where(m < 0, np.sin(-m * phi), np.cos(m * phi))
    return np.moveaxis(legendre(z.ravel(), degree), 0, -1).reshape(*z.shape, -1) * azimuth
