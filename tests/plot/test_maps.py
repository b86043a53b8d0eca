"""Errors over parameters, arrows, transfer on a mesh, and what all pictures have in common."""

import matplotlib
import numpy as np
import pytest
from drawn import at, hue
from matplotlib import pyplot
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.text import Text

from jaxsh import geometry, imaging, plot

ORANGE = (224, 123, 57)
KNOT = geometry.knot(300)
CAMERA = imaging.Camera.facing(KNOT, width=48, height=48, margin=0.2)
WORDS = {"label": "error, %", "x_label": "elevation, °", "y_label": "turbidity"}


@pytest.mark.parametrize("numbers", [False, True])
def test_an_error_map_has_its_cells_where_the_parameters_are(rng, numbers):
    errors, x, y = rng.normal(size=(3, 4)), np.array([0.0, 1, 4, 9]), np.array([1.0, 2, 8])
    ax = plot.error_map(errors, x, y, **WORDS, numbers=numbers, limits=2.0)
    places = (np.arange(4.0) - 0.4, np.arange(3.0) + 0.4) if numbers else (x, y)
    points = np.stack(np.meshgrid(*places), axis=-1).reshape(-1, 2)
    expected = matplotlib.colormaps["RdBu_r"](np.clip(errors.ravel() / 4 + 0.5, 0, 1))[:, :3]
    np.testing.assert_allclose(at(ax, points), 255 * expected, rtol=0, atol=2)
    if numbers:
        said = [text.get_text().replace("−", "-") for text in ax.texts]
        assert said == [f"{error:.3g}" for error in errors.ravel()]
        assert [text.get_text() for text in ax.get_xticklabels()] == ["0", "1", "4", "9"]
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("elevation, °", "turbidity")
    assert ax.figure.axes[1].get_ylabel() == "error, %"


@pytest.mark.parametrize(
    ("errors", "x", "message"),
    [
        (np.ones((2, 2)), np.ones(3), "got shapes .2, 2., .3,. and .2,."),
        (np.ones((2, 2)), np.ones(2), "expected x to rise"),
        (np.ones((2, 0)), np.ones(0), "there is nothing to draw"),
        (-np.ones((2, 2)), np.arange(2.0), "log needs values that are not negative"),
    ],
)
def test_error_map_refuses(errors, x, message, unchecked):
    with pytest.raises(ValueError, match=message):
        plot.error_map(errors, x, np.arange(2.0), **WORDS, log=True)


def test_gradients_point_where_light_grows():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1], [1, 0, 1]], float)
    slopes = np.array([[2, 9, 0], [0, 9, 1], [-1, 9, -1], [0, 9, 0]], float)
    ax = plot.gradients(
        points, slopes, values=np.arange(4.0), label="L, W", unit="W/m", plane="xz", length="m"
    )
    arrows = next(c for c in ax.collections if hasattr(c, "U"))
    np.testing.assert_array_equal(np.stack([arrows.U, arrows.V], axis=-1), slopes[:3, [0, 2]])
    np.testing.assert_array_equal(arrows.XY, points[:3, [0, 2]])
    # The longest is 0.9 of the distance between points, (area / 4)^(1/2).
    assert 2 / arrows.scale == pytest.approx(0.9 * 0.5)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x, m", "z, m")
    assert ax.figure.axes[1].get_ylabel() == "L, W"
    key = next(a for a in ax.artists if type(a).__name__ == "QuiverKey")
    assert key.text.get_text() == "2 W/m"
    still = plot.gradients(points, 0 * slopes, mesh=KNOT)  # no arrow, and no scale of none
    assert not any(type(a).__name__ == "QuiverKey" for a in still.artists)


def test_gradients_refuse(unchecked):
    points = np.eye(3)
    with pytest.raises(ValueError, match=r"expected points and gradient \(N, 3\)"):
        plot.gradients(points, points[:2])
    with pytest.raises(ValueError, match=r"expected values \(3,\), got shape \(2,\)"):
        plot.gradients(points, points, values=np.ones(2))
    with pytest.raises(ValueError, match="at no points"):
        plot.gradients(points[:0], points[:0])


