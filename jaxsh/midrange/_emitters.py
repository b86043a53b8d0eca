"""Lights: polygons, spheres and meshes."""

import equinox as eqx
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import as_finite, as_float, check_flag, check_type
from .._core.known import is_concrete
from ..geometry import Mesh

# A vertex may be this far out of the plane, as a share of the polygon's extent.
_FLAT = {np.dtype(np.float64): 1e-9, np.dtype(np.float32): 1e-5}


def _as_radiance(value: ArrayLike) -> Float[Array, "..."]:
    return as_finite(value, "radiance", wait=True)


class Polygon(eqx.Module):
    """Describes a flat, simple polygon that emits `radiance` from one side, or from both.

    The vertices (n, 3) run counter-clockwise seen from the side that emits; the polygon may be
    concave. `radiance` is linear RGB (3,), the same at every point and in every direction. As a
    blocker only the shape counts.

    Raises `ValueError` for shapes that do not fit and, where values are known, for numbers that
    are not finite, no area, vertices out of the plane (by more than 1e-9 of the extent, 1e-5
    below float64), and a boundary that meets itself.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> corners = jnp.array([[1.0, -1, 2], [-1, -1, 2], [-1, 1, 2], [1, 1, 2]])
    >>> light = midrange.Polygon(corners, jnp.ones(3))
    >>> light.vertices.shape, light.two_sided
    ((4, 3), False)
    """

    vertices: Float[Array, "n 3"] = eqx.field(converter=lambda v: as_float(v, "vertices"))
    radiance: Float[Array, " 3"] = eqx.field(converter=_as_radiance)
    two_sided: bool = eqx.field(static=True, default=False)

    def __check_init__(self):
        shape = self.vertices.shape
        if len(shape) != 2 or shape[0] < 3 or shape[1] != 3:
            raise ValueError(f"expected at least 3 vertices (n, 3), got shape {shape}")
        if self.radiance.shape != (3,):
            raise ValueError(f"expected radiance (3,), got shape {self.radiance.shape}")
        check_flag("two_sided", self.two_sided)
        if is_concrete(self.vertices):
            _check_vertices(np.asarray(self.vertices))


def is_convex(vertices: Float[np.ndarray, "n 3"]) -> bool:
    """Tell if no corner of a simple polygon turns inwards."""
    corners, _ = without_unit(vertices)
    edges = np.roll(corners, -1, axis=0) - corners
    turns = np.cross(edges, np.roll(edges, -1, axis=0)) @ unit_normal(corners)
    return bool((turns >= 0).all())


def unit_normal(vertices: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " 3"]:
    """Compute the unit normal, in float64."""
    area = _area_vector(without_unit(vertices)[0])
    return area / np.linalg.norm(area)


def without_unit(vertices: Float[np.ndarray, "n 3"]) -> tuple[Float[np.ndarray, "n 3"], float]:
    """Take off the first vertex and divide by the extent, which is the second result.

    So that no product of lengths leaves the range of floats, whatever the unit of length.
    """
    corners = vertices.astype(np.float64) - vertices[0]
    extent = float(np.abs(corners).max())
    return corners / (extent if extent > 0 else 1), extent


def _area_vector(vertices: np.ndarray) -> np.ndarray:
    """Compute the area's vector, by Newell's formula."""
    return np.cross(vertices, np.roll(vertices, -1, axis=0)).sum(axis=0) / 2


