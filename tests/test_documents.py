"""What a newcomer would run first: the blocks of each page, from scratch."""

import documented
import numpy as np
import pytest
from matplotlib import pyplot
from PIL import Image


def default_run(paths: list, quick: set[str]) -> list:
    """The paths as parameters, slow but for those that are quick."""
    return [
        pytest.param(path, id=path.stem, marks=() if path.stem in quick else pytest.mark.slow)
        for path in paths
    ]


@pytest.mark.parametrize(
    "page",
    default_run(
        [page for page in documented.PAGES if documented.blocks(page) or documented.files(page)],
        {"README", "harmonics"},
    ),
)
def test_blocks_run_in_order(page, tmp_path):
    """The blocks of a page share one namespace, in a fresh process, as at a user's; the pictures
    of a how-to page are those that its code draws."""
    code = "".join(documented.blocks(page))
    for package in ("torch", "optax"):
        if f"import {package}" in code:
            pytest.importorskip(package, reason=f"{page.name} is not tried without {package}")
    documented.run(page, tmp_path)
    for path in documented.pictures(page):
        shown, drawn = (
            np.asarray(Image.open(one).convert("RGB"), float) / 255
            for one in (path, documented.drawn(tmp_path, path))
        )
        assert drawn.shape == shown.shape
        # The page's is compressed, and another version of matplotlib draws other letters.
        assert abs(drawn - shown).mean() < 0.02
    if page.stem == "README":
        shown = pyplot.imread(tmp_path / "knot.png")[..., :3]
        assert shown.shape[0] >= 256
        assert 0.1 < shown.mean() < 0.9
        assert np.ptp(shown.reshape(-1, 3), axis=0).min() > 0.5
