"""The experiments on Lee & Kim 2014's numbers, end to end and small."""

import functools
import json
import math
import tomllib
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from pictures import assert_picture

import experiments
from experiments.leekim2014.methods import product_flops, rival
from experiments.leekim2014.moving import eyes
from experiments.leekim2014.scenes import (
    PAPER,
    Quality,
    Row,
    Scenes,
    rows_or_default,
    vertex_psnr,
)
from experiments.leekim2014.table1_report import gains, verdict
from experiments.leekim2014.table2 import PAPER as PAPER_BY_DEGREE
from experiments.leekim2014.table2 import break_even
from experiments.leekim2014.threshold import effects
from experiments.runner import Data
from experiments.runner.cli import main
from experiments.runner.context import Context

# All at degree 4 but table2, so that they share what is compiled.
OPTIONS = {
    "table1": ["--methods", "masks", "tiles", "--views", "64"],
    "table2": ["--degrees", "2", "--methods", "two_stage"],
    "threshold": ["--methods", "two_stage", "--variants", "smoothed"],
    "exponent": ["--methods", "tiles", "--exponents", "8", "1000"],
}


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Each experiment's folder, table and rows, without a data folder, run when asked for."""

    @functools.cache
    def run(name):
        out = tmp_path_factory.mktemp("results")
        with pytest.MonkeyPatch.context() as patch:
            patch.delenv("JAXSH_DATA", raising=False)
            words = ["run", f"leekim2014.{name}", "--out", str(out), "--no-progress"]
            small = ["--frames", "1", "--directions", "64"]
            assert main([*words, *small, *OPTIONS[name]]) == 0
        folder = out / f"leekim2014.{name}" / "quick"
        rows = json.loads((folder / "metrics.json").read_text())
        return folder, (folder / "table.md").read_text(), rows

    return run


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    context = Context(tmp_path_factory.mktemp("scene"), Data())
    [row] = rows_or_default(context, (), 4)
    return Scenes(context, [row], directions=64).load(row)


class TestScene:
    @pytest.mark.slow
    def test_the_brightest_percent_that_faces_the_eye_is_above_white(self, scene):
        largest = np.asarray(scene.full()).max(axis=1)[np.asarray(scene.facing)]
        assert np.percentile(largest, 99) == pytest.approx(1, abs=1e-4)

    @pytest.mark.slow
    def test_a_cut_scene_has_the_leading_coefficients(self, scene):
        lower = scene.cut(2)
        assert lower.row.degree == lower.baked.degree == 2
        np.testing.assert_array_equal(lower.light, scene.light[:, :9])
        np.testing.assert_array_equal(scene.baked.coefficients[:, :9], lower.baked.coefficients)

    def test_no_error_without_a_difference(self, scene):
        color = scene.full()
        assert scene.quality(color, color) == Quality(math.inf, math.inf, math.inf)

    def test_errors_of_an_offset(self, scene):
        """A constant offset below white: the background, which has none, lifts the image's PSNR."""
        dark = jnp.full((len(scene.baked.positions), 3), 0.25)
        quality = scene.quality(dark + 0.1, dark)
        share = float(jnp.mean(scene.raster.mask))
        assert quality.object == pytest.approx(20, abs=1e-3)
        assert quality.vertex == pytest.approx(20, abs=1e-3)
        assert quality.image == pytest.approx(20 - 10 * math.log10(share), abs=1e-3)

    def test_what_is_above_white_or_turned_away_is_no_error(self):
        color = jnp.array([[1.5, 1.0, 3.0], [0.2, 0.2, 0.2], [9.0, 0.0, 0.0]])
        reference = jnp.array([[2.0, 1.0, 1.0], [0.3, 0.3, 0.3], [0.0, 0.0, 0.0]])
        facing = jnp.array([True, True, False])
        assert vertex_psnr(color, reference, facing) == pytest.approx(-10 * math.log10(0.005))

    def test_eyes_go_around_the_vertical(self, scene):
        path = np.stack(eyes(scene, 5, 90.0))
        np.testing.assert_allclose(path[0], scene.eye, rtol=0, atol=1e-6)
        np.testing.assert_allclose(path[4], path[0], rtol=0, atol=1e-5)
        np.testing.assert_allclose(path[2][:2], -path[0][:2], rtol=0, atol=1e-5)
        np.testing.assert_allclose(path[:, 2], path[0, 2])


