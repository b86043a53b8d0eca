"""Draw the pictures of the how-to pages, `docs/images/how-to/*.webp`, by the pages' own code.

PYTHONPATH=tests python tools/make_how_to_pictures.py          # all pages
PYTHONPATH=tests python tools/make_how_to_pictures.py near-lights sharp-light

That of `use-from-pytorch` needs torch.
"""

import argparse
import tempfile
from pathlib import Path

import documented  # pyright: ignore[reportMissingImports]  # from tests
from PIL import Image


def main() -> None:
    with_pictures = {page.stem: page for page in documented.PAGES if documented.pictures(page)}
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("page", nargs="*", choices=[[], *with_pictures], help="default: all")
    for name in parser.parse_args().page or with_pictures:
        with tempfile.TemporaryDirectory() as folder:
            documented.run(with_pictures[name], Path(folder))
            for path in documented.pictures(with_pictures[name]):
                shrink(documented.drawn(Path(folder), path), path)


def shrink(drawn: Path, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    picture = Image.open(drawn).convert("RGB")
    picture.save(path, quality=90, method=6)
    print(f"{path.name}: {picture.width} × {picture.height}, {path.stat().st_size:,} bytes")


if __name__ == "__main__":
    main()
