"""Pictures of meshes: numbers in false color, and radiance."""

import jax.numpy as jnp
import matplotlib
import numpy as np
import pytest
from drawn import at, near, pixels
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from jaxsh import geometry, imaging, plot

SQUARE = geometry.make_mesh(
    np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], np.float32),
    np.array([[0, 1, 2], [0, 2, 3]]),
)
# In front of it at a distance of 4: 2 lengths across fill tan(30°)·4·2 = 4.6 in 32 pixels.
CAMERA = imaging.Camera((0.0, -4.0, 0.0), (0.0, 0.0, 0.0), fov_y=60.0, width=32, height=32)
PER_LENGTH = 16 / (4 * np.tan(np.radians(30)))


def where(x, z) -> np.ndarray:
    """Where points of the square are in the picture."""
    return np.stack([16 + PER_LENGTH * x, 16 - PER_LENGTH * z], axis=-1)


def points(rng):
    return rng.uniform(-0.8, 0.8, (2, 40))


def cells(x):
    """The middle of the pixel that a place of the picture is in."""
    return np.floor(x) + 0.5


@pytest.mark.parametrize("array", [np.asarray, jnp.asarray])
def test_vertices_have_the_color_of_their_number(rng, array):
    x, z = points(rng)
    values = array(np.asarray(SQUARE.vertices)[:, 0] + 3.0)  # 2 to 4, linear in x
    ax = plot.vertices(
        SQUARE, values, label="x + 3, m", camera=CAMERA, relief=0.0, limits=(1.5, 4.5)
    )
    pixel = cells(where(x, z))
    exact = (pixel[:, 0] - 16) / PER_LENGTH + 3
    expected = 255 * matplotlib.colormaps["viridis"]((exact - 1.5) / 3)[:, :3]
    # Of 8 bits and a ramp of 256 colors; 1.0 measured.
    np.testing.assert_allclose(at(ax, pixel), expected, rtol=0, atol=1.5)
    (bar,) = ax.figure.axes[1:]
    assert bar.get_ylabel() == "x + 3, m"
    assert bar.get_ylim() == (1.5, 4.5)


def test_signed_numbers_go_around_zero():
    ax = plot.vertices(SQUARE, SQUARE.vertices[:, 0] + 0.5, label="error", camera=CAMERA)
    (bar,) = ax.figure.axes[1:]
    assert bar.get_ylim() == (-1.5, 1.5)
    zero, plus, minus = at(ax, where(np.array([-0.5, 0.9, -0.9]), np.zeros(3)))
    assert zero.min() > 235  # white, but for the relief
    assert plus[0] > plus[2] + 60
    assert minus[2] > minus[0] + 20


def test_the_bar_of_length_is_true():
    ax = plot.vertices(SQUARE, np.ones(4), label="one", camera=CAMERA, length="m")
    (line,) = ax.lines
    number, unit = ax.texts[-1].get_text().split()
    assert unit == "m"
    # The square is at one depth: that of its middle.
    assert np.ptp(line.get_xdata()) / PER_LENGTH == pytest.approx(float(number), rel=1e-5)


def test_kinds_have_a_color_each():
    kinds = np.array([7, 7, 7, 7])
    kinds[2] = 3
    ax = plot.vertices(SQUARE, kinds, label="degree", camera=CAMERA)
    (bar,) = ax.figure.axes[1:]
    assert [text.get_text() for text in bar.get_yticklabels()] == ["3", "7"]
    inside = np.array([False, False, True, True])
    seen = {"camera": CAMERA, "relief": 0.0}
    ax = plot.vertices(SQUARE, inside, label="z > 0", names=["no", "yes"], **seen)
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["no", "yes"]
    above, below = at(ax, where(np.zeros(2), np.array([0.97, -0.97])))
    assert near(above, 255 * np.array(to_rgb("#e07b39")), 12)
    assert near(below, 158, 12)


@pytest.mark.slow
def test_a_picture_is_cut_to_the_mesh_and_smooth_at_its_edge():
    knot = geometry.knot(300)
    ax = plot.vertices(knot, knot.vertices[:, 2], label="z", colorbar=False)
    (image,) = ax.get_images()
    alpha = np.asarray(image.get_array())[..., 3]
    columns = np.flatnonzero(alpha.any(axis=0))
    left, right = ax.get_xlim()
    assert left == pytest.approx(columns[0] - 0.04 * alpha.shape[1], abs=0.1)
    assert right == pytest.approx(columns[-1] + 1 + 0.04 * alpha.shape[1], abs=0.1)
    assert ((alpha > 0) & (alpha < 1)).any()
    assert ax.figure.axes == [ax]


