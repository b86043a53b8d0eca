"""Irradiance at normals, without shadows."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from fields import basis, unit_vectors
from jax.test_util import check_grads

from jaxsh import harmonics, sphere

# π, 2π/3, π/4, 0, -π/24, 0, π/64: Ramamoorthi & Hanrahan 2001, eq. 8 and 9.
LAMBDAS = np.pi * np.array([1, 2 / 3, 1 / 4, 0, -1 / 24, 0, 1 / 64])
COUNT = 5  # normals


def slow(light, normals):
    """Σ_lm λ_l L_lm y_lm(n), (C, K), (V, 3) -> (V, C)."""
    degree = harmonics.degree_of(np.shape(light)[-1])
    unit = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
    return basis(unit, degree) @ (np.asarray(light) * LAMBDAS[harmonics.degrees(degree)]).T


def test_it_is_the_integral_of_radiance_and_cosine(rng):
    """Over one hemisphere exactly: Gauss–Legendre from 0 to 1 along each normal."""
    light, normals = rng.normal(size=(2, 49)), unit_vectors(rng, COUNT)
    z, weights = np.polynomial.legendre.leggauss(12)
    z, weights = (z + 1) / 2, weights / 2
    phi = 2 * np.pi * np.arange(14) / 14
    ring = np.sqrt(1 - z**2)[:, None]
    local = np.stack([ring * np.cos(phi), ring * np.sin(phi), z[:, None] + 0 * phi], axis=-1)
    found = np.asarray(sphere.irradiance(light, normals))
    assert found.shape == (COUNT, 2)
    for normal, value in zip(normals, found, strict=True):
        frame = np.linalg.qr(np.stack([normal, *rng.normal(size=(2, 3))], axis=-1))[0]
        directions = local @ np.stack([frame[:, 1], frame[:, 2], normal])
        radiance = basis(directions.reshape(-1, 3), 6) @ light.T
        cosine = np.repeat(z * weights, 14) * 2 * np.pi / 14
        np.testing.assert_allclose(value, cosine @ radiance, 0, 2e-14)


@pytest.mark.parametrize(("dtype", "error"), [("float64", 4e-15), ("float32", 2e-6)])
@pytest.mark.parametrize("degree", [0, 6])
def test_it_is_the_sum_over_bands(degree, dtype, error, rng):
    light = rng.normal(size=(3, (degree + 1) ** 2)).astype(dtype)
    normals = rng.normal(size=(COUNT, 3)).astype(dtype)  # of any length
    found = sphere.irradiance(light, normals)
    assert (found.shape, found.dtype) == ((COUNT, 3), dtype)
    scale = np.linalg.norm(light)
    expected = slow(light.astype(float), normals.astype(float))
    np.testing.assert_allclose(found / scale, expected / scale, 0, error)
    longer = sphere.irradiance(light, 4 * normals)
    np.testing.assert_array_equal(longer, found)


def test_closed_forms():
    """A constant, and one along an axis: π L and 2π/3 of its cosine; a far light's cosine lobe."""
    c = np.zeros(9)
    c[0], c[3] = 2 * np.sqrt(4 * np.pi), 3 * np.sqrt(4 * np.pi / 3)  # 2 + 3 x
    normals = np.array([[1.0, 0, 0], [0, -3, 4], [-0.6, 0.8, 0]])
    expected = 2 * np.pi + 2 * np.pi * np.array([1, 0, -0.6])
    np.testing.assert_allclose(sphere.irradiance(c, normals), expected, 1e-14)
    impulse = harmonics.evaluate(np.array([0.0, 0.0, 1.0]), 2)
    x = np.array([0.0, 0.8, 0.0])
    lobe = 0.25 + x / 2 + 5 / 32 * (3 * x**2 - 1)
    np.testing.assert_allclose(sphere.irradiance(impulse, normals), lobe, 1e-14)


def test_axes_of_lights_broadcast_against_those_of_normals(rng):
    lights, normals = rng.normal(size=(2, COUNT, 3, 9)), rng.normal(size=(COUNT, 3))
    expected = np.stack(
        [[slow(light, n[None])[0] for light, n in zip(b, normals, strict=True)] for b in lights]
    )
    error = {"rtol": 0, "atol": 2e-14}
    each = sphere.irradiance(lights, normals)
    np.testing.assert_allclose(each, expected, **error)
    np.testing.assert_allclose(sphere.irradiance(lights[0], normals), expected[0], **error)
    shared = sphere.irradiance(lights[:, :1], normals)  # (2, 1, 3, 9): two shared lights
    assert shared.shape == (2, COUNT, 3)
    np.testing.assert_allclose(shared[1], slow(lights[1, 0], normals), **error)
    grid = sphere.irradiance(lights[0, 0], np.stack([normals, 2 * normals]))
    assert grid.shape == (2, COUNT, 3)
    np.testing.assert_allclose(grid[1], slow(lights[0, 0], normals), **error)
    assert sphere.irradiance(lights[:, :1, 0], normals[0]).shape == (2, 1)
    one = sphere.irradiance(lights[0, 0], normals[0])
    np.testing.assert_allclose(one, slow(lights[0, 0], normals[:1])[0], **error)
    assert sphere.irradiance(lights[0, 0, 0], normals).shape == (COUNT,)
    assert sphere.irradiance(lights[0, 0, 0], normals[0]).shape == ()
    assert sphere.irradiance(lights[0, 0], np.zeros((0, 3))).shape == (0, 3)


