"""Exact polygon lights, beside quadrature over their surface."""

import itertools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from lights import rectangle, surface_quadrature

from jaxsh import harmonics
from jaxsh.midrange import (
    Polygon,
    polygon_harmonics,
    polygon_harmonics_with_gradient,
)

RADIANCE = np.array([1.0, 2, 0.5])


def turned(rng):
    """A random rotation."""
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def concave(rng):
    """A pentagon with one corner pushed in, anywhere, facing where its first corners' normal is."""
    flat = np.array([[0.2, 0.1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [1, 1.2, 0]])
    return flat @ turned(rng).T + rng.normal(size=3)


def before(vertices, rng, distance):
    """A point in front of a polygon, at a share of its size from the plane, and to the side."""
    spokes = vertices - vertices.mean(axis=0)
    n = np.cross(spokes, np.roll(spokes, -1, axis=0)).sum(axis=0)
    side = spokes[1] * rng.uniform(-1, 1) + spokes[2] * rng.uniform(-1, 1)
    return vertices.mean(axis=0) + distance * (side + n / np.linalg.norm(n))


@pytest.mark.parametrize("degree", [0, 2, pytest.param(10, marks=pytest.mark.slow)])
def test_polygon_is_its_surface_integral(rng, degree):
    vertices = concave(rng)
    points = np.stack([before(vertices, rng, d) for d in (0.7, 2, 30)])
    polygon = Polygon(vertices, RADIANCE)
    value, gradient = polygon_harmonics_with_gradient(polygon, points, degree)
    alone = polygon_harmonics(polygon, points, degree)
    assert value.shape == (3, 3, (degree + 1) ** 2)
    assert gradient.shape == (*value.shape, 3)
    for i, point in enumerate(points):
        c, slope = surface_quadrature(vertices, RADIANCE, point, degree)
        np.testing.assert_allclose(value[i], c, rtol=0, atol=1e-13)
        np.testing.assert_allclose(alone[i], c, rtol=0, atol=1e-13)
        np.testing.assert_allclose(gradient[i], slope, rtol=0, atol=1e-12)


@pytest.mark.slow
def test_polygon_up_to_the_whole_half_space():
    """Arcs of almost π: a square from 1e-3 of its size fills almost a half space."""
    degree = 20
    polygon = Polygon(rectangle([0, 0, 1], [0, 1e3, 0], [1e3, 0, 0]), RADIANCE)
    c, gradient = polygon_harmonics_with_gradient(polygon, np.zeros(3), degree)
    # ∫_{z>0} y_l0 dω = 2π √((2l+1)/4π) ∫_0^1 P_l; what is missing is below z = 1e-3.
    half = np.polynomial.legendre.leggauss(200)
    z, w = (half[0] + 1) / 2, half[1] / 2
    l = harmonics.degrees(degree)
    zonal = np.where(harmonics.orders(degree) == 0, 1.0, 0.0)
    on_axis = np.polynomial.legendre.legvander(z, degree).T @ w
    expected = 2 * np.pi * np.sqrt((2 * l + 1) / (4 * np.pi)) * on_axis[l] * zonal
    np.testing.assert_allclose(c[0], expected, rtol=0, atol=2e-2)
    # Exactly: the same light in 16 parts, whose arcs are shorter.
    line = np.array([-1e3, -1, 0.3, 20, 1e3])
    parts = [
        rectangle([(a + b) / 2, (p + q) / 2, 1], [0, (q - p) / 2, 0], [(b - a) / 2, 0, 0])
        for a, b in itertools.pairwise(line)
        for p, q in itertools.pairwise(line)
    ]
    both = [
        polygon_harmonics_with_gradient(Polygon(v, RADIANCE), np.zeros(3), degree) for v in parts
    ]
    np.testing.assert_allclose(sum(b[0] for b in both), c, rtol=0, atol=1e-11)
    np.testing.assert_allclose(sum(b[1] for b in both), gradient, rtol=0, atol=1e-11)


def test_polygon_turns_moves_and_scales(rng):
    vertices = concave(rng)
    point = before(vertices, rng, 0.8)
    c, slope = polygon_harmonics_with_gradient(Polygon(vertices, RADIANCE), point, 4)
    shift, r = rng.normal(size=3), turned(rng)
    there = polygon_harmonics_with_gradient(Polygon(vertices + shift, RADIANCE), point + shift, 4)
    np.testing.assert_allclose(there[0], c, rtol=0, atol=1e-13)
    rolled = polygon_harmonics_with_gradient(
        Polygon(np.roll(vertices, 2, axis=0), RADIANCE), point, 4
    )
    np.testing.assert_allclose(rolled[1], slope, rtol=0, atol=1e-13)
    large = polygon_harmonics_with_gradient(Polygon(100 * vertices, RADIANCE), 100 * point, 4)
    np.testing.assert_allclose(large[0], c, rtol=0, atol=1e-13)
    np.testing.assert_allclose(100 * large[1], slope, rtol=0, atol=1e-12)
    spun = polygon_harmonics_with_gradient(Polygon(vertices @ r.T, RADIANCE), point @ r.T, 4)
    np.testing.assert_allclose(spun[0], harmonics.rotate(c, r), rtol=0, atol=1e-13)
    along = jnp.stack([harmonics.rotate(s, r) for s in jnp.moveaxis(slope, -1, 0)], axis=-1)
    np.testing.assert_allclose(spun[1], along @ r.T, rtol=0, atol=1e-12)


def test_polygon_far_away_is_distant(rng):
    """A direction with its solid angle, to the square of the angle under which it is seen."""
    vertices = rectangle([0, 0, 0], [0, 0.5, 0], [0.3, 0, 0])
    point = np.array([300.0, -200, -900])
    c = polygon_harmonics(Polygon(vertices, RADIANCE), point, 4)
    s = -point
    solid_angle = 0.6 * s[2] / np.linalg.norm(s) ** 3
    distant = np.outer(RADIANCE, harmonics.evaluate(s, 4)) * solid_angle
    np.testing.assert_allclose(c, distant, rtol=0, atol=2e-6 * np.abs(distant).max())


def test_polygon_has_one_side_or_two(rng):
    vertices = rectangle([0, 0, 1], [0, 1, 0], [1, 0, 0])
    points = np.array([[0.2, 0.1, 0], [0.2, 0.1, 2]])
    one = polygon_harmonics_with_gradient(Polygon(vertices, RADIANCE), points, 4)
    both = polygon_harmonics_with_gradient(Polygon(vertices, RADIANCE, True), points, 4)
    back = polygon_harmonics_with_gradient(Polygon(vertices[::-1], RADIANCE), points, 4)
    for single, double, reverse in zip(one, both, back, strict=True):
        np.testing.assert_array_equal(single[1], 0)
        np.testing.assert_array_equal(reverse[0], 0)
        np.testing.assert_allclose(single + reverse, double, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(one[0][0], both[0][0])


@pytest.mark.slow
def test_polygon_where_there_is_no_light_to_speak_of():
    """In the plane, on an edge, at a corner, on an edge's line: finite, zero, zero slopes."""
    polygon = Polygon(rectangle([0, 0, 1], [0, 1, 0], [1, 0, 0]), RADIANCE)
    points = np.array([[0.0, 0, 1], [1, 0.3, 1], [1, 1, 1], [3, 1, 1], [3, 0.2, 1]])

    def total(polygon, points):
        value, slope = polygon_harmonics_with_gradient(polygon, points, 3)
        return jnp.sum(value) + jnp.sum(slope), (value, slope)

    (by_polygon, by_point), values = jax.grad(total, (0, 1), has_aux=True)(
        polygon, jnp.asarray(points)
    )
    for array in (*values, by_polygon.vertices, by_point):
        np.testing.assert_array_equal(array, 0)


def lit_concave(rng):
    vertices = concave(rng)
    point = jnp.asarray(before(vertices, rng, 0.8))
    polygon = Polygon(vertices, RADIANCE)
    _, gradient = polygon_harmonics_with_gradient(polygon, point, 3)
    return vertices, polygon, point, gradient


def test_polygon_s_gradient_is_its_derivative(rng):
    _, polygon, point, gradient = lit_concave(rng)
    forward = jax.jit(jax.jacfwd(lambda p: polygon_harmonics(polygon, p, 3)))(point)
    np.testing.assert_allclose(forward, gradient, rtol=0, atol=1e-13)


@pytest.mark.slow
def test_polygon_is_differentiable_both_ways(rng):
    """In point and vertices: reverse, the analytic gradient, differences, second derivatives."""
    vertices, polygon, point, gradient = lit_concave(rng)
    probe = jnp.asarray(rng.normal(size=(3, 16)))
    corners = jnp.asarray(vertices)
    in_plane = jnp.asarray(rng.normal(size=(5, 2)) @ (vertices[2:4] - vertices[1]))

    def light(corners, point):
        lit = eqx.tree_at(lambda p: p.vertices, polygon, corners)
        return jnp.sum(probe * polygon_harmonics(lit, point, 3))

    @jax.jit
    def derivatives(corners, point):
        def slope(point):
            value, slopes = jax.value_and_grad(light, (0, 1))(corners, point)
            return slopes[1], (value, slopes)

        second, (value, slopes) = jax.jacfwd(slope, has_aux=True)(point)
        return value, slopes, second

    _, slopes, second = derivatives(corners, point)
    expected = jnp.sum(probe[..., None] * gradient, axis=(0, 1))
    np.testing.assert_allclose(slopes[1], expected, rtol=0, atol=1e-12)
    np.testing.assert_allclose(jnp.sum(slopes[0], axis=0), -expected, rtol=0, atol=1e-12)
    h = 1e-5
    more, less = (derivatives(corners + step * in_plane, point)[0] for step in (h, -h))
    np.testing.assert_allclose(jnp.sum(slopes[0] * in_plane), (more - less) / (2 * h), rtol=1e-7)
    np.testing.assert_allclose(second, second.T, rtol=0, atol=1e-11)
    assert jnp.abs(second).max() > 0.1


@pytest.mark.slow
def test_polygon_in_float32_and_in_batches(rng):
    """Rounding grows as one over the angle; more points than a block, in any number of axes."""
    vertices = concave(rng)
    distances = np.geomspace(0.7, 30, 1030)
    points = np.stack([before(vertices, rng, d) for d in distances])
    polygon = Polygon(vertices, RADIANCE)
    shaped = np.asarray(polygon_harmonics(polygon, points.reshape(103, 10, 3), 4))
    assert shaped.shape == (103, 10, 3, 25)
    exact = shaped.reshape(1030, 3, 25)
    c, slope = polygon_harmonics_with_gradient(polygon, points.astype(np.float32), 4)
    assert c.dtype == slope.dtype == jnp.float32
    scale = np.abs(exact).max(axis=(1, 2)) * np.maximum(distances, 1)
    worst = (np.abs(np.asarray(c) - exact).max(axis=(1, 2)) / scale).max()
    assert worst < 2e-6
    chosen = [0, 500, 1029]  # of both blocks
    single = jax.jit(jax.vmap(lambda p: polygon_harmonics(polygon, p, 4)))(points[chosen])
    np.testing.assert_allclose(single, exact[chosen], rtol=0, atol=1e-14)
    assert polygon_harmonics(polygon, np.zeros((0, 3)), 4).shape == (0, 3, 25)


SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])


