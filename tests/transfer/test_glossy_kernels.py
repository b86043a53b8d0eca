"""The nodes of products of three functions, and the lobe as a polynomial of the cosine."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxsh import harmonics
from jaxsh.transfer._glossy_kernels import lobe, lobe_polynomial, product_nodes


@pytest.mark.parametrize("degree", [0, 1, 2, 10, 14])
def test_nodes_integrate_products_of_three(rng, degree):
    """Against the coefficients of the product of two, by another grid; 14 asks for order 42."""
    nodes = product_nodes(degree)
    f, g, h = rng.normal(size=(3, (degree + 1) ** 2))
    weights = nodes.project[0] * np.sqrt(4 * np.pi)
    got = np.sum(weights * np.prod([nodes.basis @ one for one in (f, g, h)], axis=0))
    exact = harmonics.triple_integral(f, g, h)
    np.testing.assert_allclose(got, exact, rtol=1e-11, atol=1e-11)
    assert weights.sum() == pytest.approx(4 * np.pi)
    np.testing.assert_allclose(
        nodes.basis, harmonics.evaluate(nodes.directions, degree), rtol=0, atol=1e-13
    )


@pytest.mark.slow
def test_beyond_lebedev_s_rules_there_is_another():
    nodes = product_nodes(44)
    gram = nodes.project @ nodes.basis
    np.testing.assert_allclose(gram, np.eye(len(gram)), rtol=0, atol=1e-11)


@pytest.mark.parametrize(("dtype", "tolerance"), [(np.float32, 6e-6), (np.float64, 2e-14)])
@pytest.mark.parametrize("degree", [0, 20])
def test_the_lobe_s_polynomial(dtype, tolerance, degree):
    exponents, t = np.array([1.0, 32.0, 1000.0]), np.linspace(-1, 1, 1001)
    norms = np.sqrt((2 * np.arange(degree + 1) + 1) / (4 * np.pi))
    zonal = np.asarray(harmonics.phong(exponents, degree)) * norms
    exact = np.polynomial.legendre.legval(t, zonal.T)
    polynomial = lobe_polynomial(harmonics.phong(jnp.asarray(exponents, dtype), degree))
    got = lobe(jnp.asarray(t, dtype)[None], polynomial[..., None])
    for one, own in zip(np.broadcast_to(got, exact.shape), exact, strict=True):
        np.testing.assert_allclose(one, own, rtol=0, atol=tolerance * np.abs(own).max())
