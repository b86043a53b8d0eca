"""Directions to sum over: exact for products of light, transfer and lobe."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from .._core.host import read_only_cache
from ..harmonics import legendre, orders
from ..harmonics._tables import exact_grid

# Algebraic degrees for which Lebedev's rules are known.
_LEBEDEV = (*range(3, 33, 2), *range(35, 132, 6))
# Nodes of a pass on the CPU: their values for 50,000 vertices stay in the last cache.
_PASS = 35


class Nodes(NamedTuple):
    """Holds N directions, the basis there and its weighted transpose, in float64 on the host."""

    directions: Float[np.ndarray, "n 3"]
    basis: Float[np.ndarray, "n k"]
    project: Float[np.ndarray, "k n"]


@read_only_cache(maxsize=16)
def product_nodes(degree: int) -> Nodes:
    """Returns directions and weights exact for any product of three functions of this degree.

    Lebedev's rules need a third fewer nodes than Gauss and Legendre's: 350 instead of 496 at
    degree 10, for K = 121 coefficients.
    """
    from scipy.integrate import lebedev_rule

    order = next((order for order in _LEBEDEV if order >= 3 * degree), None)
    if order is None:
        grid = exact_grid(3 * degree, degree)
        return Nodes(grid.directions, grid.basis.T, grid.basis * grid.weights)
    directions, weights = lebedev_rule(order)
    x, y, z = directions
    m, phi = orders(degree)[:, None], np.arctan2(y, x)
    azimuth = np.where(m < 0, np.sin(-m * phi), np.cos(m * phi))
    basis = legendre(np.clip(z, -1, 1), degree) * azimuth
    return Nodes(directions.T, basis.T, basis * weights)


class NodePasses(NamedTuple):
    """Holds nodes in P passes of N, the last one filled up with directions of no weight."""

    directions: Float[np.ndarray, "p n 3"]
    basis: Float[np.ndarray, "p n k"]
    project: Float[np.ndarray, "p k n"]


@read_only_cache(maxsize=16)
def node_passes(degree: int) -> NodePasses:
    """Cuts `product_nodes` into passes of some tens."""
    nodes = product_nodes(degree)
    passes = -(-len(nodes.directions) // _PASS)
    size = -(-len(nodes.directions) // passes)
    spare = passes * size - len(nodes.directions)
    directions = np.pad(nodes.directions, ((0, spare), (0, 0)), mode="edge")
    basis = np.pad(nodes.basis, ((0, spare), (0, 0)), mode="edge")
    project = np.pad(nodes.project, ((0, 0), (0, spare)))
    return NodePasses(
        directions.reshape(passes, size, 3),
        basis.reshape(passes, size, -1),
        np.moveaxis(project.reshape(-1, passes, size), 0, 1),
    )
