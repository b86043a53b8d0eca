"""``python tools/make_paper_pictures.py [RESULTS]``: the pictures of docs/papers, from results.

They are those of the preset `quick`, on the embedded data; what RESULTS lacks is run first.
"""

import subprocess
import sys
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).parents[1]
# Experiment and its picture, by the page it stands on.
PICTURES = {
    "ramamoorthi2001": ("environment", "studio.png"),
    "annen2004": ("annen2004.figure7", "figure7.png"),
    "habel2008": ("habel2008.figure4", "figure4.png"),
    "leekim2014": ("leekim2014.figure8", "knot_studio.png"),
    "inverse": ("inverse.light", "recovered.png"),
}
WIDTH = 1400


def main(out: Path) -> None:
    """Run what is missing, and write each picture as wide as the page can show."""
    for page, (experiment, name) in PICTURES.items():
        drawn = out / experiment / "quick" / name
        if not drawn.exists():
            command = [sys.executable, "-m", "experiments", "run", experiment, "--out", str(out)]
            subprocess.run(command, cwd=ROOT, check=True)
        picture = Image.open(drawn).convert("RGB")
        picture.thumbnail((WIDTH, 10 * WIDTH), Image.Resampling.LANCZOS)
        path = ROOT / "docs" / "images" / "papers" / f"{page}.webp"
        path.parent.mkdir(exist_ok=True)
        picture.save(path, quality=86, method=6)
        print(path.relative_to(ROOT), picture.size)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "results"))
