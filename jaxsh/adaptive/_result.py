"""Results of the adaptive methods, and the count of multiply-adds that they report."""

import equinox as eqx
from jaxtyping import Array, Float, Int

from ..harmonics import num_coefficients
from ..transfer._glossy_kernels import product_nodes


class AdaptiveResult(eqx.Module):
    """Holds the colors of V vertices, and what they took.

    - `color`: radiance that leaves each vertex, diffuse and specular.
    - `active_fraction`: by name, shares of the vertices, in [0, 1]. The filtering methods give
      "specular" and "diffuse", one share per level that was decided on; others name their own.
    - `relative_cost`: multiply-adds per vertex, relative to the 3K² + 3K of the product matrix and
      the light. `transfer.shade_glossy` itself takes far less than one, since it sums over
      directions.
    - `shown_degree`: by name as in `active_fraction`, the degree that each vertex was computed to;
      empty where a method has no degrees. Given back as `previous`, the next frame remembers it.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import adaptive, sphere, transfer
    >>> points = sphere.fibonacci(50).directions
    >>> made = transfer.unshadowed(points, points, degree=2)
    >>> frame = jnp.ones((3, 9)), made, jnp.asarray([0.0, -3.0, 0.0]), transfer.Material(1, 0, 8)
    >>> result = adaptive.shade(*frame, adaptive.TwoStage(base=1, threshold=0.0))
    >>> result.color.shape, float(result.active_fraction["specular"])
    ((50, 3), 1.0)
    """

    color: Float[Array, "v 3"]
    active_fraction: dict[str, Float[Array, "..."]]
    relative_cost: Float[Array, ""]
    shown_degree: dict[str, Int[Array, " v"]] = eqx.field(default_factory=dict)


def product_cost(kind: str, start: int, end: int, target: int) -> float:
    """Counts multiply-adds of a product from one degree to another, relative to the full cost.

    `kind` is "specular" or "diffuse"; `start` 0 is nothing.
    """
    power = {"specular": 2, "diffuse": 1}[kind]
    before = num_coefficients(start) ** power if start else 0
    return 3 * (num_coefficients(end) ** power - before) / full_cost(target)


def sum_cost(degree: int, target: int, nodes: int | None = None, terms: int | None = None) -> float:
    """Counts multiply-adds of a sum over nodes of light, transfer and lobe at a degree.

    At each of `nodes`, or of as many as are exact, 3 for the cosine, one for each of the lobe's
    `terms`, or bands, one for the product and 3 for RGB. The diffuse part is counted apart.
    """
    nodes = len(product_nodes(degree).directions) if nodes is None else nodes
    terms = degree + 1 if terms is None else terms
    return nodes * (7 + terms) / full_cost(target)


def full_cost(degree: int) -> float:
    """Counts multiply-adds per vertex with the light's whole product matrix, 3K² + 3K for RGB."""
    width = num_coefficients(degree)
    return 3.0 * width * (width + 1)
