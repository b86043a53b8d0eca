"""Colors among the channels, layers and parts of a file."""

from typing import Literal, NamedTuple

Kind = Literal["rgb", "gray", "luminance-chroma"]

# Names that are never a picture's brightness.
_NOT_COLOR = {"A", "AR", "AG", "AB", "Z", "ZBACK", "ID"}


class Choice(NamedTuple):
    """Holds a part, its channels in the order of their kind, and the kind."""

    part: int
    channels: list[int]
    kind: Kind


def choose(parts: list[tuple[list[str], str]], layer: str | None) -> Choice:
    """Find R, G, B, or Y, RY, BY, or one gray channel, in the first part that has them.

    `parts` are channel names and the part's name. Without plain ones a single layer's are taken
    (`beauty.R`, …); `layer` names a layer or a part. Raises `ValueError` where nothing or too much
    is found.
    """
    layers: dict[str, Choice] = {}
    for part, (names, part_name) in enumerate(parts):
        for prefix in dict.fromkeys(_prefix(name) for name in names):
            own = {
                name[len(prefix) :].lstrip(".").upper(): i
                for i, name in reversed(list(enumerate(names)))
                if _prefix(name) == prefix
            }
            if found := _colors(own):
                # A layer has its own name, plain channels that of their part.
                layers.setdefault(prefix or part_name, Choice(part, *found))
                if not prefix and layer is None:
                    return layers[prefix or part_name]
    if layer is not None and layer in layers:
        return layers[layer]
    if layer is None and len(layers) == 1:
        return next(iter(layers.values()))
    known = ", ".join(repr(name) for name in layers if name)
    if layer is not None:
        raise ValueError(f"there is no layer {layer!r}: the file has {known or 'none'}")
    if layers:
        raise ValueError(f"its colors are in layers {known}: choose one by layer=")
    found = [name for names, _ in parts for name in names]
    raise ValueError(f"needs channels R, G, B or a single one, got {found}")


def _prefix(name: str) -> str:
    return name.rpartition(".")[0]


def _colors(names: dict[str, int]) -> tuple[list[int], Kind] | None:
    if all(c in names for c in "RGB"):
        return [names[c] for c in "RGB"], "rgb"
    if all(c in names for c in ("Y", "RY", "BY")):
        return [names[c] for c in ("Y", "RY", "BY")], "luminance-chroma"
    if "X" in names:  # of a vector, as a pass of normals has: no brightness
        return None
    if "Y" in names:
        return [names["Y"]], "gray"
    colors = [i for name, i in names.items() if name not in _NOT_COLOR]
    return (colors, "gray") if len(colors) == 1 else None
