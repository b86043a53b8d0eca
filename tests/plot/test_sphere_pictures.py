"""Balls, domes, and coefficients in their places."""

import jax.numpy as jnp
import matplotlib
import numpy as np
import pytest
from drawn import at, near, pixels
from matplotlib.figure import Figure
from scipy import special

from jaxsh import imaging, plot

FRONT = (0.0, -1.0, 0.0)  # x to the right, z upwards


def shown(ax) -> np.ndarray:
    return np.asarray(ax.get_images()[0].get_array())


def encoded(linear):
    return 255 * np.asarray(imaging.srgb_encode(jnp.asarray(np.clip(linear, 0, 1))))


def spots(rng, radius=0.85):
    x, z = rng.uniform(-0.6, 0.6, (2, 30)) * radius / 0.6 / np.sqrt(2)
    return x, z, np.sqrt(1 - x * x - z * z)


@pytest.mark.parametrize("of", ["radiance", "mirror", "diffuse"])
def test_a_ball_shows_what_it_says(rng, of):
    """Of L = 1 + (x + z)/2 around a viewer at -y, whose reflected ray is 2(n·v)n - v."""
    light = np.sqrt(4 * np.pi) * np.array([1, 0, 0.5 / np.sqrt(3), 0.5 / np.sqrt(3)])
    ax = plot.ball(light, of=of, toward=FRONT, exposure=0.4, resolution=128)
    x, z, minus_y = spots(rng)
    if of == "mirror":
        expected = 1 + minus_y * (x + z)  # twice x·cos, halved
    elif of == "diffuse":
        expected = 1 + (x + z) / 3  # a linear light is dimmed to 2/3
    else:
        expected = 1 + (x + z) / 2
    picture = shown(ax)
    row, column = (64 - 64 * z).astype(int), (64 + 64 * x).astype(int)
    found = 255 * picture[row, column, :3]
    # 1.0 measured.
    np.testing.assert_allclose(found.T, encoded(0.4 * expected)[None].repeat(3, 0), rtol=0, atol=2)
    names = {t.get_text(): t.get_position() for t in ax.texts}
    assert np.allclose(names["−y"], 0, atol=1e-6)
    if of == "mirror":  # half way to +x
        assert np.allclose(names["+x"], (np.sqrt(0.5), 0), atol=1e-6)
    else:
        assert names["+x"][0] > 1
        assert "+y" not in names


@pytest.mark.slow
def test_a_ball_takes_pictures_and_marks_negative_light():
    picture = np.ones((16, 32, 3), np.float32)
    picture[:8] = 0.2  # above, dark
    ball = shown(plot.ball(picture, toward=FRONT, exposure=1.0, resolution=32))
    assert near(255 * ball[4, 16, :3], encoded(0.2), 2)
    assert near(255 * ball[28, 16, :3], encoded(1.0), 2)
    assert ball[0, 0, 3] == 0
    ax = plot.ball(np.array([1.0, 0, 3, 0]), toward=FRONT, resolution=64)
    (text,) = ax.get_legend().get_texts()
    # z < -1/√27 of the disc: (arccos t - t √(1 - t²))/π
    t = 1 / np.sqrt(27)
    share = (np.arccos(t) - t * np.sqrt(1 - t * t)) / np.pi
    assert text.get_text().startswith(f"negative: {100 * share:.2g} % of the disc")
    assert near(pixels(ax.figure), (255, 0, 255), 90).any()
    with pytest.raises(ValueError, match="expected toward as a direction"):
        plot.ball(picture, toward=np.zeros(3))


@pytest.mark.parametrize("projection", ["equal-area", "equidistant"])
def test_a_dome_is_seen_from_above(rng, projection):
    """Radiance 2 + x + y/2 (gray) at places of which zenith angle and azimuth are known."""

    def sky(view):
        return 2 + view[:, :1] + view[:, 1:2] / 2

    ax = plot.dome(sky, projection=projection, exposure=0.25, resolution=128)
    radius, angle = rng.uniform(0.05, 0.95, 30), rng.uniform(0, 2 * np.pi, 30)
    theta = np.arccos(1 - radius**2) if projection == "equal-area" else radius * np.pi / 2
    expected = 2 + np.sin(theta) * (np.cos(angle) + np.sin(angle) / 2)
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    found = 255 * shown(ax)[(64 - 64 * y).astype(int), (64 + 64 * x).astype(int), 0]
    np.testing.assert_allclose(found, encoded(0.25 * expected), rtol=0, atol=2)  # 0.6


