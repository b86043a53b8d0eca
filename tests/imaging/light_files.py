"""Files of one light as other packages write them, and what the packages make of it.

`THREE` is of three.js, revision 187: `LightProbe.toJSON()` of a named probe with an intensity of
3/2, moved and turned, and `getIrradianceAt` times the intensity. cmgen's lines are printed in the
form of its `outputSh`.
"""

import json

import numpy as np

# Directions of the packages, y up.
NORMALS = np.array(
    [[0, 1, 0], [1, 0, 0], [0, 0, 1], [0.6, -0.8, 0], [-0.36, 0.48, 0.8]],
)
THREE = {
    "metadata": {"version": 4.7, "type": "Object", "generator": "Object3D.toJSON"},
    "object": {
        "uuid": "P",
        "type": "LightProbe",
        "name": "sky",
        "castShadow": False,
        "receiveShadow": False,
        "visible": True,
        "frustumCulled": True,
        "renderOrder": 0,
        "static": False,
        "matrixAutoUpdate": True,
        "layers": 1,
        "matrix": [
            0.9362933635841992, 0.3129918257854679, -0.15934507930797787, 0, -0.2896294776255155,
            0.9447024859948943, 0.15379199798896417, 0, 0.19866933079506122, -0.09784339500725567,
            0.9751703272018158, 0, 1, 2, 3, 1,
        ],
        "up": [0, 1, 0],
        "color": 16777215,
        "intensity": 1.5,
        "sh": [
            0.125, 0.25, 0, 0.25, 0.1875, 0.15625, 0.375, 0.125, 0.09375, 0.5, 0.0625, 0.03125,
            0.625, 0, 0.1875, 0.75, -0.0625, 0.125, 0.875, -0.125, 0.0625, 1, -0.1875, 0, 1.125,
            -0.25, 0.15625,
        ],
    },
}  # fmt: skip
THREE_IRRADIANCE = np.array([
    [-0.49921125, 0.82748250, 0.11606292], [1.33255688, 0.31382625, 0.12530283],
    [1.39202438, 0.43131844, 0.19035084], [-0.59431151, 0.25114329, -0.33031308],
    [0.62168375, 0.60154823, 0.24428809],
])  # fmt: skip


def three_scene(*probes: dict) -> dict:
    """A scene as `Scene.toJSON()` writes it, the probes in a group."""
    group = {"uuid": "G", "type": "Group", "layers": 1, "children": list(probes)}
    scene = {"uuid": "S", "type": "Scene", "layers": 1, "children": [{"type": "Mesh"}, group]}
    return {"metadata": THREE["metadata"], "object": scene}


def rows() -> np.ndarray:
    """Nine rows of three numbers, some negative."""
    i, c = np.meshgrid(np.arange(9), np.arange(3), indexing="ij")
    return ((3 * i + 5 * c) % 11 - 4) / 8.0


def cmgen(values: np.ndarray, words: str) -> str:
    """Print coefficients as cmgen does."""
    lines, l, m = [], 0, 0
    for row in values:
        numbers = ", ".join(f"{number:18.15f}" for number in row)
        lines.append(f"({numbers}); // L{l}{m}{words}\n")
        l, m = (l, m + 1) if m < l else (l + 1, -l - 1)
    return "".join(lines)


def filament(values: np.ndarray, d: np.ndarray) -> np.ndarray:
    """What Filament's shader makes of sh.txt: the irradiance over π."""
    x, y, z = d.T[..., None]
    one = np.ones_like(x)
    basis = [one, y, z, x, y * x, y * z, 3 * z * z - 1, z * x, x * x - y * y]
    return sum(b * row for b, row in zip(basis, values, strict=True))


def signed(values: np.ndarray, d: np.ndarray) -> np.ndarray:
    """The orthonormal polynomials with the sign (-1)^m, as printed in Sloan's "Stupid SH"."""
    constants = np.array([
        0.282094791773878, -0.488602511902920, 0.488602511902920, -0.488602511902920,
        1.092548430592079, -1.092548430592079, 0.315391565252520, -1.092548430592079,
        0.546274215296039,
    ])  # fmt: skip
    return filament(values * constants[:, None], d)


def gltf(values: np.ndarray, **more) -> dict:
    """A glTF file with one light, which its scene shows."""
    light = {"irradianceCoefficients": values.tolist(), "specularImages": [[0] * 6]}
    light |= {"specularImageSize": 1, **more}
    name = "EXT_lights_image_based"
    return {
        "asset": {"version": "2.0"},
        "extensionsUsed": [name],
        "extensions": {name: {"lights": [light]}},
        "scenes": [{"extensions": {name: {"light": 0}}}],
        "scene": 0,
    }


def glb(fields: dict) -> bytes:
    """The same in binary form."""
    text = json.dumps(fields).encode()
    text += b" " * (-len(text) % 4)
    size = (20 + len(text)).to_bytes(4, "little")
    length = len(text).to_bytes(4, "little")
    return b"glTF\2\0\0\0" + size + length + b"JSON" + text


def turned(d: np.ndarray) -> np.ndarray:
    """Directions with y up in our axes."""
    return np.stack([d[:, 0], -d[:, 2], d[:, 1]], axis=1)
