"""Plots, looked at as pictures: what stands where, in which color."""

import re

import jax
import jax.numpy as jnp
import matplotlib
import numpy as np
import pytest
from drawn import at, near, pixels
from matplotlib import pyplot
from matplotlib.figure import Figure

from jaxsh import harmonics, imaging, plot, sphere

MAGENTA = (255, 0, 255)


@pytest.mark.parametrize(("array", "dtype"), [(np.asarray, np.float32), (jnp.asarray, np.float64)])
def test_light_shows_the_function_at_its_directions(rng, dtype, array):
    coefficients = rng.normal(size=(3, 9)) * 0.05
    coefficients[:, 0] = 3  # positive everywhere: nothing is marked
    ax = plot.light(array(coefficients.astype(dtype)), exposure=0.7)
    phi, theta = rng.uniform(10, 350, 50), rng.uniform(10, 170, 50)
    p, t = np.radians(phi), np.radians(theta)
    directions = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1)
    radiance = np.asarray(harmonics.evaluate(directions, 2)) @ coefficients.T
    expected = 255 * np.asarray(imaging.tone_map(jnp.asarray(radiance), 0.7))
    # Half a pixel of a picture of 128 rows: the function changes by less than two steps of 255
    # there; 1.2 measured.
    np.testing.assert_allclose(at(ax, np.stack([phi, theta], axis=-1)), expected, rtol=0, atol=2)
    assert ax.get_legend() is None
    assert not near(pixels(ax.figure), MAGENTA).any()


def test_light_marks_negative_radiance_and_says_how_much():
    # √(1/4π) (1 + 3√3 cosθ) is negative where cosθ < −1/√27.
    ax = plot.light(np.array([1.0, 0.0, 3.0, 0.0]))
    (text,) = ax.get_legend().get_texts()
    share, lowest = re.fullmatch(
        r"negative: (.*) % of the sphere, down to −(.*)", text.get_text()
    ).groups()
    # Whole rows of 180°/128, and two digits.
    assert float(share) == pytest.approx(50 * (1 - 1 / np.sqrt(27)), abs=1)
    assert float(lowest) == pytest.approx((np.sqrt(27) - 1) / np.sqrt(4 * np.pi), abs=0.05)
    edge = np.degrees(np.arccos(-1 / np.sqrt(27)))
    outline = at(ax, np.stack([np.linspace(20, 340, 30), np.full(30, edge)], axis=-1))
    assert near(outline, MAGENTA, 90).mean() > 0.8
    grid = np.stack(np.meshgrid(np.linspace(5, 355, 200), np.linspace(5, 175, 100)), axis=-1)
    marked = near(at(ax, grid.reshape(-1, 2)), MAGENTA, 120).reshape(100, 200).mean(axis=1)
    below = np.linspace(5, 175, 100) > edge + 3
    assert marked[below].mean() > 0.1  # hatched
    assert not marked[np.linspace(5, 175, 100) < edge - 3].any()


def test_light_draws_pictures_too(rng):
    picture = rng.uniform(0.1, 1, (16, 40, 3)).astype(np.float32)
    ax = plot.light(picture, exposure=1.0)
    rows, columns = np.meshgrid(np.arange(16), np.arange(40), indexing="ij")
    centers = np.stack([(columns + 0.5) * 9, (rows + 0.5) * 11.25], axis=-1).reshape(-1, 2)
    expected = 255 * np.asarray(imaging.srgb_encode(jnp.asarray(picture))).reshape(-1, 3)
    np.testing.assert_allclose(at(ax, centers), expected, rtol=0, atol=1.01)
    gray = plot.light(picture[..., :1], exposure=1.0)
    shown = at(gray, centers)
    assert (shown == shown[:, :1]).all()


def test_light_tells_one_negative_channel_and_ignores_rounding():
    picture = np.ones((8, 16, 3), np.float32)
    picture[2, 3, 2] = -0.5
    assert "down to −0.5" in plot.light(picture).get_legend().get_texts()[0].get_text()
    picture[2, 3, 2] = -1e-8
    assert plot.light(picture).get_legend() is None
    assert plot.light(np.zeros((8, 16, 3))).get_legend() is None


