"""The few numbers of light and transfer around a tile's middle."""

import numpy as np

from jaxsh import harmonics
from jaxsh.adaptive._local_rule import (
    REACH,
    degree_of_monomials,
    disc,
    local_rule,
    monomials,
    num_tiles_for,
)
from jaxsh.transfer._glossy_kernels import product_nodes


def applied(rule, degree, exponent, light, transfer, poles):
    core = np.tensordot(harmonics.phong(exponent, degree, normalized=True), rule.core, 1)
    within = monomials(*poles[:, :2].T / rule.reach, degree_of_monomials(rule.functions.shape[1]))
    given = light @ rule.lights.T, rule.functions @ within, core, transfer @ rule.rows.T
    return np.einsum("bm,gb,mgn,bn->b", *given)


def errors(degree, exponent, counts, rng, reach=REACH, far=0.25):
    """Of the rule, for lights and transfers as it expects them, relative to what is exact."""
    nodes, number = product_nodes(degree), 400
    spread = np.sqrt((1.0 + harmonics.degrees(degree)) ** -3.3)
    light, transfer = rng.normal(size=(2, number, len(nodes.project)))
    transfer = transfer * spread
    across = disc(number)[rng.permutation(number)] * far
    poles = np.c_[across, np.sqrt(1 - np.sum(across**2, axis=1))]
    zonal = harmonics.phong(exponent, degree, normalized=True)
    lobes = np.asarray(harmonics.convolve(harmonics.evaluate(poles, degree), zonal))
    values = (lobes @ nodes.basis.T) * (light @ nodes.basis.T) * (transfer @ nodes.project)
    exact = np.sum(values, axis=1)
    for count in counts:
        rule = local_rule(degree, count, exponent, reach)
        error = applied(rule, degree, exponent, light, transfer, poles) - exact
        yield np.sqrt(np.mean(error**2) / np.mean(exact**2))


def test_a_rule_of_all_numbers_leaves_polynomials_alone(rng):
    [error] = errors(3, 8.0, [16], rng)
    assert error < 2.5e-5


def test_error_of_a_rule_falls_with_its_numbers(rng):
    few, more, most = errors(4, 16.0, [6, 12, 25], rng)
    assert few < 0.14
    assert more < 0.07
    assert most < 1e-4


def test_a_rule_of_a_longer_reach_is_better_far_away_and_worse_nearby(rng):
    near, far = (
        [next(errors(4, 16.0, [12], rng, reach, far)) for reach in (0.1, 0.4)] for far in (0.1, 0.5)
    )
    assert near[0] < 0.9 * near[1]
    assert far[1] < 0.6 * far[0]


def test_numbers_and_tiles_follow_degree_reach_and_exponent():
    def numbers(*given, reach=REACH):
        return len(local_rule(given[0], None, given[1], reach).rows)

    assert numbers(2, 8.0) == 9  # all
    assert numbers(4, 8.0) < numbers(4, 32.0) < numbers(6, 32.0)
    assert numbers(6, 32.0) < numbers(6, 32.0, reach=0.5)
    assert num_tiles_for(4, 32.0) == num_tiles_for(10, 32.0) == 400
    assert 400 < num_tiles_for(10, 128.0) < num_tiles_for(10, 1000.0) < 1200
    assert num_tiles_for(30, 1000.0) == 1200


def test_monomials_are_in_the_order_of_their_degree():
    x, y = np.array([2.0]), np.array([3.0])
    np.testing.assert_array_equal(np.ravel(monomials(x, y, 3)), [1, 2, 3, 4, 6, 9, 8, 12, 18, 27])
