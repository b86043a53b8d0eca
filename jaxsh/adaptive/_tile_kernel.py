"""The inner product that tiles spend their time in."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


@jax.custom_jvp
def polynomial_products(
    terms: Float[Array, "blocks t c k"],
    columns: Float[Array, "blocks k b"],
    monomials: Float[Array, "blocks t b"],
) -> Float[Array, "blocks c b"]:
    """Σ_t φ_tv Σ_k M_tck X_kv for each vertex v of each block.

    XLA's CPU backend multiplies so many narrow matrices one after the other on one core, and each
    is copied first. With the sum over k written out the whole is one loop over vertices, which it
    vectorises and splits over the cores.
    """
    return jax.lax.platform_dependent(terms, columns, monomials, cpu=_apart, default=_as_matrices)


@polynomial_products.defjvp
def _polynomial_products_jvp(primals, tangents):
    # The written-out sum would be transposed term by term.
    _, change = jax.jvp(_as_matrices, primals, tangents)
    return polynomial_products(*primals), change


def _apart(terms, columns, monomials):
    # Never true, since φ_0 = b_c² is at most 1; but a branch that might be taken is a boundary, and
    # without one XLA computes the monomials anew for every use.
    never = monomials[0, 0, 0] > 2
    shape = (terms.shape[0], terms.shape[2], columns.shape[2])

    def zeros(*_):
        return jnp.zeros(shape, columns.dtype)

    return jax.lax.cond(never, zeros, _written_out, terms, columns, monomials)


def _written_out(terms, columns, monomials):
    sums = [jnp.zeros((), columns.dtype)] * terms.shape[1]
    for k in range(columns.shape[1]):
        column = columns[:, k, None]
        sums = [total + terms[:, t, :, k, None] * column for t, total in enumerate(sums)]
    return sum(monomials[:, t, None] * total for t, total in enumerate(sums))


def _as_matrices(terms, columns, monomials):
    products = jnp.einsum("ntck,nkb->ntcb", terms, columns, precision="highest")
    return jnp.sum(monomials[:, :, None] * products, axis=1)