def test_a_dome_in_false_color_has_its_unit_and_suns():
    light = np.array([1.0, 0, 0, 0.4])
    suns = np.array([[0.6, 0, 0.8], [0, 0, -1.0]])
    ax = plot.dome(light, label="luminance, kcd/m²", suns=suns, limits=(0.0, 1.0), resolution=32)
    (bar,) = ax.figure.axes[1:]
    assert bar.get_ylabel() == "luminance, kcd/m²"
    assert len(ax.lines) == 2  # one sun, black and white; the other one is below
    np.testing.assert_allclose(ax.lines[0].get_xydata(), [[np.sqrt(0.2), 0]], rtol=0, atol=1e-7)
    center = 255 * np.array(matplotlib.colormaps["viridis"](np.sqrt(1 / 4 / np.pi))[:3])
    assert near(at(ax, [(0.03, 0.03)]), center, 6).all()
    signed = plot.dome(light - np.array([1.0, 0, 0, 0]), label="error", resolution=32)
    left, right = 255 * shown(signed)[16, [1, 30], :3]
    assert left[2] > left[0] + 60
    assert right[0] > right[2] + 60


@pytest.mark.parametrize(
    ("sky", "options", "message"),
    [
        (np.ones((2, 4)), {}, "expected sky as coefficients"),
        (lambda view: view[:, 0], {}, r"expected sky to give radiance \(N, 1\) or \(N, 3\)"),
        (lambda view: view[:, :1] / 0, {}, "the radiance of sky must be finite"),
        (np.ones(4), {"log": True}, "limits and log are for false color"),
        (np.ones(4), {"suns": np.zeros(3)}, "expected suns as directions"),
        (np.ones(4), {"suns": np.ones(2)}, "expected suns as directions"),
    ],
)
@pytest.mark.filterwarnings("ignore:divide by zero", "ignore:invalid value")
def test_dome_refuses(sky, options, message, unchecked):
    with pytest.raises(ValueError, match=message):
        plot.dome(sky, resolution=4, **options)


def test_coefficients_stand_in_their_places(rng):
    values = rng.normal(size=9)
    (ax,) = plot.coefficients(values, limits=2.0)
    texts = {tuple(text.get_position()): text.get_text() for text in ax.texts}
    l = [0, 1, 1, 1, 2, 2, 2, 2, 2]
    m = [0, -1, 0, 1, -2, -1, 0, 1, 2]
    ramp = matplotlib.colormaps["RdBu_r"]
    corners = np.stack([np.array(m) + 0.4, np.array(l) + 0.4], axis=-1)  # beside the numbers
    expected = 255 * ramp(np.clip(values / 4 + 0.5, 0, 1))[:, :3]
    np.testing.assert_allclose(at(ax, corners), expected, rtol=0, atol=2)
    for value, place in zip(values, zip(m, l, strict=True), strict=True):
        assert texts[place] == f"{value:.2g}".replace("-", "−")
    (bar,) = ax.figure.axes[1:]
    assert bar.get_ylabel() == "coefficient cₗₘ, in f · √sr"
    assert [ax.get_title() for ax in plot.coefficients(np.ones((3, 4)))] == ["R", "G", "B"]
    axes = Figure().subplots(1, 2)
    assert list(plot.coefficients(np.zeros((2, 4)), ax=axes, colorbar=False)) == list(axes)


def test_the_basis_stands_in_its_places():
    ax = plot.basis(2, toward=FRONT, resolution=32)
    directions = np.array([[0.4, -np.sqrt(0.8), 0.2]]).repeat(9, 0)
    directions[:, 1] = -np.sqrt(1 - 0.4**2 - 0.2**2)
    l = np.array([0, 1, 1, 1, 2, 2, 2, 2, 2])
    m = np.array([0, -1, 0, 1, -2, -1, 0, 1, 2])
    theta = np.arccos(directions[:, 2])
    phi = np.arctan2(directions[:, 1], directions[:, 0])
    complex_ = special.sph_harm_y(l, abs(m), theta, phi)
    part = np.where(m < 0, complex_.imag, complex_.real)
    # Without the Condon-Shortley phase.
    value = np.where(m == 0, part, np.sqrt(2) * (-1.0) ** m * part)
    points = np.stack([m + 0.46 * 0.4, l - 0.46 * 0.2], axis=-1)
    limit = ax.figure.axes[1].get_ylim()[1]
    expected = 255 * matplotlib.colormaps["RdBu_r"](value / 2 / limit + 0.5)[:, :3]
    # A pixel of 32 is coarse: 4.5 measured.
    np.testing.assert_allclose(at(ax, points), expected, rtol=0, atol=8)
    assert limit == pytest.approx(np.sqrt(5 / 4 / np.pi), rel=0.1)  # of y_20 at the pole
