"""Read the materials of an OBJ file: base color and its picture."""

import math
import re
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from ..._core.text import decode, plain_text, without_comment
from .._base_color import BaseColor
from ._pictures import beside, read_picture

# How many words follow each option of a map at least, and at most where they are numbers.
_OPTIONS = {
    **dict.fromkeys(("-blendu", "-blendv", "-cc", "-clamp", "-imfchan", "-type"), (1, 1)),
    "-colorspace": (1, 1),
    **dict.fromkeys(("-bm", "-boost", "-texres"), (1, 1)),
    "-mm": (2, 2),
    **dict.fromkeys(("-o", "-s", "-t"), (1, 3)),
}
# Statements of maps other than the base color's: the beginnings of their keys.
_MAPS = ("map_", "bump", "disp", "decal", "norm", "refl")
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?", re.I)


class Materials:
    """Collects the materials of library files, and those that faces name without one."""

    def __init__(self, path: Path, files: list[str], found: list[str]):
        self._found = found
        self._statements: dict[str, tuple[dict[str, str], Path]] = {}
        self._colors: list[BaseColor] = []
        self._rows: dict[str, int] = {}
        self._pictures: dict[Path | str, UInt8[np.ndarray, "h w 4"] | None] = {}
        # A line may name several files, and a name may hold blanks.
        for line in files:
            words = re.split(r"(?<!\\)\s+", without_comment(line))
            names = [line] if beside(path, line) else words
            for name in (one.replace("\\ ", " ") for one in names):
                place = beside(path, name)
                if place is None:
                    found.append(f"the materials {name!r} are not there")
                else:
                    self._read(place)
        self._unread: set[str] = set()
        self._missing: list[str] = []

    def row(self, name: str) -> int:
        """Give the row of a material in `table`, which is in the order of first use."""
        if name not in self._rows:
            self._rows[name] = len(self._rows)
            if name in self._statements:
                self._colors.append(self._color(name, *self._statements[name]))
            else:
                self._missing.append(name)
                self._colors.append(BaseColor(name))
        return self._rows[name]

    def table(self) -> tuple[BaseColor, ...]:
        """Give the materials that faces name, and say what of them is not read."""
        if self._missing:
            self._found.append(f"materials in no file are white ({' '.join(self._missing)})")
        if self._unread:
            self._found.append(f"of materials ignored ({' '.join(sorted(self._unread))})")
        return tuple(self._colors)

    def _read(self, place: Path) -> None:
        """Collect the statements of each material of a file; of two with one name the first."""
        try:
            lines = plain_text(place.read_bytes()).split(b"\n")
        except OSError as error:
            self._found.append(f"the materials {place.name!r} cannot be read ({error.strerror})")
            return
        kept: dict[str, str] = {}  # what stands before the first material belongs to none
        for line in map(decode, lines):
            key, rest = [*line.split(None, 1), "", ""][:2]
            if key.startswith("#"):
                continue
            rest = without_comment(rest)
            if key.lower() == "newmtl":
                kept = {}
                self._statements.setdefault(rest, (kept, place))
            elif key:
                kept[key.lower()] = rest

    def _color(self, name: str, kept: dict[str, str], place: Path) -> BaseColor:
        red, green, blue = self._triple(name, kept.get("kd", "1 1 1"))
        alpha = self._share(name, "d", kept)
        if alpha is None:
            alpha = 1 - (self._share(name, "tr", kept) or 0.0)
        maps = {key for key in kept if key.startswith(_MAPS)}
        if any(float(word) > 0 for word in kept.get("ke", "").split() if _NUMBER.fullmatch(word)):
            maps.add("ke")  # it gives off light
        self._unread |= maps - {"map_kd"}
        texture = None
        if "map_kd" in kept:
            file = self._picture(kept["map_kd"])
            key = beside(place, file) or file
            if key not in self._pictures:
                self._pictures[key] = read_picture(place, file, self._found)
            texture = self._pictures[key]
        return BaseColor(name, (red, green, blue, alpha), texture)

    def _triple(self, name: str, text: str) -> tuple[float, float, float]:
        words = text.split()
        if words and all(map(_NUMBER.fullmatch, words[:3])):
            values = [float(word) for word in words[:3]]
            red, green, blue = values if len(values) == 3 else [values[0]] * 3
            if min(values) >= 0 and max(values) < math.inf:
                if max(values) > 1 + 1e-6:
                    self._found.append(f"Kd {text!r} of the material {name!r} is over 1")
                return red, green, blue
        self._found.append(f"Kd {text!r} of the material {name!r} ignored")
        return 1.0, 1.0, 1.0

    def _share(self, name: str, key: str, kept: dict[str, str]) -> float | None:
        """Read a number from 0 to 1; None where there is none."""
        if key not in kept:
            return None
        words = kept[key].removeprefix("-halo").split()
        if words and _NUMBER.fullmatch(words[0]) and 0 <= float(words[0]) <= 1:
            return float(words[0])
        self._found.append(f"{key} {kept[key]!r} of the material {name!r} ignored")
        return None

    def _picture(self, text: str) -> str:
        """Take the options off the name of a picture, which may hold blanks."""
        words = text.split()
        while words and words[0].lower() in _OPTIONS:
            option = words.pop(0).lower()
            least, most = _OPTIONS[option]
            taken = words[:least]
            while len(taken) < most and len(taken) < len(words) - 1:
                if not _NUMBER.fullmatch(words[len(taken)]):
                    break
                taken.append(words[len(taken)])
            del words[: len(taken)]
            if option in ("-o", "-s", "-t", "-mm"):
                self._unread.add(f"map_kd {option}")
        return text[text.find(words[0]) :] if words and len(words) > 1 else "".join(words)
