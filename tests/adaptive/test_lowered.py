"""On a GPU or TPU `adaptive` has no loops but those of `tests/lowered/adaptive.py`."""

import pytest
from accelerators import PLATFORMS, accelerator, check  # noqa: F401


@pytest.mark.slow
@pytest.mark.parametrize("platform", PLATFORMS)
def test_no_loop_but_those_of_the_table_is_left(platform):
    check("adaptive", platform)
