"""Readers meet changed files: some here, a million in `make fuzz`."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from fuzz_changes import change
from fuzz_files import FORMATS, LIGHTS, MESHES, PICTURES, put_beside, seeds
from fuzz_lights import light
from fuzz_peers import summary
from fuzz_pictures import CODES, picture
from fuzz_readers import check
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

OTHER_SHAPES = [(kind, i) for kind in ("glb", "gltf") for i in range(1, 6)]


def needs_packages(kind: str) -> None:
    if kind in ("exr", *CODES):
        pytest.importorskip("OpenImageIO")


def read(kind: str, path: Path):
    """Read a file that is valid, without a warning."""
    result, warned = check(kind, path)
    assert result is not None, path
    assert not warned, path
    return result


@pytest.mark.parametrize("kind", FORMATS)
def test_the_files_to_start_from_are_read_right(tmp_path, kind):
    # The tests below say little if these are refused.
    needs_packages(kind)
    for i, data in enumerate(seeds(kind)):
        path = tmp_path / f"{i}.{kind}"
        put_beside(path)
        path.write_bytes(data)
        if kind == "mtl":  # which may be ignored in part
            factor = check(kind, path).result.materials[0].factor
            np.testing.assert_array_equal(factor, [[1, 0.5, 0, 1], [0.5, 0.5, 0.5, 0.75]][i])
            continue
        result = read(kind, path)
        if kind in PICTURES:
            expected = picture()
            for gray, channel in ((("pfm", 2), 1), (("npy", 3), 0)):
                expected = expected[..., [channel] * 3] if (kind, i) == gray else expected
            if kind in CODES:
                with Image.open(path) as image:
                    share = np.asarray(image.convert("RGB")) / 255
                expected = np.where(
                    share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4
                )
            # Decoders of JPEG differ by a code here and there.
            off = 0.01 if kind == "jpg" else 1e-6
            np.testing.assert_allclose(result, expected, rtol=0, atol=off)
        elif kind in LIGHTS:
            for one in result.coefficients if kind == "splats.ply" else [result]:
                np.testing.assert_allclose(one, light(), rtol=0, atol=1e-14)
        elif kind in MESHES and (kind, i) not in OTHER_SHAPES:
            # A prism of height 3/4 over an L of area 1 and perimeter 5; one has its walls alone.
            caps = 0 if (kind, i) == ("ply", 4) else 2 * 1
            size = [caps + 5 * 0.75, 0, 0, 0, 1, 1.5, 0.75]
            if kind in ("glb", "gltf"):  # y-up in the file
                size = [size[0], 0, 0, -1.5, 1, 0.75, 0]
            np.testing.assert_allclose(summary(kind, result), size, rtol=0, atol=1e-6)


@pytest.mark.parametrize("kind", FORMATS)
def test_changed_files_are_read_or_refused(tmp_path, kind):
    needs_packages(kind)
    path = tmp_path / f"changed.{kind}"
    put_beside(path)

    @settings(
        max_examples=20 if kind in LIGHTS else 50,
        suppress_health_check=[HealthCheck.function_scoped_fixture],
    )
    @given(which=st.integers(0, len(seeds(kind)) - 1), rng=st.randoms(use_true_random=False))
    def run(which, rng):
        path.write_bytes(change(kind, seeds(kind)[which], rng))
        check(kind, path)

    run()


# The readers of lights are alike, and each takes a process: two stand for all.
ALONE = [kind for kind in FORMATS if kind not in LIGHTS or kind in ("light.npz", "splats.ply")]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ALONE)
def test_the_first_of_a_million(tmp_path, kind):
    """In processes of its own, with limits on memory and beside other packages."""
    needs_packages(kind)
    command = [sys.executable, str(Path(__file__).parent), "--formats", kind, "--inputs", "500"]
    run = subprocess.run([*command, "--out", tmp_path], capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stdout
    assert "500 inputs" in run.stdout
