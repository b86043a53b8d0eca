"""The few quadrature directions of a tile, and the polynomials that take the lobe's place there."""

import numpy as np

from jaxsh import harmonics
from jaxsh.adaptive._local_rule import _poles, local_rule
from jaxsh.transfer._glossy_kernels import product_nodes


def test_a_local_rule_is_the_best_for_its_directions(rng):
    """No worse than least squares, on lights and lobes that least squares has not seen."""
    degree, exponent, count = 4, 16.0, 20
    rule = local_rule(degree, count, exponent)
    nodes = product_nodes(degree)
    lights = rng.normal(size=(4000, 25)) / np.sqrt(1 + harmonics.degrees(degree))
    poles = _poles(4000)
    np.testing.assert_allclose(np.arccos(poles[:, 2]).max(), 0.3, rtol=0, atol=1e-4)
    lobes = np.asarray(
        harmonics.convolve(
            harmonics.evaluate(rng.permutation(poles), degree), harmonics.phong(exponent, degree)
        )
    )

    def products(basis):
        return (basis @ lights.T) * (basis @ lobes.T)

    coefficients = nodes.project @ products(nodes.basis)
    values = products(np.asarray(harmonics.evaluate(rule.directions, degree)))
    seen, unseen = slice(0, 2000), slice(2000, 4000)
    fitted = np.linalg.lstsq(values[:, seen].T, coefficients[:, seen].T, rcond=None)[0]

    def error(rows):
        return np.sqrt(np.mean((rows.T @ values[:, unseen] - coefficients[:, unseen]) ** 2))

    size = np.sqrt(np.mean(coefficients[:, unseen] ** 2))
    assert error(rule.rows) < 1.02 * error(fitted)
    assert error(rule.rows) < 0.22 * size


def test_the_lobe_of_a_rule_is_the_lobe_down_to_its_lowest_cosine():
    degree, exponent = 10, 32.0
    rule = local_rule(degree, 40, exponent)
    assert len(rule.powers) == 7
    zonal = np.asarray(harmonics.phong(exponent, degree))
    lobe = zonal * np.sqrt((2 * np.arange(degree + 1) + 1) / (4 * np.pi))
    t = np.linspace(rule.lowest, 1, 50)
    exact = np.polynomial.legendre.legval(t, lobe)
    few = np.polynomial.polynomial.polyval(t - rule.middle, rule.powers @ zonal)
    np.testing.assert_allclose(few, exact, rtol=0, atol=0.005 * exact[-1])
    widest = -(np.arccos(rule.directions[:, 2]).max() + 0.15)
    np.testing.assert_allclose(rule.lowest, np.cos(widest), rtol=0, atol=1e-12)


def test_a_rule_of_all_directions_is_the_exact_one():
    nodes, rule = product_nodes(4), local_rule(4, 200, 32.0)
    np.testing.assert_array_equal(rule.directions, nodes.directions)
    np.testing.assert_array_equal(rule.rows, nodes.project.T)
    assert rule.lowest == -1
    t = np.linspace(-1, 1, 9)
    bands = np.polynomial.polynomial.polyvander(t, 4) @ rule.powers
    exact = np.polynomial.legendre.legvander(t, 4) * np.sqrt((2 * np.arange(5) + 1) / (4 * np.pi))
    np.testing.assert_allclose(bands, exact, rtol=0, atol=1e-13)
