"""On a GPU or TPU `adaptive` has no loops but those of `tests/lowered/adaptive.py`."""

import accelerators
import pytest


@pytest.mark.slow
def test_no_loop_but_those_of_the_table_is_left():
    accelerators.check("adaptive")
