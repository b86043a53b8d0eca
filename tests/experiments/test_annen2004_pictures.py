"""The first experiments on Annen et al. 2004 end to end on the embedded data, small."""

import jax.numpy as jnp
import numpy as np
import pytest
import runs
from pictures import assert_picture
from PIL import Image

from experiments.annen2004.figure1_5 import Figure15
from experiments.annen2004.figure4 import Figure4
from experiments.annen2004.figure6 import Figure6, _unfolded
from experiments.annen2004.scenes import exact_expansion, psnr, three_lights
from experiments.annen2004.table1 import Table1
from experiments.runner import Context, Data
from experiments.shared.lights import rectangle
from experiments.shared.plots import Bar, Panel, draw_panels
from experiments.shared.subjects import load
from jaxsh import midrange

SMALL = ["--degree", "2", "--resolution", "16"]


@pytest.fixture
def run(tmp_path):
    def run(name, *options, small=False):
        return runs.run(tmp_path, f"annen2004.{name}", *SMALL, *options, small=small)

    return run


@pytest.mark.slow
def test_table1(run):
    folder, rows = run("table1", "--frames", "1", "--directions", "16")
    [model], stages = rows[:1], rows[1:]
    ways = ["without", "with", "exact per vertex", "exact with gradient"]
    assert [row["way"] for row in stages] == ways
    for row in stages[:2]:
        parts = [row[stage] for stage in ("trace", "project", "shade", "raster", "draw")]
        assert min(parts) > 0
        assert row["frame"] == pytest.approx(sum(parts))
        assert row["still"] == pytest.approx(sum(parts) - row["raster"])
    assert model["frame with"] == pytest.approx(1e3 / stages[1]["frame"])
    assert model["still ratio"] == pytest.approx(stages[0]["still"] / stages[1]["still"])
    assert "ratio_paper" not in model  # the knot is not in the paper
    table = (folder / "table.md").read_text()
    for title in ("Frames per second", "The same without the raster", "Milliseconds by stage"):
        assert f"## {title}" in table


@pytest.mark.slow
def test_three_lights_on_a_mesh(run):
    options = ["--directions", "16", "--size", "48", "--samples", "1"]
    folder, rows = run("figure1_5", *options)
    by = {(row["source"], row["method"]): row for row in rows}
    cube, exact = "16² cube", "exact"
    decibels = {key: row["psnr_object"] for key, row in by.items()}
    for source in (cube, exact):
        assert decibels[source, "with gradient"] > decibels[source, "one sample"] + 4
        half = decibels[source, "2³ grid, half gradient"]
        assert half > decibels[source, "2³ grid, no gradient"] + 6
        assert half > decibels[source, "2³ grid, whole gradient"] + 6
    assert decibels[cube, "second order"] > decibels[cube, "with gradient"] + 3
    for row in rows:
        assert row["psnr_picture"] > row["psnr_object"]
        # PSNR of vertices and their relative error tell the same error.
        same = row["psnr_vertices"] + 20 * np.log10(row["relative"])
        first = rows[0]["psnr_vertices"] + 20 * np.log10(rows[0]["relative"])
        assert same == pytest.approx(first, abs=1e-3)
    assert_picture(folder / "knot.png")
    assert "what the gradient gains" in (folder / "table.md").read_text()


@pytest.mark.slow
def test_moved_under_a_light(run):
    options = ["--directions", "16", "--size", "32", "--samples", "1", "--positions", "3"]
    folder, rows = run("figure4", *options, small=True)
    assert [row["x"] for row in rows] == pytest.approx([-0.8, 0, 0.8])
    for row in rows:
        assert row["second order"] > row["with gradient"] > row["one sample"]
    assert_picture(folder / "figure4.png")


@pytest.mark.slow
def test_incident_light_at_vertices(run):
    folder, rows = run("figure6", "--size", "8", "--quantiles", "0.5", "1")
    for row in rows:
        assert row["second order"] < row["with gradient"] < row["sample"]
        assert row["its own cube"] < row["with gradient"]
    assert rows[0]["with gradient"] < rows[1]["with gradient"]
    assert_picture(folder / "figure6.png")


@pytest.mark.parametrize(
    ("config", "wrong", "said"),
    [
        (Table1, {"frames": 0}, "frames"),
        (Table1, {"distance": 1.5}, "touch the mesh"),
        (Figure15, {"distance": 1.5}, "touch the mesh"),
        (Figure15, {"gain": 0.0}, "gain"),
        (Figure15, {"albedo": 1.5}, "albedo must be above 0 and at most 1"),
        (Figure4, {"positions": 4}, "odd"),
        (Figure4, {"height": 0.5}, "height must be above 1"),
        (Figure6, {"quantiles": (1.5,)}, "quantiles"),
        (Figure6, {"side": -1.0}, "side"),
    ],
)
def test_wrong_settings_of_near_light_are_refused(config, wrong, said):
    with pytest.raises(ValueError, match=said):
        config(**wrong)


