"""Balloons: what is large where, in which color, on what scale."""

import jax.numpy as jnp
import numpy as np
import pytest
from drawn import hue, near, pixels
from matplotlib import pyplot
from matplotlib.figure import Figure
from scipy import ndimage

from jaxsh import plot
from jaxsh._core import srgb

ORANGE, BLUE, MAGENTA = (224, 123, 57), (59, 125, 216), (255, 0, 255)
SMALL = 64  # pixels across a panel


def picture(ax) -> np.ndarray:
    """RGBA of a panel, before it is drawn: row 0 on top."""
    return np.asarray(ax.get_images()[0].get_array())


def test_lobes_stand_where_the_function_is_large():
    up, down = plot.lobes(np.array([[0, 0, 1.0, 0], [0, 0, -1.0, 0]]), resolution=SMALL)
    for ax, above, below in ((up, ORANGE, BLUE), (down, BLUE, ORANGE)):
        image = 255 * picture(ax)[..., :3] * (picture(ax)[..., 3:] == 1)
        rows = [np.argwhere(hue(image, color))[:, 0] for color in (above, below)]
        assert rows[0].mean() < SMALL / 2 < rows[1].mean()
        # Seen from above the horizon both balls of y_10 = √(3/4π) z are whole.
        assert len(rows[0]) == pytest.approx(len(rows[1]), rel=0.05)  # 0.027


def test_a_balloon_is_drawn_true_to_scale():
    """Of y_10 a ball |z| remains: of diameter 1 around (0, 0, ±1/2), as is known of ω·|cosθ|."""
    (ax,) = plot.lobes(np.array([0, 0, 1.0, 0]), toward=(0, -1, 0), resolution=SMALL)
    alpha = picture(ax)[..., 3]
    x, z = np.meshgrid(*2 * [1.12 * ((np.arange(SMALL) + 0.5) / SMALL * 2 - 1)])
    expected = np.minimum(np.hypot(x, z - 0.5), np.hypot(x, z + 0.5)) < 0.5
    unsure = ndimage.binary_dilation(expected, iterations=1) & ~ndimage.binary_erosion(
        expected, iterations=1
    )
    unsure |= np.hypot(x, z) < 0.15  # where the faces are as large as the balls are apart
    np.testing.assert_array_equal(alpha[~unsure] > 0.5, expected[~unsure])


@pytest.mark.slow
def test_lobes_scale_with_the_function():
    # A constant is a ball: its silhouette a disc, with the radius |f| as a share of the largest.
    both = np.array([[1.0], [0.5]])
    for same, ratio in ((True, 0.25), (False, 1.0)):
        areas = [
            picture(ax)[..., 3].sum() for ax in plot.lobes(both, same_scale=same, resolution=SMALL)
        ]
        assert areas[0] == pytest.approx(np.pi / 4 * (SMALL / 1.12) ** 2, rel=0.002)  # 4e-4
        assert areas[1] / areas[0] == pytest.approx(ratio, rel=0.01)  # 0.005


def test_the_bar_says_what_a_radius_means():
    # The largest value of the constant is √(1/4π)·c = 4: its radius is 1 in the picture.
    (ax,) = plot.lobes(np.array([4 * np.sqrt(4 * np.pi)]), unit="cd/m²", resolution=8)
    *_, bar = ax.lines
    assert ax.texts[-1].get_text() == "|f| = 2 cd/m²"
    assert np.ptp(bar.get_xdata()) == pytest.approx(2 / 4, rel=1e-6)


def test_lobes_turn_with_the_viewer():
    """A lobe towards +x stands on the right from the front, and on the left from behind."""
    lobe = np.array([1.0, 0, 0, 1.5])
    for toward, side in (((0, -1, 0.2), 1), ((0, 1, 0.2), -1)):
        (ax,) = plot.lobes(lobe, toward=toward, resolution=SMALL)
        columns = np.argwhere(picture(ax)[..., 3] > 0)[:, 1] - SMALL / 2
        assert side * columns.mean() > SMALL / 16


def test_lobes_keep_a_grid_and_take_axes():
    grid = plot.lobes(jnp.eye(4).reshape(2, 2, 4), titles="abcd", resolution=4)
    assert [ax.get_title() for ax in grid] == list("abcd")
    own = Figure().add_subplot()
    assert plot.lobes(np.ones(4), ax=own, resolution=4)[0] is own
    before = pyplot.get_fignums()
    axes = Figure().subplots(1, 2)
    assert list(plot.lobes(np.ones((2, 4)), ax=axes, resolution=4)) == list(axes)
    assert pyplot.get_fignums() == before
    assert plot.lobes(np.zeros(4), resolution=4)[0].texts[3:] == []  # no scale of nothing


def test_lobes_refuse():
    with pytest.raises(ValueError, match="expected 2 axes, one per function, got 1"):
        plot.lobes(np.ones((2, 1)), ax=Figure().add_subplot())
    with pytest.raises(ValueError, match="expected flat axes"):
        plot.lobes(np.ones(1), ax=Figure().add_subplot(projection="3d"))
    with pytest.raises(ValueError, match="expected 1 titles, one per function, got 2"):
        plot.lobes(np.ones(1), titles=["a", "b"])
    with pytest.raises(ValueError, match="no function to draw"):
        plot.lobes(np.ones((0, 4)))
    with pytest.raises(ValueError, match="expected toward as a direction"):
        plot.lobes(np.ones(1), toward=(0, 0, 0))


def test_a_balloon_has_the_color_of_its_light():
    # Red light from +x over blue light from everywhere; green is nowhere.
    light = np.zeros((3, 4))
    light[2, 0] = light[0, 0] = 1
    light[0, 3] = 1 / np.sqrt(3)  # red is zero at -x
    ax = plot.balloon(light, toward=(0, -1, 0), resolution=SMALL)
    image = 255 * picture(ax)[..., :3] * (picture(ax)[..., 3:] == 1)
    middle = srgb.decode(image[SMALL // 2] / 255)
    seen = middle[middle.any(axis=-1)]
    assert (seen[:, 1] < 1e-3).all()
    # Towards the viewer red is as bright as blue, and towards +x, seen edge on, twice as bright.
    assert middle[SMALL // 2, 0] / middle[SMALL // 2, 2] == pytest.approx(1, abs=0.05)  # 0.03
    assert seen[-1, 0] / seen[-1, 2] == pytest.approx(2, abs=0.1)  # 0.08: a pixel inside the edge
    dark = plot.balloon(np.array([0.0, 0, 0, 1]), toward=(0, -1, 0), resolution=SMALL)
    left = 255 * picture(dark)[:, : SMALL // 2 - 4]
    assert hue(left[..., :3] * (left[..., 3:] == 255), MAGENTA).sum() > 100
    with pytest.raises(ValueError, match=r"expected light \(K,\), \(1, K\) or \(3, K\)"):
        plot.balloon(np.ones((2, 4)))


def test_balloons_are_drawn_on_the_figure():
    (ax,) = plot.lobes(np.array([1.0]), resolution=SMALL)
    assert near(pixels(ax.figure), ORANGE, 30).sum() > 1000
