"""Compare two folders of results, row by row, but for what a clock has measured.

    python tools/compare_metrics.py BEFORE AFTER

prints what differs in the `metrics.json` of each experiment and preset that BEFORE has, and exits
with 1 if anything does. Keys that AFTER alone has are no difference. Which keys hold times, ratios
of times or what was chosen by time is listed below.
"""

import json
import math
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

RELATIVE = 1e-6
_TIMED = re.compile(
    r"(^|_|, )(seconds|ms|us)($|_)|^fps|gain(_|$)|^gain |bake_to_rays|shade_to_read|megabytes$|"
    r"^(still|frame) (with|without|exact|ratio)|full_to_einsum|gigaflops|^share_(product|full)$|"
    r"^rival(_psnr_object)?$|^still_gain|^time$"
)
# Stages and totals of a frame, in milliseconds, and which is on the front of time and error.
_TIMED_IN = {
    "annen2004.table1": {"trace", "project", "shade", "raster", "draw", "frame", "still"},
    "annen2004.orders": {
        *("capture", "project", "shade", "total", "front exact", "front cubes", "vertices", "ms"),
    },
}


def differences(before: Path, after: Path) -> Iterator[str]:
    """Lines that say what differs."""
    files = sorted(before.glob("*/*/metrics.json"))
    if not files:
        yield f"{before} has no results"
    for path in files:
        name = path.relative_to(before)
        if not (after / name).exists():
            yield f"{name}: missing"
            continue
        old, new = (json.loads((root / name).read_text()) for root in (before, after))
        if len(old) > len(new):
            yield f"{name}: {len(old)} rows before, {len(new)} after"
        for number, (row, other) in enumerate(zip(old, new, strict=False)):
            for key, value in row.items():
                if _TIMED.search(key) or key in _TIMED_IN.get(path.parts[-3], ()):
                    continue
                if not same(value, other.get(key)):
                    yield f"{name} [{number}] {key}: {value!r} before, {other.get(key)!r} after"


def same(one: Any, other: Any) -> bool:
    """Whether two values agree, numbers to a relative `RELATIVE`."""
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, float) and isinstance(other, int | float):
        return math.isclose(one, other, rel_tol=RELATIVE, abs_tol=1e-12)
    return one == other


def main(words: list[str]) -> int:
    if len(words) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    lines = list(differences(*map(Path, words)))
    print("\n".join(lines) if lines else "no differences")
    return bool(lines)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