@pytest.mark.slow
def test_relief_darkens_what_is_seen_edge_on():
    ball = geometry.make_mesh(np.asarray(geometry.knot(300).vertices), geometry.knot(300).faces)
    camera = imaging.Camera.facing(ball, width=64, height=64)
    flat, round_ = (
        plot.vertices(ball, np.ones(300), label="one", camera=camera, relief=relief)
        for relief in (0.0, 0.5)
    )
    flat, round_ = (np.asarray(ax.get_images()[0].get_array()) for ax in (flat, round_))
    inside = flat[..., 3] == 1
    assert np.ptp(flat[inside][:, :3], axis=0).max() < 1e-6
    share = round_[inside][:, 0] / flat[inside][:, 0]
    assert 0.5 <= share.min() < 0.75
    assert 0.97 < share.max() <= 1


def test_shaded_is_the_picture_of_imaging(rng):
    radiance = rng.uniform(0.1, 1, (4, 3))
    ax = plot.shaded(SQUARE, radiance, camera=CAMERA, exposure=0.8)
    raster = imaging.rasterize(SQUARE, CAMERA, samples=2)
    expected = imaging.tone_map(imaging.interpolate(raster, jnp.asarray(radiance)), 0.8)
    shown = np.asarray(ax.get_images()[0].get_array())
    inside = np.asarray(raster.mask)
    assert inside.sum() > 100
    np.testing.assert_allclose(shown[..., :3][inside], expected[inside], rtol=0, atol=1e-6)
    np.testing.assert_array_equal(shown[..., 3], np.asarray(raster.alpha))
    assert ax.get_legend() is None
    gray = plot.shaded(SQUARE, radiance[:, :1].astype(np.float32), camera=CAMERA)
    assert np.ptp(np.asarray(gray.get_images()[0].get_array())[..., :3], axis=-1).max() == 0


def test_shaded_marks_negative_radiance():
    radiance = np.array([[-1.0], [1], [1], [-1]])  # negative on the left half
    ax = plot.shaded(SQUARE, radiance, camera=CAMERA)
    (text,) = ax.get_legend().get_texts()
    assert text.get_text() == "negative: 50 % of the mesh, down to −0.94"
    magenta = near(pixels(ax.figure), (255, 0, 255), 90)
    columns = np.argwhere(magenta)[:, 1]
    middle = ax.transData.transform((16, 16))[0]
    assert len(columns) > 50
    assert (columns < middle + 4).mean() > 0.9  # the rest is the legend's


@pytest.mark.parametrize(
    ("values", "options", "message"),
    [
        (np.ones(3), {}, r"expected values \(4,\), one per vertex, got shape \(3,\)"),
        (np.ones((4, 3)), {}, "for radiance see plot.shaded"),
        (np.array([1, np.nan, 0, 0]), {}, "values must be finite, got 1 of 4"),
        (-np.ones(4), {"log": True}, "log needs values that are not negative, got -1"),
        (np.ones(4), {"log": True, "limits": (0, 1)}, "log needs limits above zero that differ"),
        (np.ones(4), {"limits": (1, 1)}, "expected limits with low < high"),
        (np.ones(4), {"limits": (1, 2, 3)}, r"expected limits as \(low, high\)"),
        (np.ones(4), {"limits": -1.0}, "limits must be a number > 0"),
        (np.ones(4), {"names": ["one"]}, "names are for integers and booleans"),
        (np.arange(4), {"log": True}, "limits and log are for values in floats"),
        (np.arange(4), {"names": ["one"]}, "expected 4 names, one per function, got 1"),
        (np.ones(4), {"relief": 2.0}, "relief must be a number >= 0 and <= 1"),
        (
            np.ones(4),
            {"camera": imaging.Camera((0.0, -4.0, 0.0), (0.0, -8.0, 0.0), width=4, height=4)},
            "expected a camera that sees the mesh",
        ),
        (np.ones(4), {"ax": Figure().add_subplot(projection="3d")}, "expected flat axes for ax"),
    ],
)
def test_vertices_refuse(values, options, message, unchecked):
    with pytest.raises(ValueError, match=message):
        plot.vertices(SQUARE, values, label="it", **{"camera": CAMERA} | options)


def test_logarithms_of_one_number_have_a_decade():
    ax = plot.vertices(SQUARE, np.full(4, 0.5), label="it", log=True, camera=CAMERA)
    bar = ax.figure.axes[1]
    assert bar.get_ylim() == pytest.approx((0.05, 0.5))
    ax.figure.canvas.draw()
    said = [text.get_text() for text in bar.get_yticklabels(minor=True) if text.get_text()]
    assert said
    assert not any("e" in text for text in said)


def test_shaded_refuses(unchecked):
    for radiance in (np.ones((3, 3)), np.ones((4, 2)), np.ones(4)):
        with pytest.raises(ValueError, match=r"expected radiance \(4, 3\) or \(4, 1\)"):
            plot.shaded(SQUARE, radiance, camera=CAMERA)