@pytest.mark.parametrize(
    ("vertices", "message"),
    [
        (SQUARE[:2], "at least 3 vertices"),
        (SQUARE[:, :2], "at least 3 vertices"),
        (SQUARE * [np.nan, 1, 1], "finite"),
        (SQUARE * [1, 0, 1], "area"),
        (SQUARE * 0 + 3, "area"),
        (SQUARE + 1e-6 * np.eye(4)[:, [3, 3, 0]] * [0, 0, 1], "flat"),
        (SQUARE * [1e6, 1e6, 1] + np.eye(4)[:, [3, 3, 0]] * [0, 0, 1], "flat"),
        ([[0, 0, 0], [2, 0, 0], [0, 1, 0], [3, 2, 0]], "meet itself"),
        ([[0, 0, 0], [2, 0, 0], [2, 2, 0], [1, 0, 0], [0, 2, 0]], "meet itself"),
    ],
)
def test_polygon_refuses_what_is_none(unchecked, vertices, message):
    with pytest.raises(ValueError, match=message):
        Polygon(np.asarray(vertices, float), RADIANCE)


def test_polygon_refuses_other_mistakes(unchecked):
    polygon = Polygon(SQUARE, RADIANCE)
    with pytest.raises(ValueError, match="radiance"):
        Polygon(SQUARE, np.ones(2))
    with pytest.raises(ValueError, match="radiance must be finite"):
        Polygon(SQUARE, np.array([1, np.inf, 0]))
    with pytest.raises(ValueError, match="point"):
        polygon_harmonics(polygon, np.zeros(2), 2)
    with pytest.raises(ValueError, match="degree"):
        polygon_harmonics(polygon, np.zeros(3), -1)
    with pytest.raises(ValueError, match="broadcast"):
        polygon_harmonics(polygon, np.zeros((4, 3)), 2, horizon=np.ones((3, 3)))
