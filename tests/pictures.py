"""Pictures of experiments compared as pictures: a grey thumbnail against a stored one.

Stored are 16 × 16 levels from 0 to 255 in `pictures.json`, made by running the tests (the slow ones
too) with STORE_PICTURES=1. Plots of times differ from run to run: they have to show something.
"""

import json
import os
from pathlib import Path

import numpy as np
from PIL import Image

_SIDE = 16
_STORE = Path(__file__).with_name("pictures.json")
_MEAN, _WORST = 4.0, 48.0  # levels that fonts and rounding may move; measured: none on one machine


def thumbnail(path: Path) -> np.ndarray:
    """The mean level of each of 16 × 16 parts of the picture."""
    with Image.open(path) as image:
        grey = image.convert("L").resize((_SIDE, _SIDE), Image.Resampling.BOX)
    return np.asarray(grey, np.float64)


def assert_picture(path: Path, *, timed: bool = False) -> None:
    """Compare with what is stored; where the picture is of times, it must only show something."""
    found = thumbnail(path)
    with Image.open(path) as image:
        levels = np.asarray(image.convert("L"))
    assert levels.std() > 10, f"{path.name} is blank"
    assert len(np.unique(levels)) > 16, f"{path.name} has hardly any levels"
    if timed:
        return
    key = "/".join(path.parts[-3:])
    stored = json.loads(_STORE.read_text()) if _STORE.exists() else {}
    if os.environ.get("STORE_PICTURES"):
        stored[key] = found.astype(np.uint8).tobytes().hex()
        _STORE.write_text(json.dumps(stored, indent=1, sort_keys=True) + "\n")
        return
    wanted = np.frombuffer(bytes.fromhex(stored[key]), np.uint8).reshape(_SIDE, _SIDE)
    apart = np.abs(found - wanted)
    assert apart.mean() < _MEAN, f"{path.name} differs by {apart.mean():.1f} levels in the mean"
    assert apart.max() < _WORST, f"{path.name} differs by {apart.max():.0f} levels in a part"
