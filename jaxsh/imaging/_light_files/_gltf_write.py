"""Write the light of EXT_lights_image_based, with the pictures that the extension wants."""

import base64
import io
import json
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8

from ..._core.gltf import glb
from ...harmonics import Convention, evaluate
from ...harmonics._convention import axes_rows
from .._layouts import face_directions

NAME = "EXT_lights_image_based"
_SIZE = 16  # pixels of a face: the light is smooth


def gltf_file(
    values: Float[np.ndarray, "9 3"],
    light: Float[np.ndarray, "3 9"],
    facts: Convention,
    *,
    binary: bool,
) -> bytes:
    """Give a file with a scene that has nothing but the light, in JSON or as a GLB.

    Its six pictures, one level of a reflection, show the light itself, negative values as black.
    """
    pictures = _pictures(light, facts)
    described = {
        "irradianceCoefficients": values.tolist(),
        "specularImages": [list(range(6))],
        "specularImageSize": _SIZE,
    }
    content: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "jaxsh"},
        "extensionsUsed": [NAME],
        "extensions": {NAME: {"lights": [described]}},
        "scene": 0,
        "scenes": [{"extensions": {NAME: {"light": 0}}}],
    }
    if not binary:
        content["images"] = [{"uri": _data_uri(picture)} for picture in pictures]
        return json.dumps(content).encode()
    sizes = [len(picture) for picture in pictures]
    starts = [sum(sizes[:i]) for i in range(len(sizes))]
    content["buffers"] = [{"byteLength": sum(sizes)}]
    content["bufferViews"] = [
        {"buffer": 0, "byteOffset": start, "byteLength": size}
        for start, size in zip(starts, sizes, strict=True)
    ]
    content["images"] = [{"bufferView": i, "mimeType": "image/png"} for i in range(len(sizes))]
    return glb(json.dumps(content).encode(), b"".join(pictures))


def _data_uri(picture: bytes) -> str:
    return f"data:image/png;base64,{base64.b64encode(picture).decode()}"


def _pictures(light: Float[np.ndarray, "3 9"], facts: Convention) -> list[bytes]:
    """Give the faces +x, -x, +y, -y, +z, -z of the file's axes, as they are seen from inside."""
    # OpenGL's faces, each turned over its vertical axis, as the specification has it.
    directions = face_directions(_SIZE)[:, :, ::-1] @ axes_rows(facts.axes)
    basis = np.asarray(evaluate(directions.astype(light.dtype), 2))
    return [_png(_rgbd(np.maximum(face @ light.T, 0))) for face in basis]


def _rgbd(radiance: Float[np.ndarray, "h w 3"]) -> UInt8[np.ndarray, "h w 4"]:
    """Pack radiance into bytes as Babylon.js unpacks it: (rgb / 255)^2.2 / (alpha / 255)."""
    largest = radiance.max(axis=-1, keepdims=True)
    alpha = np.clip(np.floor(255 / np.maximum(largest, 1)), 1, 255)
    color = np.clip(radiance * alpha / 255, 0, 1) ** (1 / 2.2)
    return np.concatenate([np.rint(255 * color), alpha], axis=-1).astype(np.uint8)


def _png(pixels: UInt8[np.ndarray, "h w 4"]) -> bytes:
    from PIL import Image

    out = io.BytesIO()
    Image.fromarray(pixels).save(out, "png")
    return out.getvalue()
