"""Zonal kernels and convolution."""

import jax
import numpy as np
import oracles
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jax.test_util import check_grads
from scipy.integrate import quad
from scipy.special import eval_legendre

from jaxsh import harmonics


def lambdas(zonal):
    l = np.arange(np.shape(zonal)[-1])
    return np.sqrt(4 * np.pi / (2 * l + 1)) * np.asarray(zonal, np.float64)


def slow_lambda(exponent, l):
    """2π ∫_0^1 x^k P_l(x) dx with x = exp(-t/(k+1)), which is smooth at every k > -1."""

    def f(t):
        return np.exp(-t) * eval_legendre(l, np.exp(-t / (exponent + 1)))

    return 2 * np.pi / (exponent + 1) * quad(f, 0, 60, epsabs=1e-13, epsrel=1e-13, limit=400)[0]


def test_clamped_cosine_known_values():
    expected = np.pi * np.array([1, 2 / 3, 1 / 4, 0, -1 / 24, 0, 1 / 64, 0, -1 / 128])
    cosine = lambdas(harmonics.clamped_cosine(8))
    np.testing.assert_allclose(cosine, expected, 1e-15)
    assert (cosine[3::2] == 0).all()
    np.testing.assert_allclose(harmonics.clamped_cosine(0), [np.sqrt(np.pi) / 2], 1e-15)


def test_clamped_cosine_by_quadrature_to_degree_30():
    """g_l = ∫ max(0, cos θ) y_l0 dω, of the basis itself."""
    x, w = np.polynomial.legendre.leggauss(40)
    x, w = (x + 1) / 2, w / 2
    l = np.arange(31)
    meridian = oracles.scipy_basis(np.stack([np.sqrt(1 - x**2), 0 * x, x], -1), 30)[:, l * (l + 1)]
    expected = 2 * np.pi * (w * x) @ meridian
    np.testing.assert_allclose(
        harmonics.clamped_cosine(30), expected, 0, 4e-14
    )  # 2e-14, NumPy's nodes
    assert harmonics.clamped_cosine(30).shape == (31,)


@pytest.mark.parametrize("exponent", [-0.5, 0.0, 0.5, 1.0, 2.0, 7.3, 100.0, 4096.5, 1e7])
def test_phong_by_quadrature(exponent):
    degree = 20
    expected = [slow_lambda(exponent, l) for l in range(degree + 1)]
    kernel = lambdas(harmonics.phong(exponent, degree))
    np.testing.assert_allclose(kernel, expected, 0, 3e-14 * expected[0])
    single = harmonics.phong(np.float32(exponent), degree)
    assert single.dtype == np.float32
    np.testing.assert_allclose(lambdas(single), expected, 0, 3e-6 * expected[0])


@pytest.mark.parametrize("exponent", [0.0, 1.0, 33.3, 1e12])
def test_normalized_phong_keeps_a_constant(exponent):
    kernel = lambdas(harmonics.phong(exponent, 6, normalized=True))
    assert kernel[0] == pytest.approx(1, abs=1e-15)
    plain = lambdas(harmonics.phong(exponent, 6))
    np.testing.assert_allclose(kernel, plain / plain[0], 1e-14)
    assert plain[0] == pytest.approx(2 * np.pi / (exponent + 1), rel=1e-15)


def test_a_mirror_is_the_limit_of_phong():
    kernel = lambdas(harmonics.phong(1e15, 10, normalized=True))
    np.testing.assert_allclose(kernel, 1, 1e-12)


@given(st.floats(-0.99, 1e6), st.integers(2, 12))
def test_phong_obeys_its_recursion(exponent, degree):
    """(2l+1) x P_l = (l+1) P_l+1 + l P_l-1 ties the lobe k+1 to the lobe k."""
    k = lambdas(harmonics.phong(exponent, degree))
    higher = lambdas(harmonics.phong(exponent + 1, degree))
    l = np.arange(1, degree)
    expected = ((l + 1) * k[2:] + l * k[:-2]) / (2 * l + 1)
    np.testing.assert_allclose(higher[1:-1], expected, 1e-9, 1e-15 * k[0])


@pytest.mark.parametrize("normalized", [False, True])
def test_derivative_in_the_exponent(normalized):
    """At the integers too, where factors of the recursion vanish."""

    @jax.jit
    def f(k):
        return harmonics.phong(k, 8, normalized=normalized)

    forward, reverse = jax.jit(jax.jacfwd(f)), jax.jit(jax.jacrev(f))
    for exponent in (0.0, 1.0, 2.0, 7.0, 12.34):
        expected = oracles.slope(lambda t, k=exponent: f(k + t), 1e-3)
        np.testing.assert_allclose(forward(exponent), expected, 0, 1e-10)
        np.testing.assert_allclose(reverse(exponent), expected, 0, 1e-10)


def test_phong_takes_batches_and_integers(rng, unchecked):
    exponents = rng.uniform(0, 50, (2, 3))
    kernels = harmonics.phong(exponents, 4, normalized=True)
    assert kernels.shape == (2, 3, 5)
    one = harmonics.phong(exponents[1, 2], 4, normalized=True)
    np.testing.assert_allclose(kernels[1, 2], one, 1e-15)
    np.testing.assert_array_equal(harmonics.phong(3, 4), harmonics.phong(3.0, 4))
    np.testing.assert_allclose(jax.vmap(lambda k: harmonics.phong(k, 4))(exponents[0])[1:2],
                               harmonics.phong(exponents[0, 1:2], 4), 1e-15)  # fmt: skip


@pytest.mark.parametrize("exponent", [-1.0, -3.0, np.nan, np.inf, [2.0, -1.5]])
def test_an_exponent_is_above_minus_one(exponent):
    with pytest.raises(ValueError, match="exponent must be finite and above -1, got"):
        harmonics.phong(np.asarray(exponent), 3)


