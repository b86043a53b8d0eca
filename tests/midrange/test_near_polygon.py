"""Polygon lights right beside the receiver, with many corners, and behind many blockers."""

import functools
import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from lights import rectangle, surface_quadrature

from jaxsh.midrange import Polygon, polygon_harmonics, polygon_harmonics_with_gradient

ONE = np.ones(3)
HALF = np.array([10.0, 2.0])  # of the lamp's sides
LAMP = rectangle([0, 0, 0], [0, HALF[1], 0], [HALF[0], 0, 0])  # shines down
TURN = np.linalg.qr(np.random.default_rng(14).normal(size=(3, 3)))[0]
TURN = TURN * np.sign(np.linalg.det(TURN))


def receivers(count, rng):
    """Before the lamp, from 2e-5 to 2: at random, and on its axes, edges, diagonal and corners."""
    h = HALF[1] * 10 ** rng.uniform(-5, 0, count)
    x, y = rng.uniform(-1.1, 1.1, (2, count)) * HALF[:, None]
    kind = np.arange(count) % 9
    x[np.isin(kind, [1, 3])] = 0
    y[np.isin(kind, [2, 3])] = 0
    x[np.isin(kind, [4, 8])] = HALF[0]
    y[np.isin(kind, [5, 8])] = HALF[1]
    x[kind == 6] = y[kind == 6]
    x[kind == 7] = HALF[0] + (h * rng.normal(size=count))[kind == 7]
    return np.stack([x, y, -h], axis=-1)


def closed_form(corners, points):
    """(N, 4): Van Oosterom and Strackee's solid angle, Lambert's vector irradiance, as c_0, c_1.

    The triangles' apex is the receiver's foot on the lamp's plane, so that none is beyond π.
    """
    spokes = corners - corners[0]
    n = -np.cross(spokes, np.roll(spokes, -1, axis=0)).sum(axis=0)
    n /= np.linalg.norm(n)
    angle, vector = 0, 0
    for first, second in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        s, e = first - points, second - points
        a, b = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in (s, e))
        area = np.cross(s, second - first)
        size = np.linalg.norm(area, axis=-1)
        turn = np.arctan2(size, np.sum(s * e, axis=-1))
        # Divided by cos(turn/2), for the digits of what is almost π.
        middle = np.cross(np.cross(a, b), b - a)
        middle /= np.linalg.norm(middle, axis=-1, keepdims=True)
        normal = area / size[:, None]
        half = np.stack([np.sin(turn / 2), np.cos(turn / 2)])
        angle -= 2 * np.arctan2((normal @ n) * half[0], np.abs(middle @ n) + half[1])
        vector = vector - normal * (turn / 2)[:, None]
    y, z, x = vector[:, 1], vector[:, 2], vector[:, 0]
    return np.stack(
        [angle / np.sqrt(4 * np.pi), *(np.sqrt(3 / 4 / np.pi) * v for v in (y, z, x))], -1
    )


def check_near(degree, count, rng):
    """float32 against float64 at the same corners and points; the latter against closed forms.

    Measured of 30,000 at degrees 1, 3 and 8: 2.8e-6, 1.7e-5 (at 8) and 9e-12.
    """
    for turn, center in ((np.eye(3), np.zeros(3)), (TURN, np.array([3.0, -5, 7]))):
        corners = (LAMP @ turn.T + center).astype(np.float32)
        points = (receivers(count, rng) @ turn.T + center).astype(np.float32)
        lamp = Polygon(corners, ONE.astype(np.float32))
        exact, slope = polygon_harmonics_with_gradient(lamp, points.astype(np.float64), degree)
        value, gradient = polygon_harmonics_with_gradient(lamp, points, degree)
        np.testing.assert_allclose(value, exact, rtol=0, atol=1e-5)
        gradient, slope = np.asarray(gradient), np.asarray(slope)
        worst = np.abs(gradient - slope).max((1, 2, 3)) / np.abs(slope).max((1, 2, 3))
        assert worst.max() < 5e-5
        known = closed_form(corners.astype(np.float64), points.astype(np.float64))
        np.testing.assert_allclose(exact[:, 0, :4], known, rtol=0, atol=3e-11)