def test_a_rectangle_faces_its_target(rng):
    center, target = rng.normal(size=(2, 3))
    for away in (target, center + np.array([0, 0, 2.0]), center - np.array([0, 0, 2.0])):
        corners = np.asarray(rectangle(center, away, (0.4, 0.2), (1.0, 1.0, 1.0)).vertices)
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[1])
        towards = away - center
        np.testing.assert_allclose(
            normal / 0.08, towards / np.linalg.norm(towards), rtol=0, atol=1e-15
        )
        np.testing.assert_allclose(corners.mean(axis=0), center, rtol=0, atol=1e-15)


def test_lights_of_the_scene_do_not_hide_each_other():
    lights = three_lights(3.0, 1.0)

    def lit(some, point):
        cube = midrange.capture(midrange.Scene(some), point, 32)
        return int(jnp.sum(jnp.any(cube.radiance > 0, axis=1)))

    for point in ([0.0, 0.0, 0.0], [0.9, 0.0, 0.1], [-0.5, 0.5, -0.7]):
        each = [lit([light], jnp.asarray(point)) for light in lights]
        assert min(each) > 0
        assert lit(lights, jnp.asarray(point)) == sum(each)


@pytest.mark.slow
def test_each_light_is_brightest_and_grows_towards_itself():
    lights, at = three_lights(3.0, 1.0), jnp.asarray([0.2, -0.3, 0.4])
    expansion = exact_expansion(lights, at, 1)
    assert (expansion.order, expansion.truncated(0).order) == (1, 0)
    for channel, light in enumerate(lights):
        towards = jnp.mean(light.vertices, axis=0) - at
        towards = towards / jnp.linalg.norm(towards)
        brightest = expansion.coefficients[channel, jnp.asarray([3, 1, 2])]  # l = 1 is (y, z, x)
        slope = expansion.gradient[channel, 0]
        assert jnp.dot(brightest, towards) > 0.8 * jnp.linalg.norm(brightest)
        assert jnp.dot(slope, towards) > 0.8 * jnp.linalg.norm(slope)


def test_psnr_has_its_peak_where_the_exposure_takes_it():
    reference = jnp.zeros((10, 3))
    assert psnr(reference + 0.05, reference, 2.0) == pytest.approx(20)  # 0.1 of 1


def test_the_unfolded_cube_is_whole():
    views, blank = _unfolded(4)
    grid = views.reshape(*blank.shape, 3)
    assert blank.sum() == blank.size / 2
    np.testing.assert_allclose(np.linalg.norm(views, axis=1), 1, rtol=2e-7)
    # Across the cross's inner edges neighbours are near each other.
    for first, second in ((grid[3, 4:8], grid[4, 4:8]), (grid[7, 4:8], grid[8, 4:8])):
        assert (np.sum(first * second, axis=-1) > 0.8).all()
    for column in (3, 7, 11):
        across = np.sum(grid[4:8, column] * grid[4:8, column + 1], axis=-1)
        assert (across > 0.8).all()


def test_panels_keep_their_pixels(tmp_path):
    image = np.zeros((40, 60, 3), np.float32)
    image[:, :30, 0] = 1
    draw_panels(
        tmp_path / "panels.png", [[Panel(image, "one"), Panel(image, "two")], [Panel(image)]]
    )
    shown = np.asarray(Image.open(tmp_path / "panels.png").convert("RGB"))
    red = (shown == [255, 0, 0]).all(axis=-1)
    assert red.sum() == 3 * 40 * 30


def test_bars_stand_below_their_panels(tmp_path):
    image = np.zeros((40, 60, 3), np.float32)
    names = {"base": (1.0, 0.0, 0.0), "rest": (0.0, 0.0, 1.0)}
    row = [Panel(image, "", Bar("part", names)), Panel(image, "", Bar.signed("error", 0.5))]
    draw_panels(tmp_path / "panels.png", [row])
    shown = np.asarray(Image.open(tmp_path / "panels.png").convert("RGB"))[43:]
    red, blue = ((shown == color).all(axis=-1) for color in ([255, 0, 0], [0, 0, 255]))
    assert red.sum() == pytest.approx(blue.sum(), rel=0.2)
    assert np.argwhere(red)[:, 1].max() < np.argwhere(blue)[:, 1].min() < 63
    bar = Bar.signed("error", 0.5)
    np.testing.assert_allclose(
        bar.paint(np.array([-0.5, 0.5]))[:, [0, 2]], [[0.02, 0.38], [0.4, 0.12]], rtol=0, atol=0.01
    )


def test_the_mesh_named_is_baked(tmp_path):
    context = Context(tmp_path, Data())
    subject = load(context, None, 1, directions=64)
    assert subject.name == "knot"
    assert subject.baked.degree == 1
    assert context.times["knot: bake"]["seconds"] > 0
    lower, upper = subject.box
    assert (lower < subject.centroid).all()
    assert (subject.centroid < upper).all()
