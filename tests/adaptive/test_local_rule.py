"""The few numbers of light and transfer around a tile's middle."""

import numpy as np

from jaxsh import harmonics
from jaxsh.adaptive._local_rule import disc, local_rule, monomials
from jaxsh.transfer._glossy_kernels import product_nodes


def applied(rule, degree, exponent, light, transfer, poles):
    core = np.tensordot(harmonics.phong(exponent, degree, normalized=True), rule.core, 1)
    powers = np.stack(monomials(*poles[:, :2].T / rule.reach), axis=-1)
    return np.einsum("bm,bg,mgn,bn->b", light @ rule.lights.T, powers, core, transfer @ rule.rows.T)


def errors(degree, exponent, counts, rng):
    """Of the rule, for lights and transfers as it expects them, relative to what is exact."""
    nodes, number = product_nodes(degree), 400
    spread = np.sqrt((1.0 + harmonics.degrees(degree)) ** -3.3)
    light, transfer = rng.normal(size=(2, number, len(nodes.project)))
    transfer = transfer * spread
    across = disc(number)[rng.permutation(number)] * 0.25
    poles = np.c_[across, np.sqrt(1 - np.sum(across**2, axis=1))]
    zonal = harmonics.phong(exponent, degree, normalized=True)
    lobes = np.asarray(harmonics.convolve(harmonics.evaluate(poles, degree), zonal))
    values = (lobes @ nodes.basis.T) * (light @ nodes.basis.T) * (transfer @ nodes.project)
    exact = np.sum(values, axis=1)
    for count in counts:
        rule = local_rule(degree, count, exponent)
        error = applied(rule, degree, exponent, light, transfer, poles) - exact
        yield np.sqrt(np.mean(error**2) / np.mean(exact**2))


def test_a_rule_of_all_numbers_leaves_polynomials_alone(rng):
    [error] = errors(3, 8.0, [16], rng)
    assert error < 1e-5


def test_error_of_a_rule_falls_with_its_numbers(rng):
    few, more, most = errors(4, 16.0, [6, 12, 25], rng)
    assert few < 0.12
    assert more < 0.07
    assert most < 1e-4


def test_monomials_are_in_the_order_of_their_degree():
    x, y = np.array([2.0]), np.array([3.0])
    np.testing.assert_array_equal(np.ravel(monomials(x, y, 3)), [1, 2, 3, 4, 6, 9, 8, 12, 18, 27])