@pytest.mark.slow
def test_near_receivers_in_float32(rng):
    check_near(1, 1800, rng)


@pytest.mark.slow
@pytest.mark.parametrize("degree", range(1, 9))
def test_30000_near_receivers_in_float32(rng, degree):
    check_near(degree, 15_000, rng)


def test_right_under_the_middle():
    """1 mm below a lamp of 20 × 4: half of the sphere but for 2 mrad; c_0 is +1.772, not -1.772."""
    point = np.array([0, 0, -1e-3], np.float32)
    c = polygon_harmonics(Polygon(LAMP, ONE), point, 1)
    np.testing.assert_allclose(c[0, 0], 2 * np.pi / np.sqrt(4 * np.pi), rtol=0, atol=1e-3)
    np.testing.assert_allclose(c[0, 2], np.pi * np.sqrt(3 / 4 / np.pi), rtol=0, atol=1e-6)


@pytest.mark.parametrize("count", [500, pytest.param(72, marks=pytest.mark.slow)])
def test_many_corners_in_float32(rng, count):
    turns = -2 * np.pi * np.arange(count) / count
    disc = np.stack([np.cos(turns), np.sin(turns), np.full(count, 2.0)], -1).astype(np.float32)
    points = (0.3 * rng.normal(size=(40, 3))).astype(np.float32)
    c = polygon_harmonics(Polygon(disc, ONE), points, 1)
    known = closed_form(disc.astype(np.float64), points.astype(np.float64))
    np.testing.assert_allclose(c[:, 0], known, rtol=0, atol=2e-6)


LIGHT = -1.0, 1.2, -0.9, 1.1  # from x to x, from y to y, at z = 2, seen from the origin


def left(shadows, degree):
    """The light's cells between all sides of all shadows that none of these covers."""

    def sides(i):
        low, high = LIGHT[2 * i : 2 * i + 2]
        return np.unique(np.clip([low, high, *shadows[:, 2 * i : 2 * i + 2].ravel()], low, high))

    total = np.zeros((degree + 1) ** 2)
    xs, ys = sides(0), sides(1)
    for a, b in itertools.pairwise(xs):
        for c, d in itertools.pairwise(ys):
            x, y = (a + b) / 2, (c + d) / 2
            x0, x1, y0, y1 = shadows.T
            if not np.any((x0 < x) & (x < x1) & (y0 < y) & (y < y1)):
                cell = rectangle([x, y, 2], [0, (d - c) / 2, 0], [(b - a) / 2, 0, 0])
                total += surface_quadrature(cell, ONE, np.zeros(3), degree, nodes=16)[0][0]
    return total


def shadows(kind, count, rng):
    """At random; or with sides on few lines, so that they touch, share sides, and are the same."""
    if kind == "random":
        x, y = rng.uniform(-1.4, 1.0, (2, count))
        return np.stack(
            [x, x + rng.uniform(0.1, 0.8, count), y, y + rng.uniform(0.1, 0.8, count)], -1
        )
    lines = np.array([-1, -0.6, -0.2, 0.3, 1.2]), np.array([-0.9, -0.3, 0.2, 0.6, 1.1])
    place = rng.integers(0, 4, (2, count))
    found = np.stack([lines[i][place[i] + j] for i in (0, 1) for j in (0, 1)], axis=-1)
    found[-1] = found[0]
    return found


def blocker(shadow, share, turned):
    """The rectangle at this share of the way to the light."""
    x0, x1, y0, y1 = share * shadow
    v = rectangle(
        [(x0 + x1) / 2, (y0 + y1) / 2, 2 * share], [0, (y1 - y0) / 2, 0], [(x1 - x0) / 2, 0, 0]
    )
    return Polygon(v[::-1] if turned else v, ONE)


