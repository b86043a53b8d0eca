"""Read the image-based light of a glTF file, by the extension EXT_lights_image_based."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from ..._core.gltf import Document, open_document
from ..._core.json_fields import extension, listed, number, numbers, shown, text, whole
from ._gltf_write import NAME
from ._stored import Stored, choose


def read_gltf(path: Path, which: str | int | None) -> Stored:
    """Read the coefficients of a light, times its intensity, and how it is turned.

    The light is that of the scene where nothing else is asked for. Its pictures are not looked at.
    """
    document = open_document(path, path.read_bytes())
    fields = extension(document.fields, NAME, "the file")
    lights = listed(fields or {}, "lights", NAME)
    if not lights:
        raise ValueError(f"it holds no light of {NAME}")
    if not all(isinstance(light, dict) for light in lights):
        raise ValueError(f"{NAME} has lights that are no objects")
    names = [text(light, "name", "a light") or "" for light in lights]
    at = choose("lights", names, which, _of_scene(document, len(lights)))
    light, owner = lights[at], f"light {at}"
    rows = listed(light, "irradianceCoefficients", owner)
    if len(rows) != 9:
        raise ValueError(f"{owner} should have 9 rows as 'irradianceCoefficients', got {len(rows)}")
    values = [
        numbers({"row": row}, "row", f"{owner}, coefficient {i},", 3, None)
        for i, row in enumerate(rows)
    ]
    intensity = number(light, "intensity", owner, 1.0)
    rotation = numbers(light, "rotation", owner, 4, [0.0, 0.0, 0.0, 1.0])
    return Stored(np.array(values) * intensity, "gltf", "channels-last", _matrix(rotation, owner))


def _of_scene(document: Document, count: int) -> int | None:
    """Give the light of the scene that is shown, None where it has none."""
    scenes = listed(document.fields, "scenes", "the file")
    if not scenes:
        return None
    at = whole(document.fields, "scene", "the file", 0)
    fields = extension(document.item("scenes", at, "the file"), NAME, f"scene {at}")
    if not fields:
        return None
    light = whole(fields, "light", f"scene {at}")
    if light >= count:
        raise ValueError(f"scene {at} names light {shown(light)}, but there are {count}")
    return light


def _matrix(quaternion: list[float], owner: str) -> Float[np.ndarray, "3 3"] | None:
    """Give the rotation of a quaternion x, y, z, w of any length; None for no rotation."""
    length = float(np.linalg.norm(quaternion))
    if not 0 < length < np.inf:
        raise ValueError(f"{owner} has a rotation of length {length:g}, expected 1")
    if not any(quaternion[:3]):
        return None
    from scipy.spatial.transform import Rotation  # takes long to import

    return Rotation.from_quat(np.array(quaternion) / length).as_matrix()
