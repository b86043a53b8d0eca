"""Runs docs/gallery.md and writes its pictures: docs/images/gallery_*.png.

`python tools/make_gallery.py` in the checkout. A block's figure becomes the picture that the page
shows below it, so that no picture is of other code. `--only light ball` writes those alone.
"""

import argparse
import re
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot
from PIL import Image

DOCS = Path(__file__).parents[1] / "docs"
_DPI = 80
_MOST = 100_000  # bytes of a picture
_BLOCK = re.compile(
    r"^```python\n(.*?)^```\n+(?:!\[[^\]]*\]\(images/gallery_(\w+)\.png\))?", re.S | re.M
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=DOCS / "images")
    parser.add_argument("--only", nargs="*", default=[], help="names of pictures")
    arguments = parser.parse_args()
    names: dict[str, object] = {}
    for code, name in _BLOCK.findall((DOCS / "gallery.md").read_text("utf-8")):
        exec(compile(code, f"docs/gallery.md: {name or 'setup'}", "exec"), names)
        if name and (not arguments.only or name in arguments.only):
            path = arguments.output / f"gallery_{name}.png"
            write(path)
            print(f"{path.name}: {path.stat().st_size:,} bytes")
        pyplot.close("all")


def write(path: Path) -> None:
    """Write the figure at hand, a tenth of a megabyte at most."""
    pyplot.gcf().savefig(path, dpi=_DPI)
    with Image.open(path) as picture:
        picture.convert("RGB").save(path, optimize=True)
    if path.stat().st_size > _MOST:
        raise SystemExit(f"{path}: {path.stat().st_size:,} bytes, more than {_MOST:,}")


if __name__ == "__main__":
    main()
