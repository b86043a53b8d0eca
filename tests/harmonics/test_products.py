"""Products of functions, against quadrature and point by point."""

import jax
import numpy as np
import oracles
import pytest
from jax.test_util import check_grads

from jaxsh import harmonics


def values(c, directions):
    """f(ω) of (..., K) coefficients by SciPy: (..., N)."""
    c = np.asarray(c, np.float64)
    return c @ oracles.scipy_basis(directions, harmonics.degree_of(c.shape[-1])).T


@pytest.mark.parametrize("degree", [0, 1, 4])
def test_gaunt_is_the_integral_by_scipy(degree):
    g = harmonics.gaunt(degree)
    np.testing.assert_allclose(g, oracles.slow_gaunt(degree), 0, 4e-15)  # 1e-15


def test_gaunt_by_hand():
    g = harmonics.gaunt(2)
    np.testing.assert_allclose(g[0], np.eye(9) / np.sqrt(4 * np.pi), 0, 1e-15)
    # ∫ y_10 y_10 y_20 = 1/√(5π), ∫ y_11 y_11 y_22 = √(3/(20π)), ∫ y_20³ = √(5/π)/7
    known = {(2, 2, 6): 1 / np.sqrt(5 * np.pi), (3, 3, 8): np.sqrt(3 / (20 * np.pi))}
    known |= {(6, 6, 6): np.sqrt(5 / np.pi) / 7, (1, 1, 8): -np.sqrt(3 / (20 * np.pi))}
    for i, value in known.items():
        np.testing.assert_allclose(g[i], value, 1e-14)


def test_gaunt_is_symmetric_and_obeys_the_selection_rules():
    degree = 10
    g = np.asarray(harmonics.gaunt(degree))
    np.testing.assert_allclose(g, g.transpose(1, 0, 2), 0, 1e-15)
    np.testing.assert_allclose(g, g.transpose(2, 1, 0), 0, 1e-15)
    assert np.count_nonzero(g) == 65913
    assert np.abs(g[g != 0]).min() > 7e-4
    l, m = harmonics.degrees(degree), harmonics.orders(degree)
    i, j, k = np.nonzero(g)
    assert ((l[i] + l[j] + l[k]) % 2 == 0).all()
    assert (l[k] <= l[i] + l[j]).all()
    assert (l[k] >= np.abs(l[i] - l[j])).all()
    a, b, c = np.abs(m[i]), np.abs(m[j]), np.abs(m[k])
    assert ((a + b == c) | (np.abs(a - b) == c)).all()
    assert (((m[i] < 0).astype(int) + (m[j] < 0) + (m[k] < 0)) % 2 == 0).all()


@pytest.mark.parametrize(("f_degree", "g_degree"), [(0, 0), (3, 3), (5, 2), (0, 4)])
def test_the_full_product_is_exact_point_by_point(f_degree, g_degree, rng):
    f, g = (rng.normal(size=(degree + 1) ** 2) for degree in (f_degree, g_degree))
    directions = oracles.unit_vectors(rng, 60)
    full = harmonics.product(f, g, f_degree + g_degree)
    expected = values(f, directions) * values(g, directions)
    np.testing.assert_allclose(values(full, directions), expected, 0, 3e-14)
    above = harmonics.product(f, g, f_degree + g_degree + 1)
    np.testing.assert_allclose(above, np.pad(full, (0, len(above) - len(full))), 0, 1e-14)
    for degree in {0, min(f_degree, g_degree), max(f_degree, g_degree)}:
        count = (degree + 1) ** 2
        below = harmonics.product(f, g, degree)
        np.testing.assert_allclose(below, full[:count], 0, 1e-14)
    np.testing.assert_allclose(
        harmonics.product(f, g), full[: max(len(f), len(g))], 0, 1e-14, err_msg="the default"
    )
    np.testing.assert_allclose(harmonics.product(g, f), harmonics.product(f, g), 0, 1e-14)


def test_product_is_the_gaunt_tensor_at_degree_ten(rng):
    f, g = rng.normal(size=(2, 121))
    expected = np.einsum("ijk,i,j->k", harmonics.gaunt(10), f, g)
    np.testing.assert_allclose(harmonics.product(f, g), expected, 0, 1e-13)


def test_product_in_float32(rng):
    f, g = rng.normal(size=(2, 121))
    single = harmonics.product(np.float32(f), np.float32(g))
    assert single.dtype == np.float32
    np.testing.assert_allclose(single, harmonics.product(f, g), 0, 2e-5)  # 6e-6


@pytest.mark.parametrize(("f_degree", "degree"), [(0, 2), (3, 3), (4, 2), (2, 4)])
def test_product_matrix_multiplies(f_degree, degree, rng):
    f, g = rng.normal(size=(f_degree + 1) ** 2), rng.normal(size=(degree + 1) ** 2)
    m = np.asarray(harmonics.product_matrix(f, degree))
    np.testing.assert_allclose(m, m.T, 0, 1e-15)
    np.testing.assert_allclose(m @ g, harmonics.product(f, g, degree), 0, 4e-15)
    top = max(f_degree, degree)
    gaunt = oracles.slow_gaunt(top)[: len(f), : len(g), : len(g)]
    np.testing.assert_allclose(m, np.einsum("ijk,i->jk", gaunt, f), 0, 6e-15)
    default = harmonics.product_matrix(f)
    np.testing.assert_allclose(default, harmonics.product_matrix(f, f_degree), 0, 0)


def test_multiplication_with_a_constant():
    one = np.zeros(16)
    one[0] = np.sqrt(4 * np.pi)
    np.testing.assert_allclose(harmonics.product_matrix(one), np.eye(16), 0, 2e-15)


