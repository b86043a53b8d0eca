"""Quadratures integrate what they claim, and no more."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from fields import basis, exponential, unit_vectors
from hypothesis import given, settings
from hypothesis import strategies as st

from jaxsh import sphere


def basis_integrals(quadrature, degree):
    """Σ_n w_n y_i(ω_n), which is √4π for i = 0 and zero beyond."""
    return np.asarray(quadrature.weights) @ basis(quadrature.directions, degree)


def error_by_degree(quadrature, degree):
    """Largest error of the integrals of each band, worst over the orders."""
    error = basis_integrals(quadrature, degree)
    error[0] -= np.sqrt(4 * np.pi)
    return np.maximum.reduceat(np.abs(error), np.arange(degree + 1) ** 2)


QUADRATURES = {
    "gauss_legendre": lambda n: sphere.gauss_legendre(n),
    "fibonacci": lambda n: sphere.fibonacci(n + 1),
    "cube_map": lambda n: sphere.cube_map(n + 1),
    "lat_long": lambda n: sphere.lat_long(n + 1, 2 * n + 3),
}


@pytest.mark.parametrize("name", QUADRATURES)
@settings(max_examples=8)
@given(st.integers(0, 40))
def test_weights_are_positive_and_sum_to_four_pi(name, size):
    quadrature = QUADRATURES[name](size)
    directions, weights = np.asarray(quadrature.directions), np.asarray(quadrature.weights)
    assert directions.shape == (*weights.shape, 3)
    assert directions.dtype == weights.dtype == jnp.float64
    assert (weights > 0).all()
    assert weights.sum() == pytest.approx(4 * np.pi, rel=3e-15)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=-1), 1, 4e-16)


@pytest.mark.parametrize("degree", [0, 1, 2, 5, 6, 11, 12])
def test_gauss_legendre_is_exact_up_to_its_degree_and_not_beyond(degree):
    quadrature = sphere.gauss_legendre(degree)
    assert len(quadrature.weights) == (degree // 2 + 1) * (degree + 1)
    error = error_by_degree(quadrature, 13)
    assert error[: degree + 1].max() < 1e-14  # 3e-15
    assert error[degree + 1] > 0.1


def test_gauss_legendre_projects_degree_onto_degree():
    y = basis(sphere.gauss_legendre(12).directions, 6)
    weights = np.asarray(sphere.gauss_legendre(12).weights)
    np.testing.assert_allclose((y.T * weights) @ y, np.eye(49), 0, 1e-14)


@pytest.mark.parametrize(("height", "width"), [(1, 1), (2, 5), (7, 7), (8, 16), (9, 6), (12, 7)])
def test_lat_long_is_exact_below_its_height_and_width(height, width):
    error = error_by_degree(sphere.lat_long(height, width), 13)
    limit = min(height, width)
    assert error[:limit].max() < 1e-14
    # Odd functions of z and sines vanish by symmetry; the next even function does not.
    assert error[limit : limit + 2].max() > 0.05


def test_lat_long_pixels_are_where_they_are_said_to_be():
    quadrature = sphere.lat_long(2, 4)
    s = np.sqrt(0.5)
    ring = [[0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]]
    expected = [[*xy, z] for z in (s, -s) for xy in ring]
    np.testing.assert_allclose(quadrature.directions, expected, 0, 1e-15)


def test_lat_long_weights_are_nearly_solid_angles():
    """As documented for 256 rows: 13 % off in the polar row, under 2e-4 from the 20th on."""
    edges = np.cos(np.arange(257) * np.pi / 256)
    solid_angle = (edges[:-1] - edges[1:]) * 2 * np.pi / 512
    weights = np.asarray(sphere.lat_long(256, 512).weights).reshape(256, 512)
    assert (weights == weights[:, :1]).all()
    ratio = weights[:, 0] / solid_angle - 1
    assert abs(ratio[0]) == pytest.approx(0.13, abs=0.005)
    assert np.abs(ratio[19:-19]).max() < 2e-4
    np.testing.assert_allclose(ratio, ratio[::-1], 0, 1e-11)


@pytest.mark.parametrize("resolution", [1, 2, 5, 16])
def test_cube_map_solid_angles(resolution):
    """Each texel's by many samples of itself, and each face's by symmetry."""
    weights = np.asarray(sphere.cube_map(resolution).weights).reshape(6, resolution, resolution)
    np.testing.assert_allclose(weights.sum(axis=(1, 2)), 4 * np.pi / 6, 1e-14)
    x, w = np.polynomial.legendre.leggauss(12)
    edge = np.linspace(-1, 1, resolution + 1)
    half = 1 / resolution
    for row, column in {(0, 0), (0, resolution // 2), (resolution // 2, resolution - 1)}:
        v = edge[row] + half * (1 + x)
        u = edge[column] + half * (1 + x)
        density = (1 + u**2 + v[:, None] ** 2) ** -1.5
        expected = half**2 * w @ density @ w
        np.testing.assert_allclose(weights[:, row, column], expected, 1e-8)


def test_cube_map_faces_in_opengl_order():
    """(s, t) of the OpenGL specification's table of major axes."""
    resolution = 3
    directions = np.asarray(sphere.cube_map(resolution).directions).reshape(6, 3, 3, 3)
    major = [
        ("+x", 0, (2, -1), (1, -1)),
        ("-x", 0, (2, 1), (1, -1)),
        ("+y", 1, (0, 1), (2, 1)),
        ("-y", 1, (0, 1), (2, -1)),
        ("+z", 2, (0, 1), (1, -1)),
        ("-z", 2, (0, -1), (1, -1)),
    ]
    for face, (name, axis, (s_axis, s_sign), (t_axis, t_sign)) in zip(
        directions, major, strict=True
    ):
        size = np.abs(face[..., axis])
        assert (np.sign(face[..., axis]) == (1 if name[0] == "+" else -1)).all()
        s, t = s_sign * face[..., s_axis] / size, t_sign * face[..., t_axis] / size
        centres = np.array([-2 / 3, 0, 2 / 3])
        np.testing.assert_allclose(s, np.broadcast_to(centres, (3, 3)), 0, 1e-15, err_msg=name)
        np.testing.assert_allclose(t.T, np.broadcast_to(centres, (3, 3)), 0, 1e-15, err_msg=name)


