"""Rotation, as the rotation of functions."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import oracles
import pytest
from scipy.linalg import expm

from jaxsh import harmonics

IDENTITY, HALF_X, HALF_Y, HALF_Z = (
    np.diag(d).astype(float) for d in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))
)


@pytest.mark.parametrize("degree", [0, 1, 4, 9])
def test_matrix_is_the_integral_by_scipy(degree, rng):
    for r in oracles.rotations(rng, 2):
        expected = oracles.slow_rotation_matrix(r, degree)
        np.testing.assert_allclose(harmonics.rotation_matrix(r, degree), expected, 0, 1e-14)


def test_degree_one_turns_like_a_vector(rng):
    (r,) = oracles.rotations(rng, 1)
    order = [1, 2, 0]  # y, z, x
    block = np.asarray(harmonics.rotation_matrix(r, 1))[1:, 1:]
    np.testing.assert_allclose(block, r[np.ix_(order, order)], 0, 1e-15)


@pytest.mark.parametrize(("dtype", "error"), [("float64", 2e-14), ("float32", 1e-5)])
def test_the_function_is_turned(dtype, error, rng):
    """(Rf)(ω) = f(Rᵀω)."""
    degree = 10
    c = rng.normal(size=(degree + 1) ** 2)
    (r,) = oracles.rotations(rng, 1)
    directions = oracles.unit_vectors(rng, 100)
    turned = harmonics.rotate(c.astype(dtype), r.astype(dtype))
    assert turned.dtype == dtype
    expected = oracles.scipy_basis(directions @ r, degree) @ c
    scale = np.linalg.norm(c)
    value = oracles.scipy_basis(directions, degree) @ np.asarray(turned, np.float64)
    np.testing.assert_allclose(value / scale, expected / scale, 0, error)


def test_a_lobe_along_x_turned_about_z_looks_along_y():
    lobe = harmonics.evaluate(np.array([1.0, 0, 0]), 5)
    about_z = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    expected = harmonics.evaluate(np.array([0.0, 1, 0]), 5)
    np.testing.assert_allclose(harmonics.rotate(lobe, about_z), expected, 0, 1e-14)
    np.testing.assert_allclose(harmonics.rotate_z(lobe, np.pi / 2), expected, 0, 1e-14)


@pytest.mark.parametrize(("degree", "dtype", "error"), [(10, "float64", 1e-14), (30, "f4", 4e-6)])
def test_composition_and_inverse(degree, dtype, error, rng):
    a, b = oracles.rotations(rng, 2)
    matrices = np.stack([a, b, a @ b, a.T]).astype(dtype)
    da, db, dab, inverse = np.asarray(harmonics.rotation_matrix(matrices, degree))
    np.testing.assert_allclose(da @ db, dab, 0, error)
    np.testing.assert_allclose(da.T, inverse, 0, error)
    np.testing.assert_allclose(da @ da.T, np.eye(len(da)), 0, error)


def test_bands_do_not_mix(rng):
    d = np.asarray(harmonics.rotation_matrix(oracles.rotations(rng, 1)[0], 4))
    l = harmonics.degrees(4)
    assert (d[l[:, None] != l] == 0).all()
    assert (d[l[:, None] == l] != 0).all()


def test_identity_half_turns_and_reflections_have_their_signs():
    m, l = harmonics.orders(6), harmonics.degrees(6)
    sine, odd = np.where(m < 0, -1.0, 1.0), (-1.0) ** m
    signs = {
        (1, 1, 1): np.ones(len(m)),
        (-1, -1, 1): odd,
        (1, -1, -1): sine * (-1.0) ** (l + m),
        (-1, 1, -1): sine * (-1.0) ** l,
        (1, 1, -1): (-1.0) ** (l + m),
        (1, -1, 1): sine,
        (-1, -1, -1): (-1.0) ** l,
    }
    for diagonal, expected in signs.items():
        d = harmonics.rotation_matrix(np.diag(diagonal).astype(float), 6)
        np.testing.assert_allclose(d, np.diag(expected), 0, 8e-15)


@pytest.mark.parametrize("degree", [0, 1, 8])
def test_rotate_z_is_rotate_about_z(degree, rng):
    c = rng.normal(size=(2, (degree + 1) ** 2))
    for angle in (0.0, 0.7, -2.5, np.pi, 100.0):
        cos, sin = np.cos(angle), np.sin(angle)
        r = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
        np.testing.assert_allclose(
            harmonics.rotate_z(c, angle), harmonics.rotate(c, r), 0, 3e-14, err_msg=f"{angle}"
        )


def test_batches_broadcast(rng):
    c, r = rng.normal(size=(2, 5, 16)), oracles.rotations(rng, 5)
    angles = rng.uniform(-4, 4, 5)
    both, z = harmonics.rotate(c, r), harmonics.rotate_z(c, angles)
    assert both.shape == z.shape == (2, 5, 16)
    for i, j in np.ndindex(2, 5):
        np.testing.assert_allclose(both[i, j], harmonics.rotate(c[i, j], r[j]), 0, 3e-15)
        np.testing.assert_allclose(z[i, j], harmonics.rotate_z(c[i, j], angles[j]), 0, 1e-15)
    many = harmonics.rotate(c[0, 0], r)
    np.testing.assert_allclose(many[3], harmonics.rotate(c[0, 0], r[3]), 0, 3e-15)
    same = harmonics.rotate(c, r[0])
    np.testing.assert_allclose(same[1, 2], harmonics.rotate(c[1, 2], r[0]), 0, 3e-15)
    outer = harmonics.rotate_z(c[0, 0], angles[:, None])
    assert outer.shape == (5, 1, 16)
    assert harmonics.rotation_matrix(r[:4].reshape(2, 2, 3, 3), 1).shape == (2, 2, 4, 4)
    assert harmonics.rotate(np.zeros((0, 16)), r[0]).shape == (0, 16)


def test_empty_batch_of_rotations():
    assert harmonics.rotation_matrix(np.zeros((0, 3, 3)), 2).shape == (0, 9, 9)


def test_jit_and_vmap_agree(rng):
    c, r = rng.normal(size=(5, 16)), oracles.rotations(rng, 5)
    expected = harmonics.rotate(c, r)
    np.testing.assert_allclose(jax.jit(jax.vmap(harmonics.rotate))(c, r), expected, 0, 3e-15)
    np.testing.assert_allclose(jax.jit(harmonics.rotate)(c, r), expected, 0, 3e-15)


TURNS = {
    "identity": IDENTITY,
    "half turn about x": HALF_X,
    "half turn about y": HALF_Y,
    "half turn about z": HALF_Z,
    "half turn about a diagonal": expm(np.pi / np.sqrt(3) * oracles.hat([1, 1, 1])),
    "any": expm(oracles.hat([0.3, 2.0, -1.0])),
}


@functools.partial(jax.jit, static_argnums=1)
def unchecked_matrix(r, degree):
    return harmonics.rotation_matrix(r, degree)  # traced, so not refused off the orthogonal ones


@jax.jit
def forward(r, tangent):
    return jax.jvp(lambda r: harmonics.rotation_matrix(r, 5), (r,), (tangent,))[1]


@jax.jit
def reverse(r, pull):
    return jax.grad(lambda r: jnp.sum(pull * harmonics.rotation_matrix(r, 5)))(r)


@pytest.mark.parametrize("turn", TURNS)
def test_derivative_in_the_rotation(turn, rng):
    """Along so(3) and out of it, where f(Rᵀω/|Rᵀω|) is the extension."""
    r, pull = TURNS[turn], rng.normal(size=(36, 36))
    gradient = reverse(r, pull)
    for tangent in (*(r @ oracles.hat(e) for e in np.eye(3)), rng.normal(size=(3, 3))):
        expected = oracles.slope(lambda t, v=tangent: unchecked_matrix(r + t * v, 5), 1e-3)
        slope = forward(r, tangent)
        np.testing.assert_allclose(slope, expected, 0, 3e-8)
        np.testing.assert_allclose(np.sum(gradient * tangent), np.sum(pull * slope), 1e-12)
        assert np.abs(expected).max() > 1


def test_derivative_along_true_rotations_by_the_exponential():
    """d/dt D(R exp(t ŵ)) = D(R) · (generator): the generators are the same at every R."""
    w = np.array([0.3, -0.5, 0.8])
    generator = None
    for r in TURNS.values():
        here = np.asarray(unchecked_matrix(r, 5)).T @ forward(r, r @ oracles.hat(w))
        generator = here if generator is None else generator
        np.testing.assert_allclose(here, -here.T, 0, 1e-13)
        np.testing.assert_allclose(here, generator, 0, 1e-13)
    full_turn = expm(2 * np.pi * generator / np.linalg.norm(w))
    np.testing.assert_allclose(full_turn, np.eye(36), 0, 1e-12)


def test_rotate_z_generator_and_gradients(rng):
    c = rng.normal(size=16)
    for mode in (jax.jacfwd, jax.jacrev):
        slope = jax.jit(mode(lambda t: harmonics.rotate_z(c, t)))(0.4)
        expected = oracles.slope(lambda t: harmonics.rotate_z(c, 0.4 + t), 1e-3)
        np.testing.assert_allclose(slope, expected, 0, 1e-10)


def test_bad_rotations_are_refused(unchecked):
    c = np.ones(9)
    for call in (lambda r: harmonics.rotate(c, r), lambda r: harmonics.rotation_matrix(r, 2)):
        with pytest.raises(ValueError, match=r"rotation \(\.\.\., 3, 3\).* got shape \(4, 4\)"):
            call(np.eye(4))
        with pytest.raises(ValueError, match=r"rotation \(\.\.\., 3, 3\).* got shape \(3,\)"):
            call(np.ones(3))
        with pytest.raises(
            ValueError, match=r"expected rotation as orthogonal matrices.* by 3\.0e\+00"
        ):
            call(2 * np.eye(3))
        with pytest.raises(ValueError, match=r"expected rotation as orthogonal matrices.* by nan"):
            call(np.full((3, 3), np.nan))
        with pytest.raises(ValueError, match="expected rotation as orthogonal matrices"):
            call(np.stack([np.eye(3), np.zeros((3, 3))]))
    with pytest.raises(ValueError, match=r"1, 4, 9, 16.*got shape .*8,?\)"):
        harmonics.rotate(np.ones(8), np.eye(3))
    with pytest.raises(ValueError, match=r"1, 4, 9, 16.*got shape .*8,?\)"):
        harmonics.rotate_z(np.ones(8), 1.0)
    with pytest.raises(ValueError, match=r"got shape \(\)"):
        harmonics.rotate(1.0, np.eye(3))


def test_batches_that_do_not_broadcast_are_refused(unchecked):
    two, turns = np.zeros((2, 4)), np.stack([np.eye(3)] * 3)
    with pytest.raises(ValueError, match=r"coefficients \(2, 4\) and rotation \(3, 3\)"):
        harmonics.rotate(two, turns)
    with pytest.raises(ValueError, match=r"coefficients \(2, 4\) and angle \(3, 1\)"):
        harmonics.rotate_z(two, np.zeros(3))
