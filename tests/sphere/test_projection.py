"""From samples to coefficients and back."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from fields import basis, dense_project, exponential, exponential_coefficients, unit_vectors
from jax.test_util import check_grads

from jaxsh import harmonics, sphere


@pytest.mark.parametrize("count", [1, 2048, 2049, pytest.param(5000, marks=pytest.mark.slow)])
def test_project_is_the_dense_sum_around_block_boundaries(count, rng):
    """Random weights and directions of any length: nothing cancels."""
    quadrature = sphere.Quadrature(
        jnp.asarray(rng.normal(size=(count, 3))), jnp.asarray(rng.uniform(1, 2, count) / count)
    )
    values = rng.normal(size=(2, count))
    result = sphere.project(values, quadrature, 4)
    np.testing.assert_allclose(result, dense_project(values, quadrature, 4), 0, 1e-14)


@pytest.mark.parametrize("count", [1, 2048, 2049, pytest.param(5000, marks=pytest.mark.slow)])
def test_reconstruct_is_the_dense_sum_around_block_boundaries(count, rng):
    directions, c = rng.normal(size=(count, 3)), rng.normal(size=(2, 25))
    expected = c @ basis(directions, 4).T
    np.testing.assert_allclose(sphere.reconstruct(c, directions), expected, 0, 1e-14)


@pytest.mark.parametrize(
    ("quadrature", "degree", "error"),
    [
        (sphere.gauss_legendre(40), 10, 1e-13),  # exp(a·ω) has degree 30 to rounding
        (sphere.lat_long(41, 42), 10, 1e-13),
        (sphere.fibonacci(20000), 4, 4e-5),
        (sphere.cube_map(64), 4, 2e-3),
    ],
    ids=["gauss_legendre", "lat_long", "fibonacci", "cube_map"],
)
def test_project_a_known_function(quadrature, degree, error):
    axis = np.array([0.7, -1.2, 1.9])
    values = exponential(axis)(quadrature.directions)
    expected = exponential_coefficients(axis, degree)
    np.testing.assert_allclose(sphere.project(values, quadrature, degree), expected, 0, error)


@pytest.mark.parametrize("degree", [0, 9])
def test_project_inverts_reconstruct(degree, rng):
    c = rng.normal(size=(3, (degree + 1) ** 2))
    quadrature = sphere.gauss_legendre(2 * degree)
    values = sphere.reconstruct(c, quadrature.directions)
    assert values.shape == (3, len(quadrature.weights))
    np.testing.assert_allclose(sphere.project(values, quadrature, degree), c, 0, 2e-14)


def test_parseval(rng):
    c = rng.normal(size=36)
    quadrature = sphere.gauss_legendre(10)
    values = np.asarray(sphere.reconstruct(c, quadrature.directions))
    assert values**2 @ np.asarray(quadrature.weights) == pytest.approx(c @ c, rel=1e-14)


def test_projecting_the_turned_function_turns_the_coefficients(rng):
    """project(f(Rᵀω)) = rotate(project(f)): every convention at once."""
    r, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    r *= np.linalg.det(r)
    quadrature, axis = sphere.gauss_legendre(40), np.array([0.4, -1.0, 1.5])
    directions = np.asarray(quadrature.directions)

    def f(d):
        return np.exp(d @ axis) * (1 + d[:, 0]) - d[:, 1] ** 3

    turned = sphere.project(f(directions @ r), quadrature, 6)
    expected = harmonics.rotate(sphere.project(f(directions), quadrature, 6), r)
    np.testing.assert_allclose(turned, expected, 0, 1e-13)


def test_furnace_and_impulse(rng):
    """A constant light L gives irradiance πL everywhere; a small source the cosine lobe."""
    quadrature = sphere.gauss_legendre(8)
    radiance = np.array([1.0, 2.0, 0.5])[:, None] * np.ones(len(quadrature.weights))
    light = sphere.project(radiance, quadrature, 4)
    normals = unit_vectors(rng, 20)
    irradiance = harmonics.convolve(light, harmonics.clamped_cosine(4))
    expected = np.pi * np.array([1.0, 2.0, 0.5])[:, None] * np.ones(20)
    np.testing.assert_allclose(sphere.reconstruct(irradiance, normals), expected, 1e-14)

    (source,) = unit_vectors(rng, 1)
    one = sphere.Quadrature(jnp.asarray(source[None]), jnp.asarray([0.25]))  # 0.25 sr
    light = sphere.project(np.array([8.0]), one, 4)
    lobe = harmonics.convolve(light, harmonics.clamped_cosine(4))
    x = normals @ source
    truncated = 0.25 + x / 2 + 5 / 16 * (3 * x**2 - 1) / 2
    truncated -= 3 / 32 * (35 * x**4 - 30 * x**2 + 3) / 8
    np.testing.assert_allclose(sphere.reconstruct(lobe, normals), 2 * truncated, 0, 1e-14)


@pytest.mark.parametrize("batch", [(), (2, 1, 3)])
@pytest.mark.parametrize("degree", [0, 2])
def test_batches(batch, degree, rng):
    quadrature = sphere.gauss_legendre(4)
    values = rng.normal(size=(*batch, len(quadrature.weights)))
    c = sphere.project(values, quadrature, degree)
    assert c.shape == (*batch, (degree + 1) ** 2)
    np.testing.assert_allclose(c, dense_project(values, quadrature, degree), 0, 1e-14)
    assert sphere.reconstruct(c, quadrature.directions).shape == values.shape


def test_empty_batches():
    quadrature = sphere.gauss_legendre(4)
    assert sphere.project(np.zeros((0, 15)), quadrature, 2).shape == (0, 9)
    assert sphere.reconstruct(np.zeros((0, 9)), quadrature.directions).shape == (0, 15)


def test_reconstruct_nowhere():
    assert sphere.reconstruct(np.ones((2, 9)), np.zeros((0, 3))).shape == (2, 0)


def test_dtype_is_that_of_the_values(rng, unchecked):
    quadrature = sphere.gauss_legendre(12)
    values = rng.normal(size=len(quadrature.weights))
    expected = sphere.project(values, quadrature, 6)
    single = sphere.project(values.astype(np.float32), quadrature, 6)
    assert (single.dtype, expected.dtype) == (jnp.float32, jnp.float64)
    np.testing.assert_allclose(single, expected, 0, 2e-6)
    back = sphere.reconstruct(single, quadrature.directions)
    assert back.dtype == jnp.float32
    np.testing.assert_allclose(back, sphere.reconstruct(expected, quadrature.directions), 0, 1e-5)
    whole = sphere.project(np.ones(len(values), int), quadrature, 1)
    np.testing.assert_allclose(whole, [np.sqrt(4 * np.pi), 0, 0, 0], 0, 1e-14)
    listed = sphere.project([1] * len(values), quadrature, 1)
    np.testing.assert_array_equal(listed, whole)


@pytest.fixture
def small(rng):
    """More than one block, so that the padding takes part."""
    count = 2050
    directions, weights = rng.normal(size=(count, 3)), rng.uniform(1, 2, count) / count
    return rng.normal(size=count), directions, weights, rng.normal(size=(2, 9))


def test_derivatives_of_project(small):
    values, directions, weights, _ = small

    def f(values, directions, weights):
        return sphere.project(
            values, sphere.Quadrature(jnp.asarray(directions), jnp.asarray(weights)), 2
        )

    arguments = tuple(jnp.asarray(a) for a in (values, directions, weights))
    check_grads(f, arguments, order=1, modes=["fwd", "rev"], rtol=1e-5)
    # by the analytic gradient, direction by direction
    pull = np.linspace(-1, 1, 9)
    found = jax.grad(lambda d: jnp.dot(jnp.asarray(pull), f(values, d, weights)))(directions)
    _, gradient = harmonics.evaluate_with_gradient(directions, 2)
    expected = np.einsum("n,n,nkx,k->nx", values, weights, gradient, pull)
    np.testing.assert_allclose(found, expected, 0, 1e-15 + 1e-13 * np.abs(expected).max())


def test_derivatives_of_reconstruct(small):
    values, directions, _, c = small
    check_grads(sphere.reconstruct, (c, directions), order=1, modes=["fwd", "rev"], rtol=1e-5)

    def loss(c, d):
        return jnp.sum(jnp.asarray(values) * sphere.reconstruct(c, d)[0])

    dc, dd = jax.grad(loss, (0, 1))(jnp.asarray(c), jnp.asarray(directions))
    y, gradient = harmonics.evaluate_with_gradient(directions, 2)
    np.testing.assert_allclose(dc[0], values @ np.asarray(y), 0, 1e-11)
    assert not dc[1].any()
    expected = np.einsum("n,nkx,k->nx", values, gradient, c[0])
    np.testing.assert_allclose(dd, expected, 0, 1e-13 * np.abs(expected).max())


def test_second_derivatives_at_the_poles():
    c = np.linspace(-1, 1, 9)
    expected = jax.jit(jax.hessian(lambda s: c @ harmonics.evaluate(s, 2)))
    found = jax.jit(jax.jacrev(jax.grad(lambda s: sphere.reconstruct(c, s[None])[0])))
    for pole in np.array([[0, 0, 1.0], [0, 0, -1.0]]):
        np.testing.assert_allclose(found(pole), expected(pole), 0, 1e-14)
        assert np.abs(expected(pole)).max() > 0.1


def test_jit_and_vmap_agree(rng):
    quadrature = sphere.gauss_legendre(6)
    values = rng.normal(size=(4, len(quadrature.weights)))
    expected = sphere.project(values, quadrature, 3)
    f = functools.partial(sphere.project, quadrature=quadrature, degree=3)
    for g in (jax.jit(f), jax.jit(jax.vmap(f))):
        np.testing.assert_allclose(g(values), expected, 0, 1e-14)
    back = sphere.reconstruct(expected, quadrature.directions)
    g = jax.vmap(sphere.reconstruct, in_axes=(0, None))
    np.testing.assert_allclose(g(expected, quadrature.directions), back, 0, 1e-14)
    turned = jax.vmap(sphere.reconstruct, in_axes=(None, 0))(
        expected[0], jnp.stack([quadrature.directions, -quadrature.directions])
    )
    np.testing.assert_allclose(turned[0], back[0], 0, 1e-14)


@pytest.mark.parametrize("what", ["project", "project vjp", "reconstruct", "reconstruct vjp"])
def test_the_basis_is_never_held(what):
    """Scratch memory at 200,000 directions and degree 10, against the basis' 97 MB in float32."""
    count, degree = 200_000, 10
    whole_basis = 4 * count * (degree + 1) ** 2
    shape = functools.partial(jax.ShapeDtypeStruct, dtype=jnp.float32)
    values, directions, weights, c = (
        shape(s) for s in ((3, count), (count, 3), (count,), (3, (degree + 1) ** 2))
    )

    def project(values, directions, weights):
        return sphere.project(values, sphere.Quadrature(directions, weights), degree)

    def pulled_back(f):
        def gradient(*arguments):
            out, pull = jax.vjp(f, *arguments)
            return pull(out)

        return gradient

    f, arguments = {
        "project": (project, (values, directions, weights)),
        "reconstruct": (sphere.reconstruct, (c, directions)),
    }[what.split()[0]]
    compiled = jax.jit(pulled_back(f) if "vjp" in what else f).lower(*arguments).compile()
    # The data themselves, copied into blocks a few times, are 2.4 MB each.
    assert compiled.memory_analysis().temp_size_in_bytes < 0.25 * whole_basis


def test_bad_input_is_refused(unchecked):
    quadrature = sphere.gauss_legendre(2)  # 6 directions
    for values in (np.ones(5), np.ones((6, 2)), 1.0):
        with pytest.raises(ValueError, match=r"values \(\.\.\., 6\), one per direction, got shape"):
            sphere.project(values, quadrature, 1)
    with pytest.raises(ValueError, match=r"degree must be an integer >= 0.*got -1"):
        sphere.project(np.ones(6), quadrature, -1)
    with pytest.raises(ValueError, match=r"1, 4, 9, 16.*got shape .*8,?\)"):
        sphere.reconstruct(np.ones(8), quadrature.directions)
    with pytest.raises(ValueError, match=r"1, 4, 9, 16.*got shape \(\)"):
        sphere.reconstruct(1.0, quadrature.directions)
    for directions in (np.ones((2, 4)), np.ones(3), np.ones((2, 2, 3))):
        with pytest.raises(ValueError, match=r"expected directions \(N, 3\), got shape"):
            sphere.reconstruct(np.ones(9), directions)