def test_convolution_is_the_integral(rng):
    """(f * g)(n) = ∫ f(ω) g(ω·n) dω for a random function and a random kernel."""
    degree = 5
    f, zonal = rng.normal(size=36), rng.normal(size=6)
    directions, weights = oracles.product_grid(2 * degree)
    normals = oracles.unit_vectors(rng, 30)
    l = np.arange(degree + 1)
    cosine = normals @ directions.T
    kernel = sum(
        zonal[i] * np.sqrt((2 * i + 1) / (4 * np.pi)) * eval_legendre(i, cosine) for i in l
    )
    expected = kernel @ (weights * (oracles.scipy_basis(directions, degree) @ f))
    result = oracles.scipy_basis(normals, degree) @ np.asarray(harmonics.convolve(f, zonal))
    np.testing.assert_allclose(result, expected, 0, 2e-14)


def test_convolving_an_impulse_moves_the_kernel_there(rng):
    """A delta at ω0 leaves the truncated lobe Σ (2l+1)/4π λ_l P_l(cos γ) about it."""
    degree, (source,) = 9, oracles.unit_vectors(rng, 1)
    light = harmonics.evaluate(source, degree)
    lobe = harmonics.convolve(light, harmonics.clamped_cosine(degree))
    directions = oracles.unit_vectors(rng, 50)
    terms = [
        (2 * l + 1) / (4 * np.pi) * slow_lambda(1.0, l) * eval_legendre(l, directions @ source)
        for l in range(degree + 1)
    ]
    value = oracles.scipy_basis(directions, degree) @ np.asarray(lobe)
    np.testing.assert_allclose(value, np.sum(terms, 0), 0, 1e-13)
    # and so near the clamped cosine, but for the bands cut off
    assert np.abs(value - np.maximum(directions @ source, 0)).max() < 0.03


def test_furnace():
    light = np.zeros((3, 16))
    light[:, 0] = np.sqrt(4 * np.pi) * np.array([1, 2, 3])  # constant radiance
    irradiance = harmonics.convolve(light, harmonics.clamped_cosine(3))
    np.testing.assert_allclose(irradiance, np.pi * light, 1e-15)
    blurred = harmonics.convolve(light, harmonics.phong(17.5, 3, normalized=True))
    np.testing.assert_allclose(blurred, light, 1e-15)


def test_convolution_commutes_with_rotation(rng):
    f, (r,) = rng.normal(size=25), oracles.rotations(rng, 1)
    kernel = harmonics.phong(3.0, 4)
    a = harmonics.rotate(harmonics.convolve(f, kernel), r)
    np.testing.assert_allclose(a, harmonics.convolve(harmonics.rotate(f, r), kernel), 0, 4e-15)


def test_convolution_broadcasts_and_differentiates(rng):
    f, kernels = rng.normal(size=(2, 1, 9)), rng.normal(size=(4, 3))
    out = harmonics.convolve(f, kernels)
    assert out.shape == (2, 4, 9)
    np.testing.assert_allclose(out[1, 2], harmonics.convolve(f[1, 0], kernels[2]), 1e-15)
    assert harmonics.convolve(f[0, 0], kernels).shape == (4, 9)
    single = harmonics.convolve(f.astype(np.float32), kernels)
    assert single.dtype == np.float32
    np.testing.assert_allclose(jax.jit(harmonics.convolve)(f, kernels), out, 1e-15)
    check_grads(harmonics.convolve, (f, kernels), order=1, modes=["fwd", "rev"], rtol=1e-7)


def test_bad_kernels_are_refused(unchecked):
    with pytest.raises(
        ValueError, match=r"degree 2 need a zonal kernel \(\.\.\., 3\).*shape \(4,\)"
    ):
        harmonics.convolve(np.ones(9), np.ones(4))
    with pytest.raises(ValueError, match=r"degree 2 need a zonal kernel \(\.\.\., 3\).*shape \(\)"):
        harmonics.convolve(np.ones(9), 1.0)
    with pytest.raises(ValueError, match=r"1, 4, 9, 16.*got shape .*8,?\)"):
        harmonics.convolve(np.ones(8), np.ones(3))


@pytest.mark.parametrize("radius", [0.2666 * np.pi / 180, 0.1, 1.2, np.pi])
def test_disc_by_quadrature(radius):
    """Gauss–Legendre in the depth 1 - cos θ, which keeps the digits of a small disc."""
    depth = 2 * np.sin(radius / 2) ** 2
    node, weight = np.polynomial.legendre.leggauss(12)
    fall = depth * (1 - node) / 2
    expected = [np.pi * depth * weight @ eval_legendre(l, 1 - fall) for l in range(13)]
    found = lambdas(harmonics.disc(2 * np.pi * depth, 12))
    np.testing.assert_allclose(found, expected, 0, 2e-14 * expected[0])
    single = harmonics.disc(np.float32(2 * np.pi * depth), 12)
    assert single.dtype == np.float32
    np.testing.assert_allclose(lambdas(single), expected, 0, 2e-6 * expected[0])


def test_disc_derivative_and_refusal():
    """The derivative of ∫ P_l over the disc is P_l at its rim."""
    areas = np.array([0.01, 2.0])
    _, slope = jax.jvp(lambda a: harmonics.disc(a, 6), (areas,), (np.ones(2),))
    rim = eval_legendre(np.arange(7), 1 - areas[:, None] / (2 * np.pi))
    np.testing.assert_allclose(lambdas(slope), rim, 0, 1e-14)
    with pytest.raises(ValueError, match="expected solid_angle from 0 to 4π, got 13"):
        harmonics.disc(13.0, 2)
