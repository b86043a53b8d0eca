"""Transfer as values in directions: the form in which glossy shading is fast."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._core.checks import check_degree
from .._core.linalg import matmul
from ._lobe import rows_of
from ._nodes import node_passes
from ._transfer import Transfer


class SampledTransfer(eqx.Module):
    """Transfer of V vertices, cut to a degree, at N directions: made once by `sample`.

    The directions are an exact quadrature for products of three functions of that degree, so
    that nothing is lost. `samples` are in the passes in which shading goes through them. At degree
    10 there are 350 directions; with the coefficients beside them, that is four times the memory
    of the transfer.
    """

    samples: Float[Array, "passes n v"]
    coefficients: Float[Array, "v k"]
    positions: Float[Array, "3 v"]
    normals: Float[Array, "3 v"]  # at unit length
    degree: int = eqx.field(static=True)


def sample(transfer: Transfer, degree: int | None = None) -> SampledTransfer:
    """The transfer, cut to `degree` (default: all of it), ready for frame after frame.

    `shade_glossy` does this on the way where it is given coefficients. Linear and differentiable.
    Raises `ValueError` for a degree that the transfer does not have.
    """
    degree = transfer.degree if degree is None else check_degree(degree)
    if degree > transfer.degree:
        raise ValueError(
            f"expected a degree of at most the transfer's, {transfer.degree}, got {degree}"
        )
    return _sample(transfer, degree)


@functools.partial(jax.jit, static_argnums=1)
def _sample(transfer, degree):
    coefficients = transfer.coefficients[:, : (degree + 1) ** 2]
    basis = jnp.asarray(node_passes(degree).basis, coefficients.dtype)
    values = matmul(basis.reshape(-1, basis.shape[2]), coefficients.T)
    samples = values.reshape(*basis.shape[:2], -1)
    positions, normals = rows_of(transfer.positions, transfer.normals)
    return SampledTransfer(samples, coefficients, positions, normals, degree)
