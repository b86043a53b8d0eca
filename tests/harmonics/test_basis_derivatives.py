"""Derivatives of the basis: analytic, forward, reverse, mixed, and finite differences of SciPy."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import oracles
import pytest
from jax.test_util import check_grads

from jaxsh import harmonics

RANDOM = np.random.default_rng(7).normal(size=(6, 3))
POINTS = np.array(
    [
        *RANDOM,
        *np.eye(3),
        *-np.eye(3),
        *(3.0 * np.eye(3)),  # not of length 1
        [0.0, 0.0, -0.2],
        [1e-8, 0.0, 1.0],  # nearly poles
        [-1e-8, 2e-8, -1.0],
        [0.0, 1e-150, 1.0],
        [1.0, 1.0, 1.0],  # ties for the largest component
        [1.0, -1.0, 0.0],
        [-2.0, 0.0, 2.0],
    ]
)


def scipy_gradient(points, degree):
    """∂/∂s_k of SciPy's basis by five points, with steps in proportion to |s|."""
    steps = np.linalg.norm(points, axis=-1, keepdims=True)

    def along(axis):
        direction = steps * np.eye(3)[axis]

        def move(t):
            return oracles.scipy_basis(points + t * direction, degree)

        return oracles.slope(move, 2e-3 / (degree + 1)) / steps

    return np.stack([along(axis) for axis in range(3)], axis=-1)


@functools.partial(jax.jit, static_argnums=1)
def jacobians(points, degree):
    """Forward and reverse."""

    def f(s):
        return harmonics.evaluate(s, degree)

    return jax.vmap(lambda s: (jax.jacfwd(f)(s), jax.jacrev(f)(s)))(points)


@pytest.mark.parametrize("degree", [0, pytest.param(1, marks=pytest.mark.slow), 13])
def test_gradient_four_ways(degree):
    y, gradient = map(np.asarray, harmonics.evaluate_with_gradient(POINTS, degree))
    np.testing.assert_allclose(y, oracles.scipy_basis(POINTS, degree), 0, 3e-14)
    size = np.abs(gradient).max() if degree else 1.0
    assert degree or not gradient.any()
    error = 1e-15 * (degree + 1) ** 2 * size
    for jacobian in jacobians(POINTS, degree):
        np.testing.assert_allclose(jacobian, gradient, 0, error)
    np.testing.assert_allclose(gradient, scipy_gradient(POINTS, degree), 0, 3e-10 * size)


@pytest.mark.parametrize("degree", [3, pytest.param(30, marks=pytest.mark.slow)])
def test_gradient_has_no_radial_part(degree, rng):
    s = rng.normal(size=(40, 3)) * 10.0 ** rng.uniform(-3, 3, (40, 1))
    _, gradient = harmonics.evaluate_with_gradient(s, degree)
    radial = np.einsum("nki,ni->nk", gradient, s)
    np.testing.assert_allclose(radial, 0, 0, {3: 4e-15, 30: 1e-11}[degree])


def test_gradient_energy_of_each_band(rng):
    """Σ_m |∇y_lm|² = l(l+1)(2l+1)/4π, the addition theorem's derivative."""
    degree, directions = 20, oracles.unit_vectors(rng, 40)
    _, gradient = harmonics.evaluate_with_gradient(directions, degree)
    l = np.arange(degree + 1)
    energy = np.add.reduceat(np.sum(np.asarray(gradient) ** 2, -1), l**2, axis=-1)
    expected = l * (l + 1) * (2 * l + 1) / (4 * np.pi)
    np.testing.assert_allclose(energy, np.broadcast_to(expected, energy.shape), 1e-12)  # 1e-13


@pytest.mark.slow
def test_gradient_in_float32(rng):
    s = rng.normal(size=(40, 3)).astype(np.float32)
    _, gradient = harmonics.evaluate_with_gradient(s, 30)
    _, expected = harmonics.evaluate_with_gradient(s.astype(np.float64), 30)
    size = np.abs(expected).max(axis=(1, 2), keepdims=True)
    np.testing.assert_allclose(np.asarray(gradient) / size, expected / size, 0, 1e-4)


def test_first_layout_holds_the_same_numbers():
    y, gradient = harmonics.evaluate_with_gradient(POINTS, 6)
    y_first, gradient_first = harmonics.evaluate_with_gradient(POINTS, 6, axis=0)
    np.testing.assert_allclose(np.moveaxis(y_first, 0, -1), y, 0, 1e-15)
    np.testing.assert_allclose(np.moveaxis(gradient_first, (1, 0), (-2, -1)), gradient, 0, 1e-14)


