"""Each notebook runs, without a warning, and draws: as `executed.execute` demands."""

import pytest
from executed import NOTEBOOKS, execute

QUICK = {"02_light_a_mesh"}


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, id=path.stem, marks=() if path.stem in QUICK else pytest.mark.slow)
        for path in NOTEBOOKS
    ],
)
def test_notebook(path):
    """Where the documentation was built before, as in `.ci/run`, its execution is taken."""
    notebook = execute(path)
    assert any(cell.get("outputs") for cell in notebook.cells)


def test_there_are_notebooks():
    assert NOTEBOOKS
