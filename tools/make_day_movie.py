"""Write `docs/images/day.webp` by the code of `docs/how-to/a-day-as-a-movie.md`, and print sizes.

python tools/make_day_movie.py      # needs ephem and imageio-ffmpeg: half a minute
"""

import os
import re
import tempfile
from pathlib import Path

DOCS = Path(__file__).parents[1] / "docs"


def main() -> None:
    page = (DOCS / "how-to" / "a-day-as-a-movie.md").read_text("utf-8")
    [code, *_] = re.findall(r"^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    picture = DOCS / "images" / "day.webp"
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        names: dict = {}
        exec(code, names)
        frames = [names["frame"](sun) for sun in names["suns"]]
        for kind in ("webp", "gif", "mp4"):
            path = names["imaging"].write_movie(f"day.{kind}", frames, fps=15)
            print(f"{path}: {len(frames)} frames, {path.stat().st_size // 1000} kB")
        picture.write_bytes(Path("day.webp").read_bytes())
        os.chdir(DOCS)


if __name__ == "__main__":
    main()
