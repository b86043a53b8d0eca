"""Fits of vertices that two devices share: the same answer, and neither gets all the vertices."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.sharding import AxisType, NamedSharding
from jax.sharding import PartitionSpec as P
from sharding import collectives, longest_exchange

from jaxsh import inverse, transfer
from jaxsh.inverse._solve import triangle
from jaxsh.midrange import Polygon, polygon_harmonics

COUNT = 64
KINDS = AxisType.Explicit, pytest.param(AxisType.Auto, marks=pytest.mark.slow)


@pytest.fixture
def lit(rng):
    """A ball of unshadowed vertices, in float64."""
    normals = rng.normal(size=(COUNT, 3))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return transfer.unshadowed(0.3 * normals, normals, 1)


def shared_out(kind, *trees):
    """The leading axis of every array shared out."""
    mesh = jax.make_mesh((2,), ("rows",), axis_types=(kind,))
    return jax.device_put(trees, NamedSharding(mesh, P("rows")))


def check(fit, kind, value, *arguments):
    """Finds the value from observations that two devices share; none gets those of the other."""
    placed = shared_out(kind, *arguments)
    compiled = jax.jit(fit).lower(*placed).compile()
    found = compiled(*placed)
    assert found.converged
    for a, b in zip(jax.tree.leaves(found.value), jax.tree.leaves(value), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-5, atol=1e-5)
    # Sums over all vertices, and triangles that the devices have made of their own.
    assert collectives(compiled).keys() <= {"all-gather", "all-reduce"}
    assert 0 < longest_exchange(compiled) < COUNT
    return found


def glow(sun, turbidity):
    """A sky of degree 1 that is compiled faster than Preetham's."""
    return jnp.tile(jnp.concatenate([jnp.ones(1), turbidity * sun[jnp.array([1, 2, 0])]]), (3, 1))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.slow
def test_sky(kind, lit, rng):
    sun = jnp.array([0.6, 0.0, 0.8])
    observed = transfer.shade_diffuse(glow(sun, 3.0), lit, 0.5)
    observed = observed + jnp.asarray(1e-6 * rng.normal(size=observed.shape))

    def fit(observed, transfer):
        return inverse.fit_sky(observed, transfer, 0.5, sky=glow, starts=2)

    found = check(fit, kind, (sun, 3.0, 1.0), observed, lit)
    if kind == AxisType.Explicit:
        expected = jax.jit(fit)(observed, lit).confidence.covariance
        np.testing.assert_allclose(found.confidence.covariance, expected, rtol=1e-4, atol=1e-18)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_daylight(kind, lit):
    """By the exact cosine; its harmonics of degree 1 are too few for the search alone."""
    numbers = (jnp.asarray(x) for x in (3.0, 1.0))
    truth = inverse.Daylight(
        jnp.array([0.6, 0.0, 0.8]), *numbers, jnp.full(3, 1e5), jnp.full(3, 0.2)
    )
    rest = transfer.shade_diffuse(truth.parts(4, glow)[0], lit, 0.5)
    cosine = jnp.maximum(lit.normals @ truth.sun, 0)
    observed = rest + 0.5 / np.pi * cosine[:, None] * truth.facing[None]

    def fit(observed, transfer, sunlit):
        return inverse.fit_daylight(
            observed, transfer, 0.5, sunlit=sunlit, sky=glow, exposure=1.0, starts=2
        )

    check(fit, kind, truth, observed, lit, jnp.ones(COUNT))


def lamp(x, radiance):
    corners = [[x, -0.2, 1.5], [x, 0.2, 1.5], [x + 0.4, 0.2, 1.5], [x + 0.4, -0.2, 1.5]]
    return Polygon(jnp.array(corners), jnp.array(radiance))


def seen(lit, lights):
    light = sum(polygon_harmonics(one, lit.positions, lit.degree) for one in lights)
    return transfer.shade_diffuse(light, lit, 0.5)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.slow
def test_colors(kind, lit):
    lights = lamp(-1.0, [2.0, 1.0, 0.0]), lamp(0.6, [0.5, 1.0, 3.0])

    def fit(observed, transfer):
        return inverse.fit_colors(observed, transfer, 0.5, lights)

    check(fit, kind, jnp.stack([p.radiance for p in lights]), seen(lit, lights), lit)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_polygons(kind, lit):
    start = [lamp(-0.8, [1.0, 1.0, 1.0])]

    def fit(observed, transfer):
        return inverse.fit_polygons(observed, transfer, 0.5, start, turn=False)

    truth = lamp(-1.0, [2.0, 1.0, 0.5])
    check(fit, kind, inverse.rectangle_of(truth), seen(lit, [truth]), lit)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("loss", ["squares", "cauchy"])
def test_light(loss, kind, lit, rng):
    observed = jnp.asarray(rng.uniform(0.1, 1, (COUNT, 3)))

    def fit(observed, normals):
        return inverse.fit_light(
            observed, normals, 0.5, 1, prior=np.array([0.3, 0.1]), loss=loss, throw=False
        )

    expected = jax.jit(fit)(observed, lit.normals)
    check(fit, kind, expected.value, observed, lit.normals)


@pytest.mark.parametrize("rows", [6, 64])
def test_triangle(rows, rng):
    """R of QR but for signs: the same Gram matrix, and singular values."""
    tall = rng.normal(size=(rows, 5))
    expected = np.linalg.svd(tall, compute_uv=False)
    (placed,) = shared_out(AxisType.Auto, tall)
    for r in (triangle(jnp.asarray(tall)), jax.jit(triangle)(placed)):
        np.testing.assert_allclose(np.asarray(r).T @ r, tall.T @ tall, rtol=0, atol=1e-13)
        np.testing.assert_allclose(np.linalg.svd(r, compute_uv=False), expected, 1e-13)
