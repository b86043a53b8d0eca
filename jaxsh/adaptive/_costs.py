"""Multiply-adds per vertex, relative to those with the light's whole product matrix.

Of RGB light of K coefficients: 3K² for the glossy and 3K for the diffuse part.
"""

from ..harmonics import num_coefficients
from ..transfer._glossy_kernels import product_nodes


def product_cost(kind: str, start: int, end: int, target: int) -> float:
    """Of the glossy or the diffuse products from one degree to another; `start` 0 is nothing."""
    power = {"specular": 2, "diffuse": 1}[kind]
    before = num_coefficients(start) ** power if start else 0
    return 3 * (num_coefficients(end) ** power - before) / full_cost(target)


def sum_cost(degree: int, target: int, nodes: int | None = None, terms: int | None = None) -> float:
    """Of a sum over nodes of light, transfer and lobe at a degree, as `shade_glossy` does it.

    At each of `nodes`, or of as many as are exact, 3 for the cosine, one for each of the lobe's
    `terms`, or bands, one for the product and 3 for RGB. The diffuse part is counted apart.
    """
    nodes = len(product_nodes(degree).directions) if nodes is None else nodes
    terms = degree + 1 if terms is None else terms
    return nodes * (7 + terms) / full_cost(target)


def full_cost(degree: int) -> float:
    width = num_coefficients(degree)
    return 3.0 * width * (width + 1)
