"""The experiments on what Annen et al. 2004 claim and leave open, end to end and small."""

import functools
import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import trimesh
from pictures import assert_picture

from experiments.annen2004.irradiance import (
    interpolate_records,
    irradiance,
    make_records,
    record_places,
)
from experiments.annen2004.methods import exact_samples, expand
from experiments.annen2004.orders import answer, on_front
from experiments.annen2004.scenes import three_lights
from experiments.runner.cli import main
from experiments.shared.lights import rectangle

OPTIONS = {
    "figure7": "--degree 1 --directions 64 --resolutions 32 --size 40 --samples 1",
    "figure8": "--degree 1 --directions 16 --resolution 32",
    "claims": "--degree 1 --directions 64 --distances 2 4 --counts 1 8 --grids 2 --records 64",
    "leaks": "--grids 5 --positions 100 --rounds 1",
    "orders": "--degree 1 --directions 64 --resolution 16 --orders 0 1 --grids 2 --rounds 1",
    "placement": "--degree 1 --directions 64 --distances 2 --counts 1 4 --grids 2 --frames 3 "
    "--limit 4 --size 32",
}


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    """A data folder with one small mesh."""
    folder = tmp_path_factory.mktemp("data")
    (folder / "meshes").mkdir()
    trimesh.creation.icosphere(subdivisions=3).export(folder / "meshes" / "ball.ply")
    return folder


@pytest.fixture(scope="module")
def results(tmp_path_factory, ball):
    """Each experiment's folder, table and rows, run when asked for."""

    @functools.cache
    def run(name):
        out = tmp_path_factory.mktemp("results")
        words = ["run", f"annen2004.{name}", "--data", str(ball), "--out", str(out)]
        assert main([*words, "--no-progress", *OPTIONS[name].split()]) == 0
        folder = out / f"annen2004.{name}" / "quick"
        rows = json.loads((folder / "metrics.json").read_text())
        return folder, (folder / "table.md").read_text(), rows

    return run


def pick(rows, key, **wanted):
    """The one row's value where all else is as wanted."""
    [row] = [row for row in rows if all(row.get(k) == value for k, value in wanted.items())]
    return row[key]


def assert_shown(folder, table, name):
    assert_picture(folder / name, timed=name == "orders.png")
    assert f"({name})" in table


@pytest.mark.slow
class TestFigure7:
    def test_gradients_help_and_those_of_edges_more(self, results):
        folder, table, rows = results("figure7")
        psnr = {row["name"]: row["psnr"] for row in rows}
        assert psnr["one sample"] < psnr["one, gradient"] < psnr["eight, gradient"]
        assert psnr["eight"] + 3 < psnr["eight, gradient"]
        assert psnr["one, gradient"] < psnr["one, edge gradient"]
        assert psnr["2³ grid, half gradient"] < psnr["2³ grid, half edge gradient"]
        assert [row["letter"] for row in rows if row["letter"]] == ["a", "b", "e", "f"]
        assert "| (a) < (b) < (f) |" in table
        assert_shown(folder, table, "figure7.png")


@pytest.mark.slow
class TestFigure8:
    def test_orders_fall_without_the_blocker_and_hardly_with_it(self, results):
        folder, table, rows = results("figure8")
        at = functools.partial(pick, rows, "error", distance=0.5)
        free = [at(method=order, scene="without it") for order in ORDERS]
        assert free[0] > 3 * free[1] > 4.5 * free[2]
        assert free[2] > free[3] > 0  # little more than what the texels leave
        hidden = [at(method=order, scene="with the blocker") for order in ORDERS]
        assert hidden[1] > 1.5 * free[1]
        assert hidden[3] > 0.8 * hidden[1]
        assert_shown(folder, table, "figure8.png")

    def test_the_gradient_of_edges_is_that_of_surfaces_where_nothing_hides(self, results):
        at = functools.partial(pick, results("figure8")[2], "error", distance=0.25)
        edges, surface = (
            [at(method=method, scene=scene) for scene in ("without it", "with the blocker")]
            for method in ("first order, edge gradient", "first order")
        )
        assert edges[0] == pytest.approx(surface[0], rel=0.05)
        assert edges[1] < 0.75 * surface[1]


@pytest.mark.slow
def test_planes_keep_light_out_of_a_closed_box(results):
    _, table, rows = results("leaks")
    inside = functools.partial(pick, rows, "leak")
    assert inside(weights="plain") > 0.2
    assert inside(weights="distances (Majercik et al.)") > 0.2
    assert inside(weights="planes") < 1e-6
    outside = {row["weights"]: row["error"] for row in rows}
    assert outside["planes"] < 1.05 * outside["plain"]
    assert "| planes | 0.0000 |" in table


ORDERS = "constant", "first order", "second order", "third order"


@pytest.mark.slow
class TestClaims:
    def test_error_falls_with_distance_samples_gradients_and_orders(self, results):
        folder, table, rows = results("claims")
        psnr = {
            (row["method"], row["samples"], row["distance"]): row["psnr"]
            for row in rows
            if "distance" in row
        }
        for (method, samples, distance), value in psnr.items():
            if distance == 2:
                assert value < psnr[method, samples, 4.0]
        none, full = "k-means, no gradient", "k-means, gradient (eq. 15)"
        assert (
            psnr[none, 1, 4.0] + 9 < psnr[full, 1, 4.0] < psnr["second order, one sample", 1, 4.0]
        )
        assert psnr[none, 8, 4.0] + 9 < psnr[full, 8, 4.0]
        assert psnr["grid, no gradient", 8, 4.0] + 9 < psnr["grid, half gradient", 8, 4.0]
        assert_shown(folder, table, "claims.png")

    def test_goals_stand_in_the_table(self, results):
        table = results("claims")[1]
        for goal in ("| one + gradient, more than one | 9 |", "| second order from one | 42 |"):
            assert goal in table

    def test_records_with_gradients_beat_those_without(self, results):
        rival = {(r["rival"], r["count"]): r["whole"] for r in results("claims")[2] if "rival" in r}
        [plain, slopes] = [
            psnr for (name, _), psnr in rival.items() if name.startswith("Ward & Heckbert")
        ]
        assert plain + 6 < slopes


