"""Unshadowed transfer against quadrature, finite differences and JAX's own derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsh import harmonics
from jaxsh.transfer import Material, shade_diffuse, shade_glossy, unshadowed

EYE = np.array([0.3, -2.0, 1.5])


def unit(rng, count=5):
    normals = rng.normal(size=(count, 3))
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def by_quadrature(normal, degree):
    """∫ max(0, n·ω) y_i over the normal's own hemisphere, exact to rounding."""
    nodes, weights = np.polynomial.legendre.leggauss(24)
    z, phi = (nodes + 1) / 2, 2 * np.pi * np.arange(40) / 40
    r = np.sqrt(1 - z**2)[:, None]
    local = np.stack(np.broadcast_arrays(r * np.cos(phi), r * np.sin(phi), z[:, None]), -1)
    weights = np.repeat(weights / 2 * z * 2 * np.pi / len(phi), len(phi))
    turn, _ = np.linalg.qr(np.column_stack([normal, np.eye(3)[:, :2]]))
    turn = np.column_stack([turn[:, 1], turn[:, 2], normal])
    directions = local.reshape(-1, 3) @ turn.T
    return weights @ np.asarray(harmonics.evaluate(directions, degree))


@pytest.mark.parametrize(("dtype", "atol"), [(np.float32, 2e-7), (np.float64, 5e-15)])
def test_coefficients_are_the_integral(rng, dtype, atol):
    normals = unit(rng)
    made = unshadowed(np.zeros((5, 3), dtype), (3 * normals).astype(dtype), 6)
    assert made.dtype == dtype
    exact = np.stack([by_quadrature(normal, 6) for normal in normals])
    np.testing.assert_allclose(made.coefficients, exact, rtol=0, atol=atol)
    np.testing.assert_array_equal(made.neighbors, np.arange(5)[:, None])


def test_derivatives_in_the_normals_to_second_order(rng):
    positions, normals = jnp.asarray(rng.normal(size=(3, 3))), jnp.asarray(2 * unit(rng, 3))
    light = jnp.asarray(rng.normal(size=(3, 9)))
    step = jnp.asarray(rng.normal(size=(3, 3)))

    def leaving(normals):
        return shade_diffuse(light, unshadowed(positions, normals, 2), 0.5)

    @jax.jit
    def derivatives(normals):
        slopes, forward = jax.jacrev(leaving)(normals), jax.jacfwd(leaving)(normals)
        curved = jax.jvp(jax.jacrev(leaving), (normals,), (step,))[1]
        return leaving(normals), slopes, forward, curved

    _, slopes, forward, curved = derivatives(normals)
    np.testing.assert_allclose(slopes, forward, rtol=0, atol=1e-14)
    (low, low_slopes, *_), (high, high_slopes, *_) = (
        derivatives(normals + t * step) for t in (-1e-5, 1e-5)
    )
    for exact, difference in (
        (jnp.tensordot(slopes, step, 2), high - low),
        (curved, high_slopes - low_slopes),
    ):
        scale = np.abs(exact).max()
        assert scale > 0.1
        np.testing.assert_allclose(difference / 2e-5, exact, rtol=0, atol=1e-7 * scale)


def test_a_bake_s_coefficients_do_not_follow_the_normals(rng):
    """What the docstring of `Transfer` warns of; glossy light follows them through B alone."""
    light, normals = jnp.asarray(rng.normal(size=(3, 9))), jnp.asarray(unit(rng))
    baked = unshadowed(normals, normals, 2).coefficients

    def shading(shade, normals):
        made = unshadowed(jnp.zeros((5, 3)), normals, 2)
        fixed = type(made)(baked, made.positions, made.normals, made.neighbors)
        return jnp.sum(shade(fixed))

    diffuse = jax.grad(lambda n: shading(lambda t: shade_diffuse(light, t, 0.5), n))(normals)
    np.testing.assert_array_equal(diffuse, 0)
    material = Material(0.5, 0.5, 8.0)
    glossy = jax.grad(lambda n: shading(lambda t: shade_glossy(light, t, EYE, material), n))(
        normals
    )
    assert np.abs(glossy).max() > 0


def test_undefined_normals_have_no_transfer_and_no_slope():
    normals = jnp.asarray([[0, 0, 0.0], [np.nan, 0, 1], [np.inf, 0, 0], [0, 0, 2]])

    def total(normals):
        return jnp.sum(unshadowed(jnp.zeros((4, 3)), normals, 2).coefficients ** 2)

    made = unshadowed(jnp.zeros((4, 3)), normals, 2)
    np.testing.assert_array_equal(made.coefficients[:3], 0)
    assert made.coefficients[3, 0] == pytest.approx(np.sqrt(np.pi) / 2)
    np.testing.assert_array_equal(jax.grad(total)(normals)[:3], 0)


def test_normals_in_a_batch(rng):
    normals = jnp.asarray(unit(rng, 6).reshape(2, 3, 3))
    mapped = jax.jit(jax.vmap(lambda n: unshadowed(0 * n, n, 2).coefficients))(normals)
    flat = unshadowed(jnp.zeros((6, 3)), normals.reshape(6, 3), 2).coefficients
    np.testing.assert_allclose(mapped.reshape(6, 9), flat, rtol=0, atol=1e-15)


def test_shapes_that_do_not_fit_are_refused(unchecked):
    with pytest.raises(ValueError, match=r"positions and normals \(V, 3\), got .*\(3, 3\)"):
        unshadowed(np.ones((2, 3)), np.ones((3, 3)), 2)
    with pytest.raises(ValueError, match="degree must be an integer"):
        unshadowed(np.ones((2, 3)), np.ones((2, 3)), -1)
    with pytest.raises(ValueError, match=r"expected neighbors \(2, n\), got shape \(3, 1\)"):
        unshadowed(np.ones((2, 3)), np.ones((2, 3)), 2, neighbors=np.zeros((3, 1), int))
