"""Suns: their rays and coefficients against discs integrated by quadrature, and against turns."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads

from jaxsh import harmonics, sphere

SUN = np.array([[0.48, 0.6, 0.64]])


def rotation(rng):
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return turn * np.linalg.det(turn)


def shaped(rng, dtype=np.float64, count=3, rays=8):
    shape = rng.normal(size=(count, rays, 3)) * (0.2, 0.2, 0) + (0, 0, 1)
    shape /= np.linalg.norm(shape, axis=-1, keepdims=True)
    arrays = rng.normal(size=(count, 3)), rng.uniform(0.1, 0.2, count), rng.random((count, 3))
    return sphere.Suns(*(a.astype(dtype) for a in (*arrays, shape)))


@pytest.mark.parametrize("direction", [(0, 0, 1), (0, 0, -1), (-0.6, 0.8, 0), (0.48, 0.6, -0.64)])
def test_many_rays_are_the_disc(direction):
    """Rays are within the disc, and their mean over the basis is the disc's closed form."""
    suns = sphere.Suns([direction], [0.3], [[1.0, 2.0, 0.5]])
    rays = np.asarray(suns.rays(4096))[0]
    np.testing.assert_allclose(np.linalg.norm(rays, axis=-1), 1, rtol=1e-14)
    cosine = rays @ direction
    assert 1 - 0.3 / (2 * np.pi) < cosine.min() < 1 - 0.299 / (2 * np.pi)
    expected = harmonics.evaluate(rays, 3).mean(axis=0) * 0.3
    found = suns.harmonics(3)
    np.testing.assert_allclose(found[0], expected, rtol=0, atol=2e-5)
    np.testing.assert_allclose(found[1:], np.outer([2.0, 0.5], found[0]), rtol=0, atol=1e-15)
    np.testing.assert_allclose(suns.irradiance, [[0.3, 0.6, 0.15]], rtol=1e-15)


@pytest.mark.parametrize(
    ("dtype", "error"),
    [(np.float64, 2e-15), pytest.param(np.float32, 2e-6, marks=pytest.mark.slow)],
)
def test_turned_suns_have_turned_coefficients(dtype, error, rng):
    suns, turn = shaped(rng, dtype), rotation(rng)
    found = suns.rotate(turn)
    assert found.rays().dtype == found.harmonics(3).dtype == dtype
    expected = harmonics.rotate(suns.harmonics(3), turn)
    np.testing.assert_allclose(found.harmonics(3), expected, rtol=0, atol=error)
    np.testing.assert_allclose(found.rays(), np.asarray(suns.rays()) @ turn.T, rtol=0, atol=error)


def test_a_shape_follows_its_direction(rng):
    """As far from the middle as it was, wherever the middle goes."""
    suns = shaped(rng)
    moved = sphere.Suns(-suns.direction, suns.solid_angle, suns.radiance, suns.shape)
    for each in (suns, moved):
        middle = each.direction / jnp.linalg.norm(each.direction, axis=-1, keepdims=True)
        cosine = jnp.einsum("snj,sj->sn", each.rays(), middle)
        np.testing.assert_allclose(cosine, suns.shape[..., 2], rtol=0, atol=1e-15)


def test_a_direction_has_any_length(rng):
    """Also one whose square is none in float32."""
    suns = shaped(rng, np.float32)
    expected = suns.rays(4)
    for length in (1e-25, 1e25):
        far = np.float32(length) * np.asarray(suns.direction)
        found = sphere.Suns(far, suns.solid_angle, suns.radiance, suns.shape).rays(4)
        np.testing.assert_allclose(found, expected, rtol=0, atol=5e-7)


def test_fewer_rays_are_middles_of_neighbors(rng):
    suns = shaped(rng)
    middle = suns.rays().reshape(3, 4, 2, 3).sum(axis=2)
    middle /= jnp.linalg.norm(middle, axis=-1, keepdims=True)
    np.testing.assert_allclose(suns.rays(4), middle, rtol=0, atol=1e-15)
    with pytest.raises(ValueError, match="count must divide the 8 vectors"):
        suns.rays(3)


def test_no_suns_are_dark():
    none = sphere.Suns(jnp.zeros((0, 3)), jnp.zeros(0), jnp.zeros((0, 3)))
    assert none.rays().shape == (0, 16, 3)
    np.testing.assert_array_equal(none.harmonics(2), np.zeros((3, 9)))


@pytest.mark.slow
def test_derivatives_jit_and_vmap(rng):
    suns = shaped(rng, count=2)

    def shaded(direction, radiance, shape, degree=2):
        made = sphere.Suns(direction, suns.solid_angle, radiance, shape)
        return made.harmonics(degree), made.rays(4)

    check_grads(lambda d, r: shaded(d, r, suns.shape), (suns.direction, suns.radiance), 1)
    check_grads(lambda d, r: shaded(d, r, None), (suns.direction, suns.radiance), 1)
    arguments = suns.direction, suns.radiance, suns.shape
    for got, expected in zip(jax.jit(shaded)(*arguments), shaded(*arguments), strict=True):
        np.testing.assert_allclose(got, expected, rtol=0, atol=1e-15)
    many = jax.vmap(lambda s: s.harmonics(1))(jax.tree.map(lambda a: jnp.stack([a, a]), suns))
    np.testing.assert_allclose(many[1], suns.harmonics(1), rtol=0, atol=1e-15)


def test_shapes_that_do_not_fit_are_refused():
    with pytest.raises(ValueError, match=r"expected direction \(S, 3\), solid_angle \(S,\)"):
        sphere.Suns([[0.0, 0.0, 1.0]], [0.1, 0.1], [[1.0, 1.0, 1.0]])
    with pytest.raises(ValueError, match=r"expected shape of 1 suns as \(1, N, 3\)"):
        sphere.Suns([[0.0, 0.0, 1.0]], [0.1], [[1.0, 1.0, 1.0]], np.ones((2, 4, 3)))
