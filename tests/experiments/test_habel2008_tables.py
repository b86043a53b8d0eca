"""The experiments on Habel et al. 2008's numbers, end to end and small."""

import functools
import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from pictures import assert_picture

from experiments.habel2008.cost import SAMPLES, verdict
from experiments.habel2008.figure3 import smallest
from experiments.habel2008.numpy_twin import projection
from experiments.habel2008.solvers import condition
from experiments.habel2008.suns import Suns, polynomials, project
from experiments.runner import Data, UserError
from experiments.runner.cli import main
from jaxsh import sky, sphere

COARSE = ["--heights", "7", "--turbidities", "3", "--max-steps", "8"]
OPTIONS = {
    "figure3": ["--heights", "10", "--turbidities", "4", "--bands", "7", "--degrees", "13", "7"],
    "solvers": COARSE,
    "cost": ["--suns", "64", "--sampled", "4", "--rounds", "1"],
}


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Each experiment's folder, table and rows, without a data folder, run when asked for."""

    @functools.cache
    def run(name):
        out = tmp_path_factory.mktemp("results")
        with pytest.MonkeyPatch.context() as patch:
            patch.delenv("JAXSH_DATA", raising=False)
            experiment = f"habel2008.{name}"
            words = ["run", experiment, "--out", str(out), "--no-progress"]
            assert main([*words, *OPTIONS[name]]) == 0
        folder = out / experiment / "quick"
        rows = json.loads((folder / "metrics.json").read_text())
        return folder, (folder / "table.md").read_text(), rows

    return run


def at(rows, **wanted):
    [row] = [row for row in rows if all(row.get(key) == value for key, value in wanted.items())]
    return row


@pytest.mark.slow
class TestFigure3:
    def test_ours_beats_plain_polynomials_of_equal_size_and_the_papers_claim(self, results):
        rows = results("figure3")[2]
        for bands in (5, 7):
            plain = at(rows, model="polynomials of degree 13, 7", bands=bands)
            equal = at(rows, model='ours, table "precise", float64', bands=bands)
            fewer = at(rows, model='ours, table "small", float32', bands=bands)
            assert (plain["numbers"], equal["numbers"], fewer["numbers"]) == (112, 112, 72)
            assert 100 * equal["mean"] < plain["mean"]
            assert 30 * fewer["mean"] < plain["mean"]
            assert equal["mean"] < fewer["mean"] < 0.0055 < plain["mean"] < 0.37

    def test_rivals_are_worse_than_polynomials(self, results):
        rows = [row for row in results("figure3")[2] if row["bands"] == 7]
        plain = at(rows, family="plain")
        rivals = [row for row in rows if row["family"] == "rival"]
        assert len(rivals) == 5
        for row in rivals:
            assert row["numbers"] == plain["numbers"]
            assert row["mean"] > 1.5 * plain["mean"]

    def test_errors_grow_with_bands_and_the_largest_is_not_below_the_mean(self, results):
        rows = results("figure3")[2]
        for model in {row["model"] for row in rows}:
            mine = [row for row in rows if row["model"] == model]
            assert [row["bands"] for row in mine] == list(range(1, 8))
            for key in ("mean", "max", "mean channel", "mean harmonics", "mean range"):
                assert (np.diff([row[key] for row in mine]) >= 0).all()
            assert all(row["max"] >= row["mean"] for row in mine)

    def test_the_global_minimum_is_the_severest_reading(self, results):
        assert all(row["mean range"] >= row["mean"] for row in results("figure3")[2])

    def test_papers_figures_stand_beside_ours(self, results):
        rows = results("figure3")[2]
        claims = {
            r["bands"]: r["mean_paper"]
            for r in rows
            if r["family"] == "plain" and r.get("mean_paper")
        }
        assert claims == {1: 0.005, 2: 0.005, 3: 0.005, 4: 0.005, 5: 0.005, 7: 1.5}

    def test_picture(self, results):
        folder, table, _ = results("figure3")
        assert_picture(folder / "figure3.png")
        assert "(figure3.png)" in table

    def test_without_data_the_authors_tables_are_left_out_and_said_to_be(self, results):
        _, table, rows = results("figure3")
        assert not any(row["family"] == "published" for row in rows)
        assert "has no reference/habel2008_tables.npz" in table


class TestSolvers:
    def test_monomials_are_worse_conditioned_by_far(self):
        nodes = Suns.nodes(28, 16)
        assert condition("Chebyshev", nodes) < 10
        assert 1e4 < condition("scaled monomials", nodes) < 1e10
        assert condition("monomials", nodes) > 1e19

    @pytest.mark.slow
    def test_float32_ruins_monomials_and_no_chebyshev_series(self, results):
        rows = results("solvers")[2]
        solver = "lineax QR, linear"
        chebyshev = at(rows, basis="Chebyshev", solver=solver)
        monomials = at(rows, basis="monomials", solver=solver)
        assert chebyshev["residual"] == pytest.approx(1, abs=1e-6)
        assert monomials["residual"] == pytest.approx(1, abs=1e-2)
        assert chebyshev["error_float32"] == pytest.approx(chebyshev["error"], rel=0.02)
        assert monomials["error_float32"] > 1e3 * monomials["error"]

    @pytest.mark.slow
    def test_least_squares_in_one_step_and_gauss_newton_in_three(self, results):
        rows = results("solvers")[2]
        linear, newton = (
            at(rows, basis="Chebyshev", solver=name)
            for name in ("lineax QR, linear", "optimistix GaussNewton, lineax QR")
        )
        assert (newton["result"], newton["steps"]) == ("successful", 3)
        for row in (linear, newton):
            assert row["residual"] == pytest.approx(1, abs=1e-6)
            assert row["error_float32"] == pytest.approx(row["error"], rel=0.02)

    @pytest.mark.slow
    def test_gauss_newton_never_ends_in_monomials(self, results):
        rows = results("solvers")[2]
        bad = at(rows, basis="monomials", solver="optimistix GaussNewton, lineax QR")
        assert bad["steps"] == 8
        assert bad["result"].startswith("The maximum number of steps")


