"""Readers meet changed files: a few here, a million in `make fuzz`."""

import warnings

import numpy as np
import pytest
from fuzz_changes import change
from fuzz_files import FORMATS, MESHES, PICTURES, picture, seeds
from fuzz_peers import disagreement, missing, summary
from fuzz_readers import Fault, check, without_compiling
from fuzz_work import made
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from jaxsh.geometry import _assemble

# The prism over an L of `fuzz_files`, in 8 files of a kind at most: area, lowest, highest corner.
AREA = 2 * 1 + 5 * 0.75


@pytest.fixture(autouse=True)
def normals_from_numpy():
    before = without_compiling()
    yield
    _assemble.vertex_normals = before


@pytest.mark.parametrize("kind", FORMATS)
def test_the_files_to_start_from_are_valid(tmp_path, kind):
    # The tests below say little if these are refused.
    for i, data in enumerate(seeds(kind)):
        path = tmp_path / f"{i}.{kind}"
        path.write_bytes(data)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            assert check(kind, path) is not None, path


@pytest.mark.parametrize("kind", FORMATS)
def test_changed_files_are_read_or_refused(tmp_path, kind):
    @settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
    @given(which=st.integers(0, len(seeds(kind)) - 1), rng=st.randoms(use_true_random=False))
    def run(which, rng):
        path = tmp_path / f"changed.{kind}"
        path.write_bytes(change(kind, seeds(kind)[which], rng))
        check(kind, path)

    run()
