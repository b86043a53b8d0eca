"""Sums over the basis beside SciPy's basis, and their derivatives beside those of `evaluate`."""

import jax
import jax.numpy as jnp
import numpy as np
import oracles
import pytest

from jaxsh import harmonics
from jaxsh.harmonics import _synthesis

# Coefficients and vectors: shared by all, one for each, batches of shared ones, single vectors.
SHAPES = [
    ((3,), (6, 3)),
    ((6, 3), (6, 3)),
    ((2, 1, 3), (6, 3)),
    ((2, 6, 3), (6, 3)),
    ((5,), (2, 6, 3)),
    ((6, 3), (2, 6, 3)),
    ((2, 3), (3,)),
    ((), (6, 3)),
]


def by_evaluate(coefficients, vectors):
    """Σ_k c_k y_k as it is written down."""
    basis = harmonics.evaluate(vectors, harmonics.degree_of(coefficients.shape[-1]))
    return jnp.einsum("...ck,...k->...c", coefficients, basis)


@pytest.mark.parametrize(
    "degree", [3, *(pytest.param(d, marks=pytest.mark.slow) for d in (0, 4, 5, 7))]
)
def test_values_are_those_of_scipy_for_all_batches(degree, rng):
    """Float64 to 4e-15 up to degree 4 (measured 3.2e-15), to 2e-14 above (1.1e-14, at degree 7).

    Float32 to 4e-6 (measured 1.5e-6).
    """
    tolerance = 4e-15 if degree <= 4 else 2e-14
    for leading, shape in SHAPES if degree == 4 else SHAPES[:4]:
        c, vectors = rng.normal(size=(*leading, (degree + 1) ** 2)), rng.normal(size=shape)
        basis = oracles.scipy_basis(vectors, degree)
        expected = (np.expand_dims(basis, -2) * c).sum(-1) if leading else basis @ c
        found = harmonics.synthesize(c, vectors)
        np.testing.assert_allclose(found, expected, 0, tolerance, strict=True)
        if degree == 3 and leading in ((3,), (6, 3)):
            found = harmonics.synthesize(c.astype(np.float32), vectors)
            np.testing.assert_allclose(found, expected.astype(np.float32), 0, 4e-6, strict=True)


def derivatives(f, c, vectors, change, turn):
    """Reverse in both and in one, forward, forward over reverse, and reverse over reverse."""

    def slope(c, vectors):
        return jax.grad(lambda *x: jnp.sum(f(*x) ** 2), (0, 1))(c, vectors)

    def again(c, vectors):
        return jnp.sum(turn * slope(c, vectors)[1])

    one = jax.grad(lambda v: jnp.sum(f(c, v)))(vectors)
    tangents = (change, turn)
    first = one, slope(c, vectors), jax.jvp(f, (c, vectors), tangents)[1]
    return first, jax.jvp(slope, (c, vectors), tangents)[1], jax.grad(again, (0, 1))(c, vectors)


@pytest.mark.parametrize("leading", [(6, 3), (3,)])
@pytest.mark.parametrize("degree", [0, 2])
@pytest.mark.slow
def test_derivatives_in_every_mode_and_order(degree, leading, rng):
    """Against the sum over `evaluate`, whose rules are another way; at a pole, too."""
    check_derivatives(degree, leading, 6, rng)


def check_derivatives(degree, leading, count, rng):
    c, vectors = rng.normal(size=(*leading, (degree + 1) ** 2)), rng.normal(size=(count, 3))
    vectors[0] = 0.0, 0.0, -2.0
    arguments = c, vectors, rng.normal(size=c.shape), rng.normal(size=vectors.shape)
    found = jax.jit(lambda *x: derivatives(harmonics.synthesize, *x))(*arguments)
    expected = jax.jit(lambda *x: derivatives(by_evaluate, *x))(*arguments)
    scale = max(float(jnp.abs(leaf).max()) for leaf in jax.tree.leaves(expected)) + 1
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, 0, 1e-14 * scale), found, expected)


@pytest.mark.parametrize("leading", [(7, 2), (2,)])
@pytest.mark.slow
def test_derivatives_slice_by_slice(leading, rng, monkeypatch):
    """Of more vectors than are computed at once, in slices of which the last two overlap."""
    monkeypatch.setattr(_synthesis, "_AT_ONCE", 0)
    monkeypatch.setattr(_synthesis, "_SLICE", 3 * 9 * 8)
    check_derivatives(2, leading, 7, rng)
    c, vectors = rng.normal(size=(2, *leading, 9)), rng.normal(size=(2, 7, 3))
    grad = jax.grad(lambda c, v: jnp.sum(harmonics.synthesize(c, v) ** 2), (0, 1))
    assert "dynamic_slice" in str(jax.make_jaxpr(grad)(c[0], vectors[0]))
    alone = [grad(*pair) for pair in zip(c, vectors, strict=True)]
    for found, *expected in zip(jax.vmap(grad)(c, vectors), *alone, strict=True):
        np.testing.assert_allclose(found, jnp.stack(expected), 0, 1e-12)


@pytest.mark.parametrize("leading", [(4, 2), (2,)])
def test_slopes_forward_and_reverse(leading, rng):
    """By finite differences."""
    c, vectors = rng.normal(size=(*leading, 4)), rng.normal(size=(4, 3))
    change, turn = rng.normal(size=c.shape), rng.normal(size=vectors.shape)

    @jax.jit
    def slopes(c, vectors):
        values, pull = jax.vjp(harmonics.synthesize, c, vectors)
        return jax.jvp(harmonics.synthesize, (c, vectors), (change, turn))[1], pull(values)

    along = oracles.slope(lambda t: harmonics.synthesize(c + t * change, vectors + t * turn), 2e-4)
    tangent, (of_c, of_vectors) = slopes(c, vectors)
    np.testing.assert_allclose(tangent, along, 0, 1e-9)
    total = jnp.sum(of_c * change) + jnp.sum(of_vectors * turn)
    np.testing.assert_allclose(total, jnp.sum(harmonics.synthesize(c, vectors) * along), 0, 1e-8)


@pytest.mark.slow
def test_a_batch_by_vmap_and_each_argument_alone(rng):
    """`vmap` of derivatives is derivatives of the batch; one argument's do not need the other's."""
    c, vectors = rng.normal(size=(2, 5, 3, 9)), rng.normal(size=(2, 5, 3))

    def slopes(c, vectors):
        def total(c, vectors):
            return jnp.sum(harmonics.synthesize(c, vectors) ** 2)

        both = jax.grad(total, (0, 1))(c, vectors)
        return both, (jax.grad(total)(c, vectors), jax.grad(total, 1)(c, vectors))

    whole, alone = slopes(c, vectors)
    mapped, _ = jax.vmap(slopes)(c, vectors)
    for one in (alone, mapped):
        jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, 0, 1e-12), whole, one)
    assert slopes(c.astype(np.float32), vectors.astype(np.float32))[0][1].dtype == np.float32


def test_what_is_wrong_is_said():
    with pytest.raises(ValueError, match=r"leading axes must broadcast.*\(4, 3, 9\).*\(5, 3\)"):
        harmonics.synthesize(np.zeros((4, 3, 9)), np.ones((5, 3)))
    with pytest.raises(ValueError, match=r"coefficients \(\.\.\., K\)"):
        harmonics.synthesize(np.zeros((4, 3, 8)), np.ones((4, 3)))
    assert np.isnan(harmonics.synthesize(np.ones((1, 4)), np.zeros((1, 3)))).all()