def gradient_of(degree):
    return lambda s: harmonics.evaluate_with_gradient(s, degree)[1]


@functools.partial(jax.jit, static_argnums=1)
def hessians(points, degree):
    """Forward over reverse."""
    return jax.vmap(jax.hessian(lambda s: harmonics.evaluate(s, degree)))(points)


@pytest.mark.slow
@pytest.mark.parametrize(
    "order",
    ["fwd-rev", "rev-rev", "fwd-fwd", "rev-fwd"],
)
def test_second_derivatives_in_every_mode(order):
    degree, modes = 4, {"fwd": jax.jacfwd, "rev": jax.jacrev}
    if order == "fwd-rev":
        hessian = hessians(POINTS, degree)
    else:
        outer, inner = (modes[mode] for mode in order.split("-"))
        hessian = jax.jit(jax.vmap(outer(inner(lambda s: harmonics.evaluate(s, degree)))))(POINTS)
    steps = np.linalg.norm(POINTS, axis=-1)[:, None]

    def along(axis):
        def move(t):
            return gradient_of(degree)(POINTS + t * steps * np.eye(3)[axis])

        return oracles.slope(move, 5e-4) / steps[..., None]

    expected = np.stack([along(axis) for axis in range(3)], axis=-1)
    np.testing.assert_allclose(hessian, expected, 0, 1e-10 * np.abs(expected).max())
    np.testing.assert_allclose(hessian, np.swapaxes(hessian, -1, -2), 0, 1e-12)


@pytest.mark.parametrize("mode", [jax.jacfwd, pytest.param(jax.jacrev, marks=pytest.mark.slow)])
def test_derivative_of_the_analytic_gradient_is_the_hessian(mode):
    hessian = jax.jit(jax.vmap(mode(gradient_of(4))))(POINTS)
    expected = hessians(POINTS, 4)
    np.testing.assert_allclose(hessian, expected, 0, 1e-14 * np.abs(expected).max())


def test_laplacian_on_the_sphere():
    """y(s/|s|) has no radial part, so its Laplacian in space is -l(l+1) y / |s|²."""
    degree = 4
    hessian = hessians(POINTS, degree)
    l = harmonics.degrees(degree)
    expected = -l * (l + 1) * oracles.scipy_basis(POINTS, degree)
    expected /= np.sum(POINTS**2, axis=-1, keepdims=True)
    error = 1e-12 * np.abs(expected).max()
    np.testing.assert_allclose(np.trace(hessian, axis1=-2, axis2=-1), expected, 0, error)


@pytest.mark.slow
def test_third_derivative_at_the_pole():
    def f(s):
        return harmonics.evaluate(s, 4)

    third = jax.jit(jax.jacfwd(jax.jacrev(jax.jacfwd(f))))
    for pole in np.array([[0, 0, 1.0], [0, 0, -2.0]]):

        def hessian(t, pole=pole):
            moved = np.resize(pole + t * np.eye(3), POINTS.shape)  # the program of the tests above
            return np.moveaxis(np.asarray(hessians(moved, 4))[:3], 0, -1)

        expected = oracles.slope(hessian, 1e-3)
        np.testing.assert_allclose(third(pole), expected, 0, 1e-8)
        assert np.abs(expected).max() > 1


@pytest.mark.slow
def test_gradients_through_a_nonlinear_loss():
    @jax.jit
    def loss(s):
        y, gradient = harmonics.evaluate_with_gradient(s, 2)
        return jnp.sum(jnp.sin(y)) + jnp.sum(jnp.sin(gradient))

    check_grads(loss, (POINTS[[0, 6, 11, 19]],), order=1, modes=["fwd", "rev"], rtol=1e-6)


@pytest.mark.parametrize("exponent", [-15, 15])
def test_second_derivatives_of_short_and_long_vectors_in_float32(exponent):
    """They go with |s|^-2, which float32 holds from about 1e-19 to 1e19."""
    s = np.float32(POINTS * 10.0**exponent)
    expected = hessians(s.astype(np.float64), 4)
    np.testing.assert_allclose(hessians(s, 4), expected, 0, 2e-6 * np.abs(expected).max())


def test_debug_nans_finds_none():
    with jax.debug_nans(True):
        jacobians(POINTS, 13)  # the programs of `test_gradient_four_ways`
        harmonics.evaluate_with_gradient(POINTS, 13)