class TestCost:
    @pytest.mark.slow
    def test_bytes_are_the_papers(self, results):
        rows = results("cost")[2]
        seven = at(rows, what="the paper's, 7 bands")
        assert (seven["bytes"], seven["bytes_paper"]) == (131_712, 131_000)
        assert at(rows, what="the paper's, 4 bands, as for 7")["bytes"] == 43_008
        assert at(rows, what="the paper's, 4 bands, what gives its figure")["bytes"] == 28_672
        assert at(rows, what='ours, table "small", 7 bands')["bytes"] == 24_192

    @pytest.mark.slow
    def test_errors_of_what_is_timed(self, results):
        error = {row["way"]: row["error"] for row in results("cost")[2] if "way" in row}
        assert error["ours, jitted"] == error["ours, called as it is"] < 0.0055
        plain = error["polynomials of eq. 1 in Chebyshev form, jitted"]
        assert error["eq. 1 in NumPy, float64"] == pytest.approx(plain, rel=0.02)
        assert error["ours, jitted"] < plain < 0.37 < error[f"{SAMPLES:,} samples, jitted"] < 5

    @pytest.mark.slow
    def test_times_are_positive_and_the_verdict_names_the_faster(self, results):
        _, table, rows = results("cost")
        timed = [row for row in rows if "way" in row]
        assert all(row["one_us"] > 0 and row["per_sun_us"] > 0 for row in timed)
        ours, numpy = (at(timed, way=w) for w in ("ours, jitted", "eq. 1 in NumPy, float64"))
        wins = "JAX" if ours["one_us"] < numpy["one_us"] else "NumPy"
        assert f"For one sun {wins} wins" in verdict(timed)
        assert verdict(timed) in table


def test_numpy_projection_is_ours():
    spiral = sphere.fibonacci(256)
    views = np.asarray(spiral.directions)[np.asarray(spiral.directions)[:, 2] > 0]
    sun = np.array([0.6, 0.0, 0.8])
    radiance = sky.preetham_radiance(jnp.asarray(views), sun, 3.0)
    weight = 2 * np.pi / len(views)
    quadrature = sphere.Quadrature(jnp.asarray(views), jnp.full(len(views), weight, views.dtype))
    ours = sphere.project(radiance.T, quadrature, 6)
    np.testing.assert_allclose(projection(views, weight, 6)(sun, 3.0), ours, rtol=1e-4, atol=2e-4)


@pytest.mark.slow
def test_rows_hold_the_packages_own_measure_and_fit():
    """`fit_error` and `habel2008_fit` beside what the experiment does faster in NumPy."""
    from experiments.habel2008.figure3 import Model, _errors, fitted

    with jax.enable_x64(True):
        nodes, suns = Suns.nodes(10, 8), Suns.even(5, 3)
        samples, exact = project((nodes, suns), 2)
        values = fitted(samples, nodes, suns, polynomials, (5, 4))
        fit = sky.habel2008_fit((5, 4), degree=1, samples=(10, 8), solver="qr")
        by_package = fit(suns.directions, suns.turbidity[None])
        np.testing.assert_allclose(values, by_package, rtol=0, atol=1e-9)
        low = smallest(suns, "luminance")
        error = sky.fit_error(by_package, exact, low)
    row = list(_errors(Model("", "", 20, values), exact, {"luminance": low}))[-1]
    assert row["mean"] == pytest.approx(100 * float(error.mean.max()), rel=1e-6)
    assert row["max"] == pytest.approx(100 * float(error.max.max()), rel=1e-6)


class TestReference:
    """The data folder's published numbers."""

    def test_by_name(self, tmp_path):
        folder = tmp_path / "reference"
        folder.mkdir()
        (tmp_path / "meshes").mkdir()
        (tmp_path / "meshes" / "any.ply").touch()
        np.savez(folder / "numbers.npz", a=np.arange(3))
        arrays = Data(tmp_path).reference("numbers")
        assert arrays is not None
        assert arrays["a"].tolist() == [0, 1, 2]

    def test_none_where_there_are_none(self, tmp_path):
        (tmp_path / "meshes").mkdir()
        (tmp_path / "meshes" / "any.ply").touch()
        assert Data(tmp_path).reference("numbers") is None
        assert Data().reference("numbers") is None

    @pytest.mark.parametrize("content", [b"", b"no numbers", b"PK\x03\x04 torn"])
    def test_a_broken_file_is_the_users_to_mend(self, tmp_path, content):
        (tmp_path / "meshes").mkdir()
        (tmp_path / "meshes" / "any.ply").touch()
        (tmp_path / "reference").mkdir()
        (tmp_path / "reference" / "numbers.npz").write_bytes(content)
        with pytest.raises(UserError, match=r"numbers\.npz"):
            Data(tmp_path).reference("numbers")