@pytest.mark.slow
def test_transfer_lobes_stand_at_their_vertices():
    seen = np.asarray(imaging.rasterize(KNOT, CAMERA, samples=2).face)
    vertex = int(KNOT.faces[seen[seen >= 0][40]][0])
    round_ = np.zeros((300, 4))
    round_[:, 0] = np.sqrt(4 * np.pi) * 3  # a ball of |f| = 3 at each
    ax = plot.transfer_lobes(KNOT, round_, [vertex], camera=CAMERA, size=0.1, unit="sr")
    balloon = np.asarray(ax.get_images()[1].get_array())
    rows, columns = np.nonzero(balloon[..., 3] > 0.5)
    # The camera's own projection of the vertex.
    position, target = np.asarray(CAMERA.position), np.asarray(CAMERA.target)
    forward = (target - position) / np.linalg.norm(target - position)
    right = np.cross(forward, [0, 0, 1])
    right = right / np.linalg.norm(right)
    up = np.cross(right, forward)
    offset = np.asarray(KNOT.vertices)[vertex] - position
    scale = 24 / np.tan(np.radians(15)) / (offset @ forward)
    assert columns.mean() + 0.5 == pytest.approx(24 + scale * (offset @ right), abs=0.15)  # 0.07
    assert rows.mean() + 0.5 == pytest.approx(24 - scale * (offset @ up), abs=0.15)
    diagonal = np.linalg.norm(np.ptp(np.asarray(KNOT.vertices), axis=0))
    area = np.pi * (scale * 0.1 * diagonal) ** 2
    assert balloon[..., 3].sum() == pytest.approx(area, rel=0.04)  # 0.019
    assert hue(255 * balloon[rows, columns, :3], ORANGE).mean() > 0.9
    said = [text.get_text() for text in ax.texts]
    assert said[1].startswith("|transfer| = ")
    assert said[1].endswith(" sr")
    hidden = np.setdiff1d(np.arange(300), np.asarray(KNOT.faces)[np.unique(seen[seen >= 0])])[0]
    with pytest.raises(ValueError, match=f"that the camera sees, got {hidden}: it is hidden"):
        plot.transfer_lobes(KNOT, round_, [vertex, int(hidden)], camera=CAMERA)
    with pytest.raises(ValueError, match=r"expected coefficients \(300, K\)"):
        plot.transfer_lobes(KNOT, round_[:4], camera=CAMERA)


def test_pictures_stand_upright_whatever_the_style_says():
    with pyplot.rc_context({"image.origin": "lower"}):
        light = np.array([1.0, 0, 0.5, 0])
        kinds = np.arange(300, dtype=np.uint8) % 3
        axes = [Figure().add_subplot() for _ in range(5)]
        plot.ball(light, ax=axes[0], resolution=8)
        plot.coefficients(light, ax=axes[1])
        plot.dome(light, ax=axes[2], resolution=8)
        plot.light(light, ax=axes[3], height=8)
        plot.vertices(KNOT, kinds, label="kind", ax=axes[4], camera=CAMERA)
        for ax in axes:
            assert [image.origin for image in ax.get_images()] == ["upper"]
    axes[1].figure.tight_layout()  # warns where it would lay the color bar over the picture


@pytest.mark.slow
def test_every_picture_can_be_read_on_a_dark_ground():
    """Text stands out from what it is on: it follows the style, or is outlined or in a cell."""
    with pyplot.style.context("dark_background"):
        axes = [figure.add_subplot() for figure in (Figure() for _ in range(11))]
        light = np.array([1.0, 0, 0.5, 0])
        plot.ball(light, ax=axes[0], resolution=8)
        plot.balloon(light, ax=axes[1], resolution=8)
        plot.bands(light, ax=axes[2], labels=["f"])
        plot.basis(1, ax=axes[3], resolution=8)
        plot.dome(light, ax=axes[4], label="L", resolution=8)
        plot.gradients(np.eye(3), np.eye(3), ax=axes[5])
        plot.light(light, ax=axes[6], height=8)
        plot.lobes(light, ax=axes[7], resolution=8)
        plot.shaded(KNOT, np.ones((300, 3)), ax=axes[8], camera=CAMERA)
        plot.transfer_lobes(KNOT, np.ones((300, 4)), ax=axes[9], camera=CAMERA, count=1)
        plot.vertices(KNOT, np.ones(300), label="one", ax=axes[10], camera=CAMERA)
        for ax in axes:
            for text in ax.figure.findobj(Text):
                if text.get_text() and text.get_visible() and not text.get_path_effects():
                    assert min(to_rgb(text.get_color())) > 0.6, text
