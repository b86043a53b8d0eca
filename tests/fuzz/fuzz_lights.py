"""Small valid files of every format of lights and splats, as bytes: one light in all of them."""

import json
import struct

import numpy as np
from fuzz_archives import archive
from fuzz_pictures import npy

_EXTENSION = "EXT_lights_image_based"


def light() -> np.ndarray:
    """A light (3, 9) in our own convention, whose numbers are exact in a half."""
    i, j = np.meshgrid(np.arange(3), np.arange(9), indexing="ij")
    return ((5 * i + 3 * j) % 13 - 4) / 8.0


def y_up() -> np.ndarray:
    """The same as three.js has it, (9, 3): x, y and z are our x, z and -y."""
    s = np.sqrt(3) / 2
    # Rows are 1, y, z, x, xy, yz, 3z²-1, xz, x²-y² of three.js, in ours.
    turn = np.zeros((9, 9))
    turn[0, 0] = turn[1, 2] = turn[3, 3] = turn[4, 7] = 1
    turn[2, 1] = turn[5, 5] = turn[7, 4] = -1
    turn[6, 6], turn[6, 8], turn[8, 6], turn[8, 8] = -0.5, -s, -s, 0.5
    return turn @ light().T


def _json() -> list[bytes]:
    probe = {
        "type": "LightProbe",
        "name": "sky",
        "intensity": 2,
        "sh": (y_up() / 2).ravel().tolist(),
    }
    scene = {"type": "Scene", "children": [{"type": "Group", "children": [probe]}]}
    both = [{"metadata": {"version": 4.7}, "object": one} for one in (probe, scene)]
    return [json.dumps(one).encode() for one in both]


def _txt() -> list[bytes]:
    signs = np.array([1, -1, 1, -1, 1, -1, 1, -1, 1])[:, None]
    labels = ["00", "1-1", "10", "11", "2-2", "2-1", "20", "21", "22"]
    rows = zip(labels, signs * y_up(), strict=True)
    return [
        "".join(
            f"({r:.15f}, {g:.15f}, {b:.15f}); // L{label}\n" for label, (r, g, b) in rows
        ).encode()
    ]


def _fields() -> dict:
    """Half a turn about y, which the fuzzer loads and compiles for once and for all."""
    turned = np.array([1, 1, -1, -1, -1, -1, 1, 1, 1])[:, None]
    factors = np.pi * np.array([1, -2 / 3, 2 / 3, -2 / 3, *[1 / 4, -1 / 4] * 2, 1 / 4])[:, None]
    one = {
        "name": "sky",
        "intensity": 2.0,
        "rotation": [0.0, 1.0, 0.0, 0.0],
        "irradianceCoefficients": (factors * turned * y_up() / 2).tolist(),
        "specularImages": [[0, 0, 0, 0, 0, 0]],
        "specularImageSize": 1,
    }
    return {
        "asset": {"version": "2.0"},
        "extensionsUsed": [_EXTENSION],
        "extensions": {_EXTENSION: {"lights": [one]}},
        "scenes": [{"extensions": {_EXTENSION: {"light": 0}}}],
        "scene": 0,
    }


def _gltf() -> list[bytes]:
    return [json.dumps(_fields()).encode()]


def _glb() -> list[bytes]:
    text = json.dumps(_fields()).encode()
    text += b" " * (-len(text) % 4)
    return [struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text), len(text), b"JSON") + text]


def _npy() -> list[bytes]:
    return [npy(light()), npy(light().astype(">f4")), npy(np.asfortranarray(light()))]


def _npz() -> list[bytes]:
    facts = json.dumps({"axes": ["+x", "+z", "-y"], "layout": "channels-last"})
    ours = {"format": np.array("jaxsh light"), "version": np.array(1), "facts": np.array(facts)}
    ours["coefficients"] = y_up()
    named = {"coefficients": light(), "convention": np.array("jaxsh")}
    return [
        archive({f"{name}.npy": npy(array) for name, array in arrays.items()})
        for arrays in (ours, named)
    ]


def _ply() -> list[bytes]:
    signs = np.array([1, -1, 1, -1, 1, -1, 1, -1, 1])
    names = ["x", "y", "z", *(f"f_dc_{i}" for i in range(3)), *(f"f_rest_{i}" for i in range(24))]
    names += ["opacity", *(f"scale_{i}" for i in range(3)), *(f"rot_{i}" for i in range(4))]
    held = light() * signs
    row = [1, 2, 3, *held[:, 0], *held[:, 1:].ravel(), 0.5, -1, -2, -3, 1, 0, 0, 0]
    values = np.array([row, row], "<f4")
    head = (
        "\n".join(
            [
                "ply",
                "format {} 1.0",
                "element vertex 2",
                *(f"property float {name}" for name in names),
            ]
        )
        + "\nend_header\n"
    )
    text = "".join(" ".join(map(repr, one)) + "\n" for one in values.tolist())
    return [
        head.format("binary_little_endian").encode() + values.tobytes(),
        head.format("binary_big_endian").encode() + values.astype(">f4").tobytes(),
        (head.format("ascii") + text).encode(),
    ]


# By the ends of their names: meshes and pictures have formats of the same name.
MAKERS = {
    "light.json": _json,
    "light.txt": _txt,
    "light.gltf": _gltf,
    "light.glb": _glb,
    "light.npz": _npz,
    "light.npy": _npy,
    "splats.ply": _ply,
}
