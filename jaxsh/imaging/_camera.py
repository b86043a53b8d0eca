"""A pinhole camera."""

import math
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from .._core.checks import (
    as_finite,
    as_float,
    check_known,
    check_number,
    check_size,
    check_type,
    described,
)
from .._core.host import put
from ..geometry import Mesh


def _point(name: str):
    """Converts a vector; integers become float32."""

    def convert(value: Any) -> Array:
        vector = as_finite(value, name, wait=True)
        if isinstance(value, Array) or np.asarray(value).dtype.kind not in "iu":
            return vector
        return put(np.asarray(value), np.float32)

    return convert


class Camera(eqx.Module):
    """Holds a pinhole camera at `position` that looks at `target`, `up` upwards in the picture.

    `fov_y` is the whole vertical angle of view in degrees; pixels are square. Vectors may be
    given as tuples. Raises `ValueError` for a picture without pixels, an angle outside (0, 180),
    and, where values are concrete, a view direction that is zero or along `up`.

    **Example**

    >>> from jaxsh import imaging
    >>> camera = imaging.Camera((0.0, -2.0, 0.0), (0.0, 0.0, 0.0), width=4, height=2)
    >>> origins, directions = camera.rays()
    >>> origins.shape, directions.shape
    ((8, 3), (8, 3))
    """

    position: Float[Array, " 3"] = eqx.field(converter=_point("position"))
    target: Float[Array, " 3"] = eqx.field(converter=_point("target"))
    up: Float[Array, " 3"] = eqx.field(converter=_point("up"), default=(0.0, 0.0, 1.0))
    fov_y: float | Float[Array, ""] = 40.0
    width: int = eqx.field(static=True, default=512)
    height: int = eqx.field(static=True, default=512)

    def __check_init__(self):
        for name in ("position", "target", "up"):
            if getattr(self, name).shape != (3,):
                raise ValueError(f"expected {name} (3,), got shape {getattr(self, name).shape}")
        if not isinstance(self.fov_y, float) and as_float(self.fov_y, "fov_y").ndim:
            raise ValueError(f"expected fov_y as a number, got {described(self.fov_y)}")
        if check_size("width", self.width, 0) < 1 or check_size("height", self.height, 0) < 1:
            raise ValueError(f"a picture needs pixels, got {self.width} × {self.height}")
        values = (self.position, self.target, self.up, self.fov_y)
        if any(isinstance(value, Tracer) for value in values):
            return
        if not 0 < float(self.fov_y) < 180:
            raise ValueError(f"fov_y must be between 0 and 180 degrees, got {float(self.fov_y):g}")
        forward = np.subtract(self.target, self.position, dtype=np.float64)
        up = np.asarray(self.up, np.float64)
        # Written so that NaN is refused too.
        if not (
            np.linalg.norm(np.cross(forward, up))
            > 1e-6 * np.linalg.norm(forward) * np.linalg.norm(up)
        ):
            raise ValueError(
                "target must differ from position, and up must not be along the view: "
                + ", ".join(
                    f"{name} {np.asarray(getattr(self, name)).tolist()}"
                    for name in ("position", "target", "up")
                )
            )

    @classmethod
    def facing(
        cls,
        mesh: Mesh,
        *,
        toward: tuple[float, float, float] = (0.0, -1.0, 0.2),
        fov_y: float = 30.0,
        width: int = 512,
        height: int = 512,
        margin: float = 0.05,
    ) -> "Camera":
        """Place a camera that sees `mesh` from the direction `toward`, filling the picture.

        `toward` points from the mesh to the camera (default: from its front, -y, and a little
        above). `margin` is the share of the picture's half width or height left free around it.
        Vertices that are in no face do not count. Runs on the host, outside `jit`. Raises
        `ValueError` for a mesh all in one point.

        **Example**

        >>> from jaxsh import geometry, imaging
        >>> camera = imaging.Camera.facing(geometry.knot(300), width=8, height=8)
        >>> bool(imaging.rasterize(geometry.knot(300), camera).mask.any())
        True
        """
        check_type("mesh", mesh, Mesh)
        check_known("mesh", mesh)
        fov_y, margin = check_number("fov_y", fov_y), check_number("margin", margin, least=0.0)
        if margin >= 1:
            raise ValueError(f"margin must be below 1, got {margin:g}")
        aim = cls(
            position=_point("toward")(toward),
            target=(0, 0, 0),
            fov_y=fov_y,
            width=width,
            height=height,
        )
        right, upward, forward = np.asarray(aim.on_host()[1], np.float64)
        seen = np.asarray(mesh.vertices, np.float64)[np.unique(np.asarray(mesh.faces))]
        if not len(seen) or not np.ptp(seen, axis=0).any():
            raise ValueError("expected a mesh that is larger than a point, to place a camera")
        x, y, z = (seen @ axis for axis in (right, upward, forward))
        # Seen from (cx, cy, cz) along z, a vertex is inside where |x - cx| ≤ tan_x (z - cz): the
        # camera is as far forward as the tighter of the two pairs of planes allows.
        tan_y = math.tan(math.radians(fov_y) / 2) * (1 - margin)
        cz = min(
            -(np.max(a - tan * z) + np.max(-a - tan * z)) / (2 * tan)
            for a, tan in ((x, tan_y * width / height), (y, tan_y))
        )
        cx, cy = (_center(a, z - cz) for a in (x, y))
        position = cx * right + cy * upward + cz * forward
        return cls(
            position=position.astype(np.float32),
            target=(position + (np.mean(z) - cz) * forward).astype(np.float32),
            fov_y=fov_y,
            width=width,
            height=height,
        )

    def rays(self) -> tuple[Float[Array, "n 3"], Float[Array, "n 3"]]:
        """Compute origins and unit directions through the pixel centers, rows from the top left.

        n is height · width; dtype that of `position`. Differentiable in every field that is not
        a size. Shards over a batch of cameras (`vmap`), not over the pixels of one.
        """
        return _rays(self)

    def _axes(self) -> tuple[Array, Array, Array]:
        """Compute unit vectors to the right, upwards and forward in the picture."""
        return _axes(self.position, self.target, self.up)

    def on_host(self) -> tuple[np.ndarray, np.ndarray]:
        """Position and axes (3, 3) of a camera that is known, in NumPy: no program to compile."""
        position, target, up = (np.asarray(a) for a in (self.position, self.target, self.up))
        return position, np.stack(_axes(position, target, up))