class TestOrders:
    @pytest.mark.slow
    def test_stages_add_up_and_the_front_is_a_front(self, results):
        folder, table, rows = results("orders")
        assert [(row["samples"], row["order"]) for row in rows] == [(1, 0), (1, 1), (8, 0), (8, 1)]
        for row in rows:
            assert row["total"] == pytest.approx(row["capture"] + row["project"] + row["shade"])
            assert row["exact"] > row["cubes"] - 1
        best = max(rows, key=lambda row: row["exact"])
        fastest = min(rows, key=lambda row: row["total"])
        assert best["front exact"]
        assert fastest["front exact"]
        assert answer(rows) in table
        assert_shown(folder, table, "orders.png")

    def test_the_front_and_the_answer(self):
        rows = [
            {"samples": 1, "order": 0, "project": 1.0, "total": 2.0, "exact": 20.0},
            {"samples": 1, "order": 1, "project": 2.0, "total": 3.0, "exact": 30.0},
            {"samples": 1, "order": 2, "project": 9.0, "total": 18.0, "exact": 40.0},
            {"samples": 8, "order": 0, "project": 8.0, "total": 16.0, "exact": 29.0},
        ]
        for row in rows:
            row["front exact"] = on_front(row, rows, "exact")
        assert [row["front exact"] for row in rows] == [True, True, True, False]
        said = answer(rows)
        assert "from order 2 on one sample costs more than 8 samples of order 0" in said
        assert "order 1 1.50, order 2 9.00" in said


@pytest.mark.slow
class TestPlacement:
    def test_more_samples_are_better_wherever_they_are(self, results):
        folder, table, rows = results("placement")
        for method in ("k-means", "farthest point", "greedy"):
            one, four = (pick(rows, "psnr", method=method, samples=count) for count in (1, 4))
            assert one + 1 < four
        for name in ("placement.png", "frames.png", "animation.png"):
            assert_shown(folder, table, name)

    def test_samples_come_and_go(self, results):
        frames = [row for row in results("placement")[2] if "frame" in row]
        counts = [1, *(row["samples"] for row in frames)]
        for before, row in zip(counts, frames, strict=False):
            assert row["samples"] == before + row["added"] - row["removed"]
            assert 1 <= row["samples"] <= 4
        assert frames[0]["error"] < frames[0]["one"]


@pytest.fixture(scope="module")
def light():
    with jax.enable_x64(True):
        return rectangle((0.4, -0.3, 2.0), (0, 0, 0), (1.0, 0.8), (1.0, 0.5, 0.25))


class TestIrradianceGradients:
    @pytest.mark.slow
    def test_against_autodiff(self, light, rng):
        """∇_t with the normal fixed; ∇_r as the normal turns by a small angle."""
        with jax.enable_x64(True):
            points = jnp.asarray(rng.uniform(-0.5, 0.5, (4, 3)))
            normals = rng.normal(size=(4, 3)) * 0.4 + [0, 0, 1]  # some horizons cut the light
            normals[0] = [1, 0.2, 0.15]
            normals = jnp.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))
            records = make_records([light], points, normals)

            def moved(move, turn):
                turned = normals + jnp.cross(jnp.broadcast_to(turn[None], normals.shape), normals)
                value = irradiance([light], points + move[None], turned)
                return value, value

            zero = jnp.zeros(3)
            differentiate = jax.jacfwd(moved, argnums=(0, 1), has_aux=True)
            (translation, rotation), value = differentiate(zero, zero)
            np.testing.assert_allclose(records.value, value, rtol=1e-12)
            np.testing.assert_allclose(records.translation, translation, rtol=0, atol=1e-12)
            np.testing.assert_allclose(records.rotation, rotation, rtol=0, atol=1e-12)

    @pytest.mark.slow
    def test_a_record_is_exact_at_its_own_place(self, light, rng):
        with jax.enable_x64(True):
            points = jnp.asarray(rng.uniform(-0.5, 0.5, (4, 3)))
            normals = jnp.asarray(np.eye(3)[[0, 1, 2, 2]])
            records = make_records([light], points, normals)
            got = interpolate_records(records, points, normals)
            np.testing.assert_allclose(got, records.value, rtol=0, atol=1e-8)

    def test_places_are_distinct_vertices(self, rng):
        positions, normals = rng.normal(size=(2, 50, 3))
        chosen = record_places(positions, normals, 9, 0)
        assert len(np.unique(chosen)) == len(chosen) <= 9
        assert chosen.max() < 50


@pytest.mark.slow
def test_expansions_by_autodiff_of_the_surface_are_those_of_the_boundary(rng):
    with jax.enable_x64(True):
        lights, point = three_lights(2.0, 1.0), jnp.asarray(rng.uniform(-0.4, 0.4, (1, 3)))
        got, wanted = expand(lights, point, 1, 3).truncated(1), exact_samples(lights, point, 1)
        np.testing.assert_allclose(got.terms, wanted.terms, rtol=0, atol=1e-11)