class TestTable1:
    @pytest.mark.slow
    def test_the_full_forms_agree(self, results):
        [about] = [row for row in results("table1")[2] if "vertices" in row]
        assert about["largest_difference"] < 2e-5

    @pytest.mark.slow
    def test_gains_are_ratios_of_frames(self, results):
        _, table, rows = results("table1")
        [about] = [row for row in rows if "vertices" in row]
        lines = [row for row in rows if "method" in row]
        assert [row["method"] for row in lines] == ["masks", "tiles"]
        for row in lines:
            for key, name in (("gain", "full"), ("gain_einsum", "einsum")):
                assert row[key] == pytest.approx(row["fps"] / about[f"fps {name}"])
        assert "ANOTHER MACHINE" in table

    @pytest.mark.slow
    def test_tiles_are_far_better_than_the_filter(self, results):
        masks, tiles = (row for row in results("table1")[2] if "method" in row)
        assert masks["psnr_object"] + 14 < tiles["psnr_object"]
        assert masks["psnr_object"] < masks["psnr_image"]

    @pytest.mark.slow
    def test_shares_are_filtered_out(self, results):
        [about] = [row for row in results("table1")[2] if "vertices" in row]
        assert 0 < about["filtered_specular_mean"] <= about["filtered_specular"] < 1
        assert 0 < about["filtered_diffuse"] < 1

    @pytest.mark.slow
    def test_everything_moves(self, results):
        [row] = [row for row in results("table1")[2] if "moving_gain" in row]
        assert row["moving_psnr"] >= row["moving_psnr_worst"] > 25

    def test_the_papers_gains_are_its_frames(self):
        for paper in PAPER.values():
            assert paper.adaptive / paper.full == pytest.approx(paper.gain, abs=0.011)

    def test_the_paper_preset_has_the_papers_rows(self):
        [folder] = experiments.__path__
        text = (Path(folder) / "leekim2014" / "table1.toml").read_text()
        assert [Row(*row) for row in tomllib.loads(text)["paper"]["rows"]] == list(PAPER)

    def test_where_the_gain_holds(self):
        lines = [
            {"method": "levels", "gain": 0.5, "gain_product": 1.5, "gain_einsum": 2.0},
            {"method": "levels", "gain": 0.7, "gain_product": 0.9, "gain_einsum": 3.0},
        ]
        full, product, einsum = gains(lines)
        assert (full["least"], full["median"], full["most"]) == (0.5, pytest.approx(0.6), 0.7)
        assert [row["faster"] for row in (full, product, einsum)] == [0, 1, 2]
        assert [row["holds"] for row in (full, product, einsum)] == [0, 0, 1]
        assert "2.00 to 3.00 × against einsum (1 of 2 scenes" in verdict([full, product, einsum])

    def test_rivals(self):
        times = {"full": 9.0, "degree 2": 1.0, "degree 3": 2.0, "degree 4": 5.0}
        qualities = {f"degree {d}": Quality(0.0, 10.0 * d, 0.0) for d in (2, 3, 4)}
        assert rival(4.9, times, qualities) == {"rival": "degree 3", "rival_psnr_object": 30.0}
        assert rival(0.5, times, qualities)["rival"] == "degree 2"
        assert rival(9.5, times, qualities) == {"rival": "full", "rival_psnr_object": math.inf}

    def test_operations_of_the_product_form(self):
        """4.4 GFLOP a frame of 50,000 vertices at degree 10."""
        assert product_flops(49_990, 121) == pytest.approx(4.4e9, rel=0.01)


class TestTable2:
    @pytest.mark.slow
    def test_rows_and_plot(self, results):
        folder, table, rows = results("table2")
        assert [row["degree"] for row in rows if "fps full" in row] == [2]
        # Middle degree 2 above base 1 is all of degree 2: nothing is lost.
        [low] = [row for row in rows if row.get("method") == "two_stage"]
        assert low["psnr_object"] > 60  # that of eight bits
        assert_picture(folder / "figure11.png", timed=True)
        assert "(figure11.png)" in table

    def test_break_even_is_where_gains_stay_above_one(self):
        rows = [
            {"degree": degree, "method": "levels", "gain full": gain}
            for degree, gain in ((2, 1.2), (3, 0.8), (4, 1.1), (5, 1.5))
        ]
        assert break_even(rows, "levels", "gain full") == 4
        assert break_even(rows[:2], "levels", "gain full") is None

    def test_the_papers_own_break_even_is_at_level_5(self):
        rows = [
            {"degree": degree, "method": "levels", "gain": ours / full}
            for degree, (full, ours, _) in PAPER_BY_DEGREE.items()
        ]
        assert break_even(rows, "levels", "gain") == 5


class TestThreshold:
    @pytest.mark.slow
    def test_higher_thresholds_keep_fewer_and_lose_quality(self, results):
        folder, table, rows = results("threshold")
        plain = [row for row in rows if row["variant"] == "as it is"]
        assert [row["threshold"] for row in plain] == [0.005, 0.02, 0.08]
        for key in ("kept", "spent", "psnr_object"):
            assert (np.diff([row[key] for row in plain]) < 0).all()
        assert_picture(folder / "threshold.png", timed=True)
        assert "What each choice does" in table

    def test_effects_are_against_the_plain_method(self):
        at = {"method": "levels", "threshold": 0.02}
        rows = [
            at | {"variant": "as it is", "psnr_object": 40.0, "gain": 1.0},
            at | {"variant": "refined", "psnr_object": 43.0, "gain": 0.5},
            at | {"variant": "smoothed", "psnr_object": 39.0, "gain": 0.8},
        ]
        better, worse = effects(rows, 0.02)
        assert (better["psnr"], better["time"], better["judgement"]) == (3.0, 2.0, "helps")
        assert (worse["psnr"], worse["judgement"]) == (-1.0, "hurts")


class TestExponent:
    @pytest.mark.slow
    def test_rows_and_plot(self, results):
        folder, _, rows = results("exponent")
        assert [(row["exponent"], row["method"]) for row in rows] == [
            (8, "tiles"),
            (1000, "tiles"),
        ]
        assert all(row["psnr_object"] > 40 for row in rows)
        assert_picture(folder / "exponent.png", timed=True)
