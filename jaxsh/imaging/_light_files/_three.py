"""Read and write the light probes of three.js, as its `toJSON` and `ObjectLoader` have them."""

import json
import uuid
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ..._core.json_fields import Fields, inner, listed, number, numbers, parse, shown, text
from ._stored import Stored, choose


def read_three(path: Path, which: str | int | None) -> Stored:
    """Read the light probe of an object or a scene, times its intensity.

    Its place and turn do not matter, as in three.js itself. A bare list of numbers, flat or three
    in a row, is read as well, and does not say its convention.
    """
    tree = parse(path.read_bytes())
    if isinstance(tree, list):
        if which is not None:
            raise ValueError(f"a list of numbers is one light: which must be None, got {which!r}")
        return _bare(tree)
    if not isinstance(tree, dict):
        raise ValueError(f"its JSON should be an object, got {shown(tree)}")
    if "asset" in tree:
        raise ValueError("it is glTF: its name should end in .gltf")
    probes = list(_probes(inner(tree, "object", "the file") or tree))
    if not probes:
        raise ValueError("it holds no LightProbe of three.js, which is an object with 'sh'")
    names = [text(probe, "name", "a LightProbe") or "" for probe in probes]
    at = choose("light probes", names, which, None)
    owner = f"LightProbe {at}"
    values = np.array(numbers(probes[at], "sh", owner, 27, None)).reshape(9, 3)
    return Stored(values * number(probes[at], "intensity", owner, 1.0), "three.js", "channels-last")


def _probes(root: Fields) -> Iterator[Fields]:
    waiting = [root]
    while waiting:
        fields = waiting.pop()
        if fields.get("type") == "LightProbe" or "sh" in fields:
            yield fields
        children = listed(fields, "children", "an object")
        if not all(isinstance(child, dict) for child in children):
            raise ValueError("an object has children that are none")
        waiting.extend(reversed(children))


def _bare(rows: list) -> Stored:
    if rows and isinstance(rows[0], list):
        values = [numbers({"rows": row}, "rows", "the file", len(rows[0]), None) for row in rows]
    else:
        values = numbers({"list": rows}, "list", "the file", None, None)
    return Stored(np.array(values), None, single=True)


def three_file(values: Float[np.ndarray, "9 3"]) -> bytes:
    """Give a file that `ObjectLoader` makes a LightProbe of."""
    sh = values.reshape(-1).tolist()
    content = {
        "metadata": {"version": 4.7, "type": "Object", "generator": "jaxsh"},
        "object": {
            # The same light has the same name everywhere.
            "uuid": str(uuid.uuid5(uuid.NAMESPACE_OID, repr(sh))),
            "type": "LightProbe",
            "layers": 1,
            "matrix": np.eye(4).reshape(-1).tolist(),
            "color": 0xFFFFFF,
            "intensity": 1,
            "sh": sh,
        },
    }
    return json.dumps(content).encode()