def rms_error(make, rng):
    """Of ∫ exp(a·ω) = 4π sinh|a|/|a| over random a."""
    quadrature = make()
    directions, weights = np.asarray(quadrature.directions), np.asarray(quadrature.weights)
    axes = rng.normal(size=(40, 3))
    size = np.linalg.norm(axes, axis=-1)
    expected = 4 * np.pi * np.sinh(size) / size
    found = np.array([weights @ exponential(axis)(directions) for axis in axes])
    return np.sqrt(np.mean((found - expected) ** 2))


def test_cube_map_converges_with_the_square_of_the_resolution():
    errors = [rms_error(lambda n=n: sphere.cube_map(n), np.random.default_rng(0)) for n in (8, 32)]
    assert np.log(errors[0] / errors[1]) / np.log(4) == pytest.approx(2, abs=0.05)


def test_fibonacci_converges_on_smooth_functions():
    """Measured: 19 · count^-1.5."""
    counts = (300, 3000, 30000)
    errors = [rms_error(lambda n=n: sphere.fibonacci(n), np.random.default_rng(0)) for n in counts]
    rates = -np.diff(np.log(errors)) / np.log(10)
    np.testing.assert_allclose(rates, 1.5, 0, 0.1)


def test_fibonacci_converges_on_edges(rng):
    """Areas of caps: count^-3/4."""
    counts, cut = (300, 30000), rng.uniform(-0.9, 0.9, 100)
    axes = unit_vectors(rng, 100)
    errors = []
    for count in counts:
        quadrature = sphere.fibonacci(count)
        inside = np.asarray(quadrature.directions) @ axes.T > cut
        area = np.asarray(quadrature.weights) @ inside
        errors.append(np.sqrt(np.mean((area - 2 * np.pi * (1 - cut)) ** 2)))
    rate = np.log(errors[0] / errors[1]) / np.log(100)
    assert rate == pytest.approx(0.75, abs=0.1)


def test_fibonacci_covers_evenly(rng):
    directions = np.asarray(sphere.fibonacci(1000).directions)
    nearest = np.sort(directions @ directions.T, axis=-1)[:, -2]
    gap = np.arccos(nearest) / np.sqrt(4 * np.pi / 1000)  # in units of the mean spacing
    assert gap.min() > 0.85
    covered = np.arccos((unit_vectors(rng, 2000) @ directions.T).max(axis=-1))
    assert covered.max() / np.sqrt(4 * np.pi / 1000) < 0.85


def test_a_quadrature_is_a_pytree():
    quadrature = sphere.gauss_legendre(3)
    integrate = jax.jit(lambda q: jnp.sum(q.weights * q.directions[:, 2] ** 2))
    assert integrate(quadrature) == pytest.approx(4 * np.pi / 3, rel=1e-14)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sphere.gauss_legendre(-1), "degree must be an integer >= 0, got -1"),
        (lambda: sphere.fibonacci(0), "count must be an integer >= 1, got 0"),
        (lambda: sphere.cube_map(0), "resolution must be an integer >= 1, got 0"),
        (lambda: sphere.lat_long(0, 4), "height must be an integer >= 1, got 0"),
        (lambda: sphere.lat_long(4, -1), "width must be an integer >= 1, got -1"),
    ],
)
def test_sizes_that_are_none_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.parametrize(
    "make",
    [
        lambda: sphere.gauss_legendre(2.5),
        lambda: sphere.fibonacci(2.5),
        lambda: sphere.cube_map(2.5),
        lambda: sphere.lat_long(2.5, 4),
    ],
)
def test_sizes_that_are_no_integers_are_refused(make, unchecked):
    with pytest.raises(ValueError, match=r"must be an integer.*got 2\.5"):
        make()