@pytest.mark.parametrize("count", [2, pytest.param(12, marks=pytest.mark.slow)])
def test_the_union_of_blockers_is_taken_away(rng, count):
    light = Polygon(rectangle([0.1, 0.1, 2], [0, 1, 0], [1.1, 0, 0]), ONE)
    seen = 0
    for kind in ("random", "touching") * 2:
        shade = shadows(kind, count, rng)
        blockers = [blocker(shadow, rng.uniform(0.2, 0.9), rng.integers(2)) for shadow in shade]
        expected = left(shade, 1)
        c = polygon_harmonics(light, np.zeros((1, 3)), 1, blockers=blockers)
        np.testing.assert_allclose(c[0, 0], expected, rtol=0, atol=1e-12)
        seen += expected[0] > 0.01
    assert seen > 1


@pytest.mark.slow
@pytest.mark.parametrize("light", ["convex", "concave"])
def test_blockers_in_float32_and_moved(rng, light):
    """Values and gradients beside float64, and those beside differences."""
    corners = rectangle([0.1, 0.1, 2], [0, 1, 0], [1.1, 0, 0])
    if light == "concave":
        corners = np.array([[0.2, 0.1, 2], [-1, 1, 2], [1, 1, 2], [1, -1, 2], [-1, -1, 2]])
    shade = shadows("random", 6, rng)
    blockers = [blocker(shadow, rng.uniform(0.2, 0.9), False) for shadow in shade]
    points = 0.1 * rng.normal(size=(200, 3)).astype(np.float32)

    def seen(points):
        return polygon_harmonics_with_gradient(
            Polygon(corners, ONE), points, 3, horizon=np.array([0.5, 0.1, 0.86]), blockers=blockers
        )

    exact, slope = seen(points.astype(np.float64))
    value, gradient = seen(points)
    np.testing.assert_allclose(value, exact, rtol=0, atol=1e-5)
    np.testing.assert_allclose(gradient, slope, rtol=0, atol=1e-4)
    step = 1e-6 * np.eye(3)[:, None]
    rise = seen(points.astype(np.float64) + step)[0] - seen(points.astype(np.float64) - step)[0]
    kinks = np.abs(np.moveaxis(rise, 0, -1) / 2e-6 - slope).max((1, 2, 3)) > 1e-6
    assert kinks.sum() < 3  # where an edge passes a corner


def scaled_lights(scale, points):
    """A concave light beside a blocker, over a horizon, in this unit of length, in float32."""
    light, blocker = (
        Polygon((scale * np.array(v)).astype(np.float32), ONE.astype(np.float32))
        for v in (
            [[0.2, 0.1, 2], [-1, 1, 2], [1, 1, 2], [1, -1, 2], [-1, -1, 2]],
            [[0.1, 0, 1], [0.4, 0.1, 1.2], [0, 0.7, 0.9]],
        )
    )
    up = np.array([0.5, 0.1, 0.86], np.float32)
    scaled = (scale * points).astype(np.float32)
    return polygon_harmonics_with_gradient(light, scaled, 1, horizon=up, blockers=[blocker])


@pytest.mark.slow
def test_any_unit_of_length(rng):
    """Powers of two about 1e-18 and 1e18 change no bit; the lights' squared areas would not fit."""
    points = (0.3 * rng.normal(size=(20, 3))).astype(np.float32)
    value, gradient = scaled_lights(1, points)
    for scale in (2.0**-60, 2.0**60):
        scaled, slope = scaled_lights(scale, points)
        np.testing.assert_array_equal(scaled, value)
        np.testing.assert_array_equal(scale * slope, gradient)


@pytest.mark.slow
@pytest.mark.parametrize("count", [0, 2])
def test_derivatives_in_any_unit_of_length(rng, count):
    """By vertices and points, traced: as they are, divided by the unit."""
    corners = np.array(LAMP[:, [0, 1, 2]] / 10, np.float32)
    shade = [np.float32(c) * corners[:3] + np.float32([c, 0, -0.3]) for c in (0.2, 0.3)][:count]
    points = (rng.normal(size=(9, 3)) - [0, 0, 3]).astype(np.float32)

    @jax.jit
    @functools.partial(jax.grad, argnums=(0, 1, 2))
    def slopes(corners, shade, points):
        light, *blockers = (Polygon(v, jnp.ones(3, jnp.float32)) for v in (corners, *shade))
        return jnp.sum(polygon_harmonics(light, points, 2, blockers=blockers))

    expected = slopes(corners, shade, points)
    assert min(np.abs(row).max() for row in jax.tree.leaves(expected)) > 1e-3
    for scale in np.float32([2.0**-60, 2.0**60]):
        found = slopes(scale * corners, [scale * v for v in shade], scale * points)
        for a, b in zip(jax.tree.leaves(found), jax.tree.leaves(expected), strict=True):
            np.testing.assert_array_equal(scale * a, b)