def host_rays(camera: Camera) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """`Camera.rays` of a camera that is known, in NumPy; the origins are one that is repeated."""
    position, axes = camera.on_host()
    directions = _directions(camera, tuple(axes), np.asarray(camera.fov_y, position.dtype))
    return np.broadcast_to(position, directions.shape), directions


@jax.jit
def _rays(camera: Camera):
    axes, dtype = camera._axes(), camera.position.dtype
    directions = _directions(camera, axes, jnp.asarray(camera.fov_y, dtype))
    return jnp.broadcast_to(camera.position[None], directions.shape), directions


def _directions(camera: Camera, axes: tuple[Any, Any, Any], fov_y: Any) -> Any:
    """Compute unit directions through the pixel centers, (n, 3)."""
    right, upward, forward = axes
    numpy, dtype = np if isinstance(right, np.ndarray) else jnp, right.dtype
    tan_y = numpy.tan(numpy.radians(fov_y) / 2)
    columns = (2 * numpy.arange(camera.width, dtype=dtype) + 1) / camera.width - 1
    rows = 1 - (2 * numpy.arange(camera.height, dtype=dtype) + 1) / camera.height
    x, y = (columns * tan_y * (camera.width / camera.height))[None], (rows * tan_y)[:, None]
    # The axes are square to each other.
    shorter = 1 / numpy.sqrt(x * x + (y * y + 1))
    parts = [(x * right[k] + (y * upward[k] + forward[k])) * shorter for k in range(3)]
    return numpy.stack(parts, axis=-1).reshape(-1, 3)


def _axes(position: Any, target: Any, up: Any) -> tuple[Any, Any, Any]:
    numpy, dtype = np if isinstance(position, np.ndarray) else jnp, position.dtype
    forward = _unit(target.astype(dtype) - position)
    right = _unit(numpy.cross(forward, up.astype(dtype)))
    return right, numpy.cross(right, forward), forward


def _unit(x: Any) -> Any:
    numpy = np if isinstance(x, np.ndarray) else jnp
    return x / numpy.linalg.norm(x, axis=-1, keepdims=True)


def _center(x: np.ndarray, depth: np.ndarray) -> float:
    """Find the c from which the outermost (x - c) / depth to both sides are equally far out."""
    c = 0.0
    for _ in range(16):  # finds the two outermost in a few steps, then stays
        out = (x - c) / depth
        i, j = out.argmax(), out.argmin()
        c = (x[i] * depth[j] + x[j] * depth[i]) / (depth[i] + depth[j])
    return c