@pytest.mark.parametrize(
    ("light", "message"),
    [
        (np.zeros((3, 5)), r"1, 4, 9"),
        (np.zeros((2, 9)), r"expected light as coefficients .* got shape \(2, 9\)"),
        (np.zeros((4, 3, 9)), r"got shape \(4, 3, 9\)"),
        (np.array([np.nan, 0, 0, 1]), "light must be finite, got 1 of 4"),
        (np.ones((8, 16, 3), complex), "expected real numbers for light, got .* dtype complex128"),
        (np.ones((8, 8, 3)), "twice as wide as high, got width 8 and height 8"),
        (np.ones((3, 8, 16)), "channels come last"),
        (np.ones((8, 16, 3), np.uint8), "srgb_decode"),
    ],
)
def test_light_refuses(light, message, unchecked):
    with pytest.raises(ValueError, match=message):
        plot.light(light)


def test_bands_are_the_power_of_each_degree(rng):
    light = rng.normal(size=(3, 16))
    ax = plot.bands(jnp.asarray(light), labels=["R", "G", "B"])
    lines = [line.get_ydata() for line in ax.get_lines()]
    # Parseval, against a quadrature that is exact for squares of degree 3.
    quadrature = sphere.gauss_legendre(6)
    values = np.asarray(harmonics.evaluate(quadrature.directions, 3)) @ light.T
    integral = np.asarray(quadrature.weights) @ values**2
    np.testing.assert_allclose(np.sum(lines, axis=1), integral, rtol=1e-12)
    assert ax.get_yscale() == "log"
    for line, color in zip(lines, ("#d55e00", "#009e73", "#0072b2"), strict=True):
        shown = at(ax, np.stack([np.arange(4), line], axis=-1))
        expected = 255 * np.array(matplotlib.colors.to_rgb(color))
        assert near(shown, expected).sum() >= 3  # a marker of another line may lie on one


def test_bands_leave_out_degrees_without_power():
    ax = plot.bands(np.array([1.0, 0, 0, 0, 0, 0, 2.0, 0, 0]))
    np.testing.assert_array_equal(ax.get_lines()[0].get_ydata(), [1, np.nan, 4])
    assert plot.bands(np.zeros(4)).get_yscale() == "linear"
    with pytest.raises(ValueError, match="expected 1 labels"):
        plot.bands(np.ones(4), labels=["a", "b"])


def test_bands_name_the_channels_of_a_light():
    ax = plot.bands(np.eye(4)[:3], unit="(cd/m²)² sr")
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["R", "G", "B"]
    assert len({line.get_marker() for line in ax.get_lines()}) == 3  # not by color alone
    assert ax.get_ylabel() == "power Σₘ cₗₘ², in (cd/m²)² sr"
    assert plot.bands(np.eye(4)[:2]).get_legend() is None


def test_nothing_is_shown_and_no_backend_chosen(monkeypatch):
    def refuse(*_, **__):
        raise AssertionError("a plot is the caller's to show")

    monkeypatch.setattr(pyplot, "show", refuse)
    monkeypatch.setattr(matplotlib, "use", refuse)
    monkeypatch.setattr(pyplot, "switch_backend", refuse)
    before = pyplot.get_fignums()
    flat, other = Figure().add_subplot(), Figure().add_subplot()
    assert plot.light(np.ones(4), ax=flat) is flat
    assert plot.bands(np.ones(4), ax=flat) is flat
    assert plot.lobes(np.ones(4), ax=other, resolution=4)[0] is other
    assert pyplot.get_fignums() == before
    assert plot.light(np.ones(4)).figure.number in pyplot.get_fignums()


def test_tracers_are_refused():
    with pytest.raises(ValueError, match="runs on the host, before jit"):
        jax.jit(lambda light: plot.bands(light) and light)(jnp.ones(4))