def test_the_program_does_not_grow_with_corners_and_blockers():
    def size(corners, count):
        shapes = [
            Polygon(rectangle([0, 0, 1], [0, 0.1, 0], [0.1, 0, 0]), ONE) for _ in range(count)
        ]
        turns = -2 * np.pi * np.arange(corners) / corners
        disc = np.stack([np.cos(turns), np.sin(turns), np.full(corners, 2.0)], -1)
        jaxpr = jax.make_jaxpr(
            lambda p: polygon_harmonics(Polygon(disc, ONE), p, 1, blockers=shapes)
        )(jnp.zeros((1, 3)))
        return str(jaxpr).count(" = ")

    assert size(300, 12) - size(3, 2) <= 3 * 10  # what stacks ten more blockers


def test_a_polygon_seen_only_from_behind_is_said():
    points = np.array([[0.0, 0, 1], [3, 0, 2]], np.float32)
    with pytest.warns(UserWarning, match="none of the 2 points is before the polygon"):
        c = polygon_harmonics(Polygon(LAMP, ONE), points, 1)
    np.testing.assert_array_equal(c, 0)


@pytest.mark.parametrize("name", ["point", "horizon"])
def test_what_is_not_finite_is_refused(name):
    given = {"point": -np.ones((2, 3)), "horizon": np.ones(3)}
    given[name].flat[1] = np.nan
    with pytest.raises(ValueError, match=f"{name} must be finite, got nan"):
        polygon_harmonics(Polygon(LAMP, ONE), given["point"], 1, horizon=given["horizon"])
    corners = LAMP.copy()
    corners[2, 1] = np.inf
    with pytest.raises(ValueError, match="vertices must be finite"):
        Polygon(corners, ONE)


def two_sided_and_reversed():
    corners = rectangle([0.1, 0.1, 2], [0, 1, 0], [1.1, 0, 0])
    lights = Polygon(corners, ONE, two_sided=True), Polygon(corners, ONE)
    blockers = [
        Polygon(rectangle([0, 0.2, z], [0, 0.3, 0], [0.4, 0, 0.1]), ONE) for z in (1.5, 2.4)
    ]
    return *lights, Polygon(corners[::-1], ONE), blockers


def test_a_two_sided_light_takes_blockers():
    light, *_, blockers = two_sided_and_reversed()
    shape = jax.eval_shape(lambda p: polygon_harmonics(light, p, 0, blockers=blockers), np.zeros(3))
    assert shape.shape == (3, 1)


@pytest.mark.slow
def test_a_two_sided_light_behind_blockers_is_one_of_either_side():
    light, front, back, blockers = two_sided_and_reversed()
    for z, one in ((0.3, front), (4.0, back)):
        point = np.array([[0.2, 0.1, z]])
        expected = polygon_harmonics(one, point, 2, blockers=blockers)
        assert np.abs(expected - polygon_harmonics(one, point, 2)).max() > 0.01
        found = polygon_harmonics(light, point, 2, blockers=blockers)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)


@pytest.mark.slow
def test_reverse_mode_at_a_corner_above_a_horizon():
    light, up = Polygon(LAMP, ONE), np.array([0, 0.6, 0.8])
    points = jnp.asarray(np.stack([LAMP[0], [0, 0, -1]]))
    found = jax.grad(lambda p: polygon_harmonics(light, p, 1, horizon=up).sum())(points)
    assert not found[0].any()
    assert np.isfinite(found[1]).all()
    assert found[1].any()
