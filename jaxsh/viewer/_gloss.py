"""Gloss: what the page needs to shade as `transfer.shade_glossy` does."""

from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float

from ..harmonics import phong
from ..transfer import Material
from ..transfer._glossy_kernels import lobe_polynomial, product_nodes

# What the menu offers besides the material's own; beyond that a lobe of degree 10 hardly changes.
_EXPONENTS = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0)
_MOST_BYTES = 512 << 20  # of graphics memory


def split_material(albedo: Any) -> tuple[Float[ArrayLike, "..."], Material | None]:
    """Split off the diffuse albedo.

    Raises `ValueError` for gloss that differs by vertex, and for a roughness.
    """
    if not isinstance(albedo, Material):
        return albedo, None
    if albedo.exponent is None:
        raise ValueError(
            "expected a material with an exponent, got a roughness: the page takes the same lobe "
            "at every vertex, but GGX's changes with the angle of view"
        )
    if albedo.specular.ndim > 1 or albedo.exponent.ndim:
        raise ValueError(
            "expected a material with one specular albedo, a number or (3,), and one exponent, got "
            f"shapes {albedo.specular.shape} and {albedo.exponent.shape}"
        )
    return albedo.diffuse, albedo


def gloss_facts(material: Material, degree: int, count: int) -> dict[str, Any]:
    """List directions, their weights, and the lobe's polynomials, for the header.

    Raises `ValueError` where the transfer at the directions would fill a graphics processor.
    """
    nodes = product_nodes(degree)
    if (size := 4 * count * len(nodes.directions)) > _MOST_BYTES:
        raise ValueError(
            f"expected at most {_MOST_BYTES >> 20} MiB for gloss of degree {degree}, but {count} "
            f"points take {size >> 20} MiB; cut the light to a lower degree"
        )
    assert material.exponent is not None  # `split_material` has said so
    own = float(material.exponent)
    exponents = sorted({*_EXPONENTS, own})
    zonal = phong(jnp.asarray(exponents, jnp.result_type(float)), degree, normalized=True)
    lobes = lobe_polynomial(zonal)
    weights = nodes.project[0] / nodes.basis[:, 0]
    return {
        "specular": np.broadcast_to(np.asarray(material.specular, np.float64), 3).tolist(),
        "exponents": exponents,
        "first": exponents.index(own),
        "nodes": nodes.directions.tolist(),
        "weights": weights.tolist(),
        "lobes": np.asarray(lobes, np.float64).T.tolist(),
    }
