"""The same file, light and camera rendered by Mitsuba 3: direct light by path sampling.

Nothing is shared with ours but the GLB file itself: trimesh reads it, y up, and hands it to
Mitsuba's own reader as an OBJ.
"""

import importlib
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from jaxsh import imaging

from ..runner import UserError


def mitsuba() -> Any:
    """Mitsuba on the CPU, without LLVM."""
    try:
        mi = importlib.import_module("mitsuba")
    except ImportError:
        raise UserError(
            "this experiment renders with Mitsuba: pip install mitsuba, or the extra mitsuba"
        ) from None
    mi.set_variant("scalar_rgb")
    mi.set_log_level(mi.LogLevel.Warn)
    return mi


def scene(
    glb: Path, environment: Float[np.ndarray, "h w 3"], camera: imaging.Camera
) -> tuple[Any, Any]:
    """Mitsuba, and its scene of a textured GLB under a lat-long picture in this package's order."""
    mi = mitsuba()
    sensor = {
        "type": "perspective",
        "fov": float(camera.fov_y),
        "fov_axis": "y",
        "to_world": mi.ScalarTransform4f().look_at(
            origin=_y_up(camera.position), target=_y_up(camera.target), up=_y_up(camera.up)
        ),
        "film": {
            "type": "hdrfilm",
            "width": camera.width,
            "height": camera.height,
            "rfilter": {"type": "box"},
            "pixel_format": "rgb",
            "component_format": "float32",
        },
    }
    made = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct", "hide_emitters": True},
            "light": {"type": "envmap", "bitmap": mi.Bitmap(as_envmap(environment))},
            "mesh": _mesh(mi, glb),
            "sensor": sensor,
        }
    )
    return mi, made


def render(mi: Any, made: Any, *, samples: int, seed: int) -> Float[np.ndarray, "h w 3"]:
    """Linear radiance; black beside the object."""
    return np.array(mi.render(made, spp=samples, seed=seed))


def as_envmap(environment: Float[np.ndarray, "h w 3"]) -> Float[np.ndarray, "h w 3"]:
    """A picture in Mitsuba's order: -y of ours in the middle, and φ falling to the right."""
    width = environment.shape[1]
    if width % 4:
        raise ValueError(f"expected a width that is a multiple of 4, got {width}")
    columns = (5 * width // 4 - 1 - np.arange(width)) % width
    return np.ascontiguousarray(environment[:, columns], np.float32)


def _mesh(mi: Any, glb: Path) -> Any:
    trimesh: Any = importlib.import_module("trimesh")
    [part] = trimesh.load(glb, process=False).dump()
    material = part.visual.material
    picture = np.asarray(material.baseColorTexture.convert("RGB"))
    share = np.asarray(material.baseColorFactor, np.float64)[:3] / 255
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "mesh.obj"
        path.write_text(
            trimesh.exchange.obj.export_obj(part, include_normals=True, write_texture=False)
        )
        return mi.load_dict(
            {
                "type": "obj",
                "filename": str(path),
                "bsdf": {
                    "type": "diffuse",
                    "reflectance": {"type": "bitmap", "bitmap": _scaled(mi, picture, share)},
                },
            }
        )


def _scaled(mi: Any, codes: np.ndarray, share: np.ndarray) -> Any:
    """The texture, decoded, times the material's factor."""
    signal = codes / 255
    linear = np.where(signal <= 0.04045, signal / 12.92, ((signal + 0.055) / 1.055) ** 2.4)
    return mi.Bitmap((linear * share).astype(np.float32))


def _y_up(vector: Any) -> list[float]:
    x, y, z = np.asarray(vector, np.float64).tolist()
    return [x, z, -y]
