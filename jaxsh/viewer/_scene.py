"""Packs what a page is sent: a header of numbers and names, and the arrays of a mesh."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float, Int

from .._core.checks import (
    as_finite,
    check_all,
    check_finite,
    check_known,
    check_number,
    check_type,
)
from ..geometry import Mesh, Texels
from ..imaging import Camera, auto_exposure
from ..transfer import CompressedTransfer, Material, Transfer
from ._gloss import gloss_facts, split_material
from ._lamp import Lamp
from ._lights import make_lights, shaded
from ._sky import Sky
from ._surface import Surface, make_surface, tinted
from ._values import packed_values

# WebGL2 promises textures of 2048 texels along a side.
_ROW, _MOST_ROWS = 1024, 2048
_MOST_CODE = 32767  # of int16


class Scene(NamedTuple):
    """Holds a header, which JSON takes, and the bytes of the arrays that it names, in order.

    Beside these, what was drawn, with which albedo and transfer, for a picture by Python.
    """

    header: dict[str, Any]
    arrays: bytes
    surface: Surface
    albedo: Any
    transfer: Transfer


class Codes(NamedTuple):
    """Holds coefficients as integers: `codes` times `scales` are the coefficients."""

    codes: np.ndarray  # int16 (v, k)
    scales: np.ndarray  # float64 (k,)


def make_scene(
    transfer: Transfer | CompressedTransfer,
    light: Float[ArrayLike, "*lights 3 k"] | None,
    faces: Int[ArrayLike, "f 3"] | Mesh | Texels,
    albedo: Float[ArrayLike, "..."] | Material | None,
    *,
    textured: bool | None,
    camera: Camera | None,
    exposure: float | None,
    names: Sequence[str] | None,
    title: str,
    values: Mapping[str, ArrayLike] | None,
    sky: Sky | None,
    lamp: Lamp | None,
) -> Scene:
    """Check all and pack it; raises `ValueError` or `TypeError` for what does not fit."""
    check_type("transfer", transfer, Transfer, CompressedTransfer)
    known = {"transfer": transfer, "albedo": albedo, "values": values, "camera": camera}
    for name, value in known.items():
        check_known(name, value)
    small = transfer if isinstance(transfer, CompressedTransfer) else None
    if isinstance(transfer, CompressedTransfer):
        transfer = transfer.decompressed()
    lights = make_lights(light, sky, lamp, transfer)
    count = transfer.num_points
    if count > _ROW * _MOST_ROWS:
        raise ValueError(f"expected at most {_ROW * _MOST_ROWS} points of transfer, got {count}")
    surface, reflects = make_surface(faces, transfer, albedo, textured)
    corners = surface.faces
    diffuse, material = split_material(reflects)
    shared, codes = _packed_albedo(diffuse, count)
    value_facts, value_codes = packed_values(values, count)
    if exposure is not None:
        exposure = check_number("exposure", exposure, above=0.0)
    check_type("title", title, str)
    positions = np.asarray(transfer.positions, np.float32)
    check_finite("positions of the transfer", positions, wait=True)
    drawn = positions if surface.texels is None else surface.arrays["vertices"]
    middle, radius = _ball_around(drawn, corners)
    if camera is None:
        camera = Camera.facing(Mesh(jnp.asarray(drawn), jnp.asarray(corners), jnp.asarray(drawn)))
    check_type("camera", camera, Camera)
    rounded = quantized(np.asarray(transfer.vectors(lights.coefficients.shape[-1])))
    if exposure is None:
        # What the whole mesh sends out stands for what a picture shows of it.
        first = lights.kinds[0], lights.coefficients[0]
        sent = shaded(*first, transfer, reflects, camera.position, lamp)
        if surface.tinted:
            sent = tinted(surface, sent, shaded(*first, transfer, diffuse, camera.position, lamp))
        exposure = float(auto_exposure(sent[None]))
    rows = math.ceil(count / _ROW)
    layers = in_layers(rounded.codes, rows)
    header = {
        "title": title,
        "names": checked_names(names, lights.names()),
        "lights": lights.coefficients.tolist(),
        "degree": lights.degree,
        "exposure": exposure,
        "albedo": shared,
        "camera": _facts(camera),
        "middle": middle.tolist(),
        "radius": radius,
        "scales": rounded.scales.tolist(),
        "numVertices": count,
        "numFaces": len(corners),
        "rowLength": _ROW,
        "rows": rows,
        "layers": len(layers),
        "values": value_facts,
        "surface": surface.facts,
    }
    header |= lights.facts
    if material is not None:
        header["glossy"] = gloss_facts(material, lights.degree, count)
    arrays = lights.arrays | {
        "positions": positions.astype("<f4"),
        "faces": corners.astype("<u4"),
    }
    if small is None:
        arrays["transfer"] = layers.astype("<i2")
    else:
        header["clusters"] = {"points": count, "components": small.num_components}
        arrays |= in_clusters(small, len(rounded.scales))
    if material is not None:
        normals = np.asarray(transfer.normals)
        defined = np.isfinite(normals).all(axis=1, keepdims=True)
        arrays["normals"] = np.where(defined, normals, 0).astype("<f4")
    if codes is not None:
        arrays["albedoCodes"] = codes.astype("<u2")
    named, joined = packed(header, arrays | surface.arrays | value_codes)
    return Scene(named, joined, surface, reflects, transfer)


def packed(header: dict[str, Any], arrays: dict[str, np.ndarray]) -> tuple[dict[str, Any], bytes]:
    """Name arrays, little-endian, in the header and join their bytes, each from a multiple of 4."""
    facts = [
        {"name": name, "type": array.dtype.str[1:], "length": array.size}
        for name, array in arrays.items()
    ]
    parts = [array.tobytes() + bytes(-array.nbytes % 4) for array in arrays.values()]
    return header | {"arrays": facts}, b"".join(parts)


def checked_names(names: Any, default: list[str]) -> list[str]:
    """A name for each light; raises unless there are as many."""
    if names is None:
        return default
    check_all("names", names, str)
    if len(names) != len(default):
        raise ValueError(f"expected {len(default)} names, one for each light, got {len(names)}")
    return list(names)


def quantized(coefficients: np.ndarray) -> Codes:
    """Round each column to integers in steps of 1/32767 of its largest magnitude."""
    values = coefficients.astype(np.float64)
    if bad := int((~np.isfinite(values)).sum()):
        raise ValueError(f"transfer must be finite, got {bad} coefficients that are not")
    scales = np.abs(values).max(axis=0) / _MOST_CODE
    codes = np.rint(values / np.where(scales > 0, scales, 1))
    return Codes(codes.astype(np.int16), scales)


def in_layers(codes: np.ndarray, rows: int) -> np.ndarray:
    """Lay codes (v, k) out as texels of four coefficients: (layers, rows · 1024, 4)."""
    count, width = codes.shape
    layers = math.ceil(width / 4)
    texels = np.zeros((rows * _ROW, layers * 4), np.int16)
    texels[:count, :width] = codes
    return texels.reshape(rows * _ROW, layers, 4).swapaxes(0, 1)


def in_clusters(transfer: CompressedTransfer, width: int) -> dict[str, np.ndarray]:
    """List what the page makes the first `width` coefficients of each point from."""
    codes = np.asarray(transfer.codes)[..., :width]
    return {
        "weights": np.asarray(transfer.weights),
        "clusterOf": np.asarray(transfer.cluster).astype("<u2"),
        "clusterCodes": np.ascontiguousarray(codes).astype("<i2"),
        "clusterScales": np.asarray(transfer.scales).astype("<f4"),
    }


def _ball_around(positions: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, float]:
    """Middle and radius of what is seen: what no face has would be beside the picture."""
    seen = positions[np.unique(corners)]
    middle = (seen.min(axis=0) + seen.max(axis=0)) / 2
    radius = float(np.linalg.norm(seen - middle, axis=1).max())
    if radius == 0:
        raise ValueError(f"expected a mesh, got faces whose corners are all at {middle.tolist()}")
    return middle, radius


def _packed_albedo(albedo: Any, count: int) -> tuple[list[float], np.ndarray | None]:
    """Split an albedo into RGB that all vertices share, and 16-bit codes (v, 3) of [0, 1] of it.

    Raises `ValueError` for shapes that do not fit and values that are negative or not finite.
    """
    array = np.asarray(as_finite(albedo, "albedo", least=0.0, wait=True), np.float64)
    if array.shape not in ((), (3,), (count, 1), (count, 3)):
        raise ValueError(
            f"expected albedo as a number, (3,), ({count}, 1) or ({count}, 3), got shape "
            f"{array.shape}"
        )
    if array.ndim < 2:
        return np.broadcast_to(array, 3).tolist(), None
    largest = array.max(axis=0)
    codes = np.rint(array / np.where(largest > 0, largest, 1) * 65535).astype(np.uint16)
    return np.broadcast_to(largest, 3).tolist(), np.broadcast_to(codes, (count, 3))


def _facts(camera: Camera) -> dict[str, Any]:
    vectors = {
        name: np.asarray(getattr(camera, name), np.float64).tolist()
        for name in ("position", "target", "up")
    }
    aspect = camera.width / camera.height
    return vectors | {"fovY": float(camera.fov_y), "aspect": aspect}