@pytest.mark.parametrize("each", [False, True])
def test_first_derivatives(each, rng):
    light = rng.normal(size=(COUNT, 2, 9) if each else (2, 9))
    normals = np.concatenate([rng.normal(size=(COUNT - 2, 3)), np.diag([0.0, 2.0, -0.5])[1:]])
    check_grads(sphere.irradiance, (light, normals), order=1, modes=["fwd", "rev"], rtol=1e-6)
    radial = jax.jit(lambda n: jax.jvp(lambda n: sphere.irradiance(light, n), (n,), (n,))[1])
    np.testing.assert_allclose(radial(normals), 0, 0, 1e-13)


def test_second_derivatives(rng):
    """Forward over reverse, at a pole too, against five points of the slow sum's gradient."""
    light, pull = rng.normal(size=(2, 9)), rng.normal(size=(3, 2))
    normals = np.array([[0.3, -1.0, 2.0], [0.0, 0.0, -0.5], [1.0, 1.0, 0.0]])

    def loss(light, n):
        return jnp.sum(pull * sphere.irradiance(light, n))

    of_light, of_normals = jax.jit(jax.jacfwd(jax.grad(loss, 1), (0, 1)))(light, normals)
    lambdas = LAMBDAS[harmonics.degrees(2)]

    def slow_slope(n):
        _, gradient = harmonics.evaluate_with_gradient(n, 2)
        return np.einsum("vc,ck,vkx->vx", pull, light * lambdas, gradient)

    for axis in range(3):
        moved = {k: slow_slope(normals + 1e-3 * k * np.eye(3)[axis]) for k in (-2, -1, 1, 2)}
        expected = (moved[-2] - 8 * moved[-1] + 8 * moved[1] - moved[2]) / 12e-3
        found = np.stack([of_normals[i, :, i, axis] for i in range(3)])
        np.testing.assert_allclose(found, expected, 0, 1e-8 * np.abs(expected).max())
    _, gradient = harmonics.evaluate_with_gradient(normals, 2)
    expected = np.einsum("vc,k,vkx->vxck", pull, lambdas, gradient)
    np.testing.assert_allclose(of_light, expected, 0, 1e-13)


def test_many_normals_go_in_blocks_unnoticed(rng):
    light, normals = rng.normal(size=(3, 9)), rng.normal(size=(2050, 3))
    np.testing.assert_allclose(sphere.irradiance(light, normals), slow(light, normals), 0, 3e-14)
    pull = rng.normal(size=(2050, 3))

    def loss(light, normals):
        return jnp.sum(pull * sphere.irradiance(light, normals))

    of_light, of_normals = jax.jit(jax.grad(loss, (0, 1)))(light, normals)
    unit = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
    lambdas = LAMBDAS[harmonics.degrees(2)]
    np.testing.assert_allclose(of_light, lambdas * (pull.T @ basis(unit, 2)), 0, 1e-11)
    _, gradient = harmonics.evaluate_with_gradient(normals, 2)
    expected = np.einsum("nc,ck,nkx->nx", pull, light * lambdas, gradient)
    np.testing.assert_allclose(of_normals, expected, 0, 1e-13 * np.abs(expected).max())


def test_jit_and_vmap_agree(rng):
    lights, normals = rng.normal(size=(COUNT, 3, 9)), rng.normal(size=(COUNT, 3))
    expected = sphere.irradiance(lights, normals)
    for f in (jax.jit(sphere.irradiance), jax.jit(jax.vmap(sphere.irradiance))):
        np.testing.assert_allclose(f(lights, normals), expected, 0, 1e-14)


def test_a_zero_normal_has_no_irradiance():
    assert np.isnan(sphere.irradiance(np.ones((3, 4)), np.zeros((1, 3)))).all()


def test_bad_input_is_refused(unchecked):
    with pytest.raises(ValueError, match=r"1, 4, 9, 16.*got shape .*8,?\)"):
        sphere.irradiance(np.ones((3, 8)), np.ones((2, 3)))
    with pytest.raises(ValueError, match=r"1, 4, 9, 16.*got shape \(\)"):
        sphere.irradiance(1.0, np.ones((2, 3)))
    for normals in (np.ones((2, 4)), 1.0):
        with pytest.raises(ValueError, match=r"expected normals \(\.\.\., 3\).*got shape"):
            sphere.irradiance(np.ones((3, 9)), normals)
    with pytest.raises(
        ValueError, match=r"must broadcast, got light \(4, 3, 9\).*normals \(2, 3\)"
    ):
        sphere.irradiance(np.ones((4, 3, 9)), np.ones((2, 3)))