def _check_vertices(vertices: np.ndarray) -> None:
    if not np.isfinite(vertices).all():
        raise ValueError("a polygon's vertices must be finite")
    tolerance = _FLAT.get(vertices.dtype, _FLAT[np.dtype(np.float32)])
    corners, extent = without_unit(vertices)
    area = _area_vector(corners)
    size = np.linalg.norm(area)
    if size <= tolerance:
        raise ValueError(
            f"a polygon must have an area, got {size:.1e} of the squared extent, {extent:.1e}²"
        )
    height = np.abs(corners @ area / size).max()
    if height > tolerance:
        raise ValueError(
            f"a polygon must be flat: a vertex is {height:.1e} of the extent out of the "
            f"plane, more than {tolerance:.0e}; split it into triangles"
        )
    pair = _meeting_edges(np.delete(corners, np.argmax(np.abs(area)), axis=1))
    if pair is not None:
        raise ValueError(f"a polygon's boundary must not meet itself: edges {pair} do")


def _meeting_edges(corners: Float[np.ndarray, "n 2"]) -> tuple[int, int] | None:
    """Find two edges, not neighbors, that have a point in common, if there are any.

    So do edges of no length, with those beyond them; neighbors that fold back are found as the
    edges before or after them, or as no area.
    """
    ends = np.roll(corners, -1, axis=0)

    def side(a, b, c):  # of c from the line a -> b
        u, v = b - a, c - a
        return np.sign(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])

    a, b = corners[:, None], ends[:, None]
    c, d = corners[None], ends[None]
    across = (side(a, b, c) * side(a, b, d) <= 0) & (side(c, d, a) * side(c, d, b) <= 0)
    # Edges on one line have all four sides zero, and meet where their boxes do.
    boxes = (np.minimum(a, b) <= np.maximum(c, d)) & (np.minimum(c, d) <= np.maximum(a, b))
    gap = (np.arange(len(corners))[:, None] - np.arange(len(corners))[None]) % len(corners)
    apart = (gap > 1) & (gap < len(corners) - 1)
    found = np.argwhere(across & boxes.all(axis=-1) & apart)
    return (int(found[0, 0]), int(found[0, 1])) if len(found) else None


class Sphere(eqx.Module):
    """Describes a sphere that emits `radiance` outwards, linear RGB (3,), the same everywhere.

    Raises `ValueError` for shapes that do not fit and, where values are known, for numbers that
    are not finite and a radius that is not positive.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import midrange
    >>> midrange.Sphere(jnp.array([0.0, 0, 2]), jnp.array(0.5), jnp.ones(3)).center.shape
    (3,)
    """

    center: Float[Array, " 3"] = eqx.field(converter=lambda v: as_finite(v, "center", wait=True))
    radius: Float[Array, ""] = eqx.field(converter=lambda v: as_finite(v, "radius", wait=True))
    radiance: Float[Array, " 3"] = eqx.field(converter=_as_radiance)

    def __check_init__(self):
        for name, shape in (("center", (3,)), ("radius", ()), ("radiance", (3,))):
            value = getattr(self, name)
            if value.shape != shape:
                raise ValueError(f"expected {name} of shape {shape}, got {value.shape}")
        if is_concrete(self.radius) and not np.asarray(self.radius) > 0:
            raise ValueError(f"a sphere's radius must be positive, got {float(self.radius):g}")


class EmissiveMesh(eqx.Module):
    """Describes a mesh whose faces emit `radiance` outwards, or to both sides.

    `radiance` is (3,), the same for all faces, or (F, 3). The front of a face is where its corners
    run counter-clockwise; a one-sided face is black from behind, and blocks.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import geometry, midrange
    >>> lamp = midrange.EmissiveMesh(geometry.knot(300), jnp.ones(3))
    >>> lamp.two_sided
    False
    """

    mesh: Mesh
    radiance: Float[Array, "*faces 3"] = eqx.field(converter=_as_radiance)
    two_sided: bool = eqx.field(static=True, default=False)

    def __check_init__(self):
        check_type("mesh", self.mesh, Mesh)
        check_flag("two_sided", self.two_sided)
        faces = len(self.mesh.faces)
        if self.radiance.shape not in ((3,), (faces, 3)):
            raise ValueError(
                f"expected radiance (3,) or one for each face ({faces}, 3), got shape "
                f"{self.radiance.shape}"
            )