@pytest.mark.parametrize(("a", "b", "c"), [(0, 0, 0), (2, 3, 4), (4, 1, 2), (1, 1, 5)])
def test_triple_integral_by_quadrature(a, b, c, rng):
    f, g, h = (rng.normal(size=(degree + 1) ** 2) for degree in (a, b, c))
    directions, weights = oracles.product_grid(a + b + c)
    expected = np.prod([values(x, directions) for x in (f, g, h)], axis=0) @ weights
    for x, y, z in ((f, g, h), (h, f, g), (g, h, f)):
        np.testing.assert_allclose(harmonics.triple_integral(x, y, z), expected, 0, 2e-14)


def test_triple_integral_takes_the_widest_dtype(rng):
    f, g, h = rng.normal(size=(3, 4))
    jax.config.update("jax_numpy_dtype_promotion", "standard")
    try:
        for i in range(3):
            mixed = [
                x.astype(np.float64 if i == k else np.float32) for k, x in enumerate((f, g, h))
            ]
            value = harmonics.triple_integral(*mixed)
            assert value.dtype == np.float64
            wide = harmonics.triple_integral(*(x.astype(np.float64) for x in mixed))
            np.testing.assert_allclose(value, wide, 0, 1e-15)
        assert harmonics.product(np.float32(f), g).dtype == np.float64
    finally:
        jax.config.update("jax_numpy_dtype_promotion", "strict")


def test_batches_broadcast(rng):
    f, g = rng.normal(size=(2, 1, 9)), rng.normal(size=(3, 4))
    p, t = harmonics.product(f, g), harmonics.triple_integral(f, g, rng.normal(size=(5, 1, 1, 4)))
    assert (p.shape, t.shape) == ((2, 3, 9), (5, 2, 3))
    for i, j in np.ndindex(2, 3):
        np.testing.assert_allclose(p[i, j], harmonics.product(f[i, 0], g[j]), 0, 4e-15)
    m = harmonics.product_matrix(f, 1)
    assert m.shape == (2, 1, 4, 4)
    np.testing.assert_allclose(m[1, 0], harmonics.product_matrix(f[1, 0], 1), 0, 1e-15)
    assert harmonics.product(np.zeros((0, 9)), g[0]).shape == (0, 9)
    assert harmonics.product_matrix(np.zeros((0, 9))).shape == (0, 9, 9)


@pytest.mark.parametrize("count", [1024, 1025, 2500])
def test_a_large_batch_goes_in_blocks_unnoticed(count, rng):
    f, g = rng.normal(size=(count, 4)), rng.normal(size=(2, 1, 9))
    many = harmonics.product(f, g)
    assert many.shape == (2, count, 9)
    gaunt = oracles.slow_gaunt(2)[:4]
    expected = np.einsum("ijk,ni,bj->bnk", gaunt, f, g[:, 0])
    np.testing.assert_allclose(many, expected, 0, 2e-14)


def test_jit_vmap_and_gradients(rng):
    f, g, h = rng.normal(size=(5, 9)), rng.normal(size=(5, 4)), rng.normal(size=(5, 9))
    for call, arguments in (
        (harmonics.product, (f, g)),
        (harmonics.product_matrix, (f,)),
        (harmonics.triple_integral, (f, g, h)),
    ):
        expected = call(*arguments)
        np.testing.assert_allclose(jax.jit(call)(*arguments), expected, 0, 4e-15)
        np.testing.assert_allclose(jax.vmap(call)(*arguments), expected, 0, 4e-15)
        check_grads(call, arguments, order=1, modes=["fwd", "rev"], rtol=1e-7)


def test_gradients_through_a_large_batch(rng):
    f, g = rng.normal(size=(1030, 4)), rng.normal(size=(1, 4))
    pull = rng.normal(size=(1030, 4))
    df, dg = jax.grad(lambda f, g: (harmonics.product(f, g) * pull).sum(), (0, 1))(f, g)
    gaunt = oracles.slow_gaunt(1)
    np.testing.assert_allclose(df, np.einsum("ijk,j,nk->ni", gaunt, g[0], pull), 0, 1e-13)
    np.testing.assert_allclose(dg[0], np.einsum("ijk,ni,nk->j", gaunt, f, pull), 0, 1e-12)


def test_bad_input_is_refused(unchecked):
    good = np.ones(9)
    for call in (
        lambda bad: harmonics.product(bad, good),
        lambda bad: harmonics.product(good, bad),
        lambda bad: harmonics.product_matrix(bad),
        lambda bad: harmonics.triple_integral(bad, good, good),
        lambda bad: harmonics.triple_integral(good, bad, good),
        lambda bad: harmonics.triple_integral(good, good, bad),
    ):
        with pytest.raises(ValueError, match=r"1, 4, 9, 16.*got shape .*8,?\)"):
            call(np.ones(8))
        with pytest.raises(ValueError, match=r"1, 4, 9, 16.*got shape \(\)"):
            call(1.0)
    for call in (harmonics.product_matrix, lambda f, d: harmonics.product(f, f, d)):
        with pytest.raises(ValueError, match=r"degree must be an integer >= 0.*got -1"):
            call(good, -1)


def test_batches_that_do_not_broadcast_are_refused(unchecked):
    two, three = np.zeros((2, 4)), np.zeros((3, 4))
    with pytest.raises(ValueError, match=r"must broadcast, got f \(2, 4\) and g \(3, 4\)"):
        harmonics.product(two, three)
    with pytest.raises(ValueError, match=r"must broadcast, got f .* and g .* and h \(3, 4\)"):
        harmonics.triple_integral(two, two, three)
