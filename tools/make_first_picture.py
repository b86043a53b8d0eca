"""``python tools/make_first_picture.py``: the picture of docs/index.md, by its code."""

import contextlib
import re
import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("agg")

from matplotlib import pyplot

DOCS = Path(__file__).parents[1] / "docs"


def main() -> None:
    """Run the page's first block, and write its two pictures beside each other."""
    code = re.search(r"^```python\n(.*?)^```", (DOCS / "index.md").read_text("utf-8"), re.M | re.S)
    assert code is not None
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        exec(compile(code[1], "index.md", "exec"), {"__name__": "index"})
        knot, light = pyplot.imread("knot.png"), pyplot.imread("light.png")
    figure, (left, right) = pyplot.subplots(
        1, 2, figsize=(9, 3.4), width_ratios=[1, 1.6], layout="constrained"
    )
    for axes, picture, title in ((left, knot, "knot.png"), (right, light, "light.png")):
        axes.imshow(picture, interpolation="lanczos")
        axes.set_title(title, family="monospace", fontsize=10)
        axes.axis("off")
    figure.savefig(DOCS / "images" / "first_picture.png", dpi=100)


if __name__ == "__main__":
    main()
