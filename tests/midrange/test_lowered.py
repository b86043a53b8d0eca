"""On a GPU or TPU `midrange` has no loops but those of `tests/lowered/midrange.py`."""

import pytest
from accelerators import PLATFORMS, accelerator, check  # noqa: F401


@pytest.mark.slow
@pytest.mark.parametrize("platform", PLATFORMS)
def test_no_loop_but_those_of_the_table_is_left(platform):
    check("midrange", platform)
