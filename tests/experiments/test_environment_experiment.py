"""The experiment `environment` end to end on the embedded data, small."""

import json

import jax.numpy as jnp
import numpy as np
import pytest
from pictures import assert_picture
from runs import run

from experiments.shared.pixels import direct_irradiance
from jaxsh import sphere


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    options = ["--degrees", "2", "6", "--size", "48"]
    return run(tmp_path_factory.mktemp("results"), "environment", *options, small=True)[0]


@pytest.mark.slow
def test_error_falls_with_degree(folder):
    rows = json.loads((folder / "metrics.json").read_text())
    plain = [row for row in rows if row["window"] == "none"]
    assert [row["degree"] for row in plain] == [2, 6]
    for better in ("mean_error", "max_error", "relative_error"):
        assert plain[0][better] > 2 * plain[1][better] > 0
    assert plain[0]["psnr"] + 6 < plain[1]["psnr"]
    assert all(row["reference_rounding"] < 5e-6 for row in rows)  # measured 5e-7


@pytest.mark.slow
def test_windows_trade_error_for_negative_light(folder):
    rows = json.loads((folder / "metrics.json").read_text())
    at = {row["window"]: row for row in rows if row["degree"] == 6}
    assert at["dering light"]["negative_light"] < 0.01 < at["hann"]["negative_light"]
    assert at["hann"]["negative_light"] < at["lanczos"]["negative_light"]
    assert at["lanczos"]["negative_light"] < at["none"]["negative_light"]
    assert at["dering irradiance"]["mean_error"] < at["lanczos"]["mean_error"]


@pytest.mark.slow
def test_pictures_and_table(folder):
    table = (folder / "table.md").read_text()
    for picture in ("studio.png", "environments.png"):
        assert_picture(folder / picture)
        assert f"({picture})" in table


def test_direct_irradiance_is_the_integral(rng):
    """Against the closed form: a light of degree 2 on a picture of 128 rows."""
    light = jnp.asarray(rng.normal(size=(3, 9)))
    normals = rng.normal(size=(7, 3))
    normals = jnp.asarray(normals / np.linalg.norm(normals, axis=-1, keepdims=True))
    image = sphere.reconstruct_lat_long(light, 128, 256)
    # The midpoint rule over pixels and the cosine's edge: 1.3e-4 at this resolution.
    np.testing.assert_allclose(
        direct_irradiance(normals, image), sphere.irradiance(light, normals), rtol=0, atol=2e-4
    )
