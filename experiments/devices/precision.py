"""What TF32 and bfloat16 do to pictures, to projections and to fits, by rounding on any device."""

import dataclasses
import functools
from collections.abc import Callable, Iterator
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import adaptive, harmonics, imaging, inverse, midrange, sky, sphere, transfer

from ..runner import Context, Table, UserError, experiment
from ..shared.subjects import Subject, load
from .rounding import BITS, rounded

_ALBEDO, _EXPONENT = 0.5, 32.0
_WHITE = 99  # percentile of the largest channel, over vertices that face the eye


@dataclasses.dataclass(frozen=True)
class Config:
    mesh: str | None = None
    """none means the first of the data"""
    environment: str | None = None
    """none means the first of the data"""
    degree: int = 10
    """degree of light and transfer"""
    directions: int = 1024
    """directions of the bake"""
    size: int = 512
    """height and width of the picture, in pixels"""
    results: tuple[str, ...] = ()
    """results by name; none means all"""

    def __post_init__(self):
        if self.degree < 2 or min(self.directions, self.size) < 1:
            raise ValueError("expected a degree of at least 2, directions and size of at least 1")


class Result(NamedTuple):
    """One result: colors of vertices, which become a picture, or numbers."""

    name: str
    kind: Literal["picture", "number"]
    obeys: bool
    function: Callable[..., Any]
    arguments: tuple


class View(NamedTuple):
    """Who looks at the mesh, and under which light."""

    subject: Subject
    raster: imaging.Raster
    eye: Float[Array, " 3"]
    light: Float[Array, "3 k"]  # exposed
    image: Float[Array, "h w 3"]

    def picture(self, color: Float[Array, "v 3"]) -> Float[Array, "h w 3"]:
        """Linear, clipped; in double precision, so that the comparison rounds nothing."""
        color = jnp.asarray(color, jnp.float64)
        return jnp.clip(imaging.interpolate(self.raster, color), 0, 1)


@experiment("devices.precision", x64=True)
def precision(config: Config, context: Context) -> list[Table]:
    view = _view(config, context)
    results = [*_pictures(view), *_numbers(view, config.degree)]
    names = [result.name for result in results]
    for name in config.results:
        if name not in names:
            raise UserError(f"expected results among {names}, got {name!r}")
    results = [one for one in results if not config.results or one.name in config.results]
    for result in context.progress(results, "results"):
        context.record(_measured(result, view))
    pictures, numbers = (
        [row for row in context.rows if row["kind"] == kind] for kind in ("picture", "number")
    )
    about = {"about": view.subject.about}
    return [Table("Pictures", rows=pictures, values=about), Table("Numbers", rows=numbers)]


def _measured(result: Result, view: View) -> dict[str, Any]:
    row = {"result": result.name, "kind": result.kind, "obeys": result.obeys}
    single, double = (_cast(result.arguments, one) for one in (jnp.float32, jnp.float64))
    exact = jax.jit(result.function)(*double)
    ways = {"full": jax.jit(result.function)} | {
        name: rounded(result.function, name, everything=not result.obeys) for name in BITS
    }
    for name, way in ways.items():
        found = way(*single)
        if result.kind == "picture":
            pictures = view.picture(found), view.picture(exact)
            row[f"psnr_{name}"] = float(imaging.psnr(*pictures, view.raster.mask))
        else:
            row[f"error_{name}"] = _relative(found, exact)
    return row


def _relative(found: Array, exact: Array) -> float:
    """Relative RMS error."""
    off = np.asarray(found, np.float64) - np.asarray(exact)
    return float(np.linalg.norm(off) / np.linalg.norm(exact))


def _cast(tree, dtype):
    def cast(leaf):
        is_float = isinstance(leaf, jax.Array | np.ndarray) and jnp.issubdtype(
            leaf.dtype, jnp.floating
        )
        return jnp.asarray(leaf, dtype) if is_float else leaf

    return jax.tree.map(cast, tree)


def _view(config: Config, context: Context) -> View:
    subject = load(context, config.mesh, config.degree, directions=config.directions)
    camera = imaging.Camera.facing(subject.mesh, width=config.size, height=config.size)
    image = context.data.environment(config.environment or context.data.environments()[0])
    light = sphere.project_lat_long(image, config.degree)
    baked = subject.baked
    color = transfer.shade_glossy(light, baked, camera.position, _material())
    faces = jnp.sum((camera.position[None] - baked.positions) * baked.normals, axis=1) > 0
    white = np.percentile(np.asarray(color).max(axis=1)[np.asarray(faces)], _WHITE)
    raster = _cast(imaging.rasterize(subject.mesh, camera), jnp.float64)
    return View(subject, raster, camera.position, light / float(white), image)


def _material() -> transfer.Material:
    return transfer.Material(*(np.float32(x) for x in (_ALBEDO, _ALBEDO, _EXPONENT)))


def _pictures(view: View) -> Iterator[Result]:
    """All that shades."""
    baked, light, eye, material = view.subject.baked, view.light, view.eye, _material()

    def picture(name, function, *arguments):
        return Result(name, "picture", True, function, arguments)

    def diffuse(light, made):
        return transfer.shade_diffuse(light, made, _ALBEDO)

    def glossy(light, made, eye, material):
        return transfer.shade_glossy(light, made, eye, material)

    yield picture("shade_diffuse", diffuse, light, baked)
    yield picture("shade_diffuse, eight bits", diffuse, light, transfer.quantize(baked))
    yield picture("shade_glossy", glossy, light, baked, eye, material)
    yield picture("shade_glossy, sampled", glossy, light, transfer.sample(baked), eye, material)
    still = transfer.fixed_view(baked, eye, material)
    yield picture("fixed_view", lambda still, light: still(light), still, light)
    tiles = adaptive.make_tiles(baked, eye, exponent=_EXPONENT)
    yield picture("tiles", lambda tiles, *frame: tiles(*frame).color, tiles, light, eye, material)
    masks = functools.partial(adaptive.shade, method="masks")
    yield picture("masks", lambda *frame: masks(*frame).color, light, baked, eye, material)
    yield picture("midrange.shade", midrange.shade, _lamps(view), baked, np.float32(_ALBEDO))


def _lamps(view: View) -> midrange.Expansion:
    """A lamp in front of the mesh, as its light and gradient in the mesh's middle."""
    low, high = view.subject.box
    middle, size = (low + high) / 2, float(jnp.max(high - low))
    center = middle + 1.5 * (view.eye - middle) / jnp.linalg.norm(view.eye - middle) * size
    degree = harmonics.degree_of(view.light.shape[1])
    ball = midrange.Sphere(center, 0.2 * size, 20 * jnp.ones(3, center.dtype))
    coefficients, gradient = midrange.sphere_harmonics_with_gradient(ball, middle, degree)
    return midrange.make_expansion(middle, coefficients, gradient)


def _numbers(view: View, degree: int) -> Iterator[Result]:
    """The gradient of shading, which obeys; and what never does, as if it did."""
    baked, light = view.subject.baked, view.light
    first, second = jax.random.normal(jax.random.key(0), (2, 3, light.shape[1]), jnp.float32)

    def brightness(light, made):
        return jnp.mean(transfer.shade_diffuse(light, made, _ALBEDO) ** 2)

    yield Result("gradient of shade_diffuse", "number", True, jax.grad(brightness), (light, baked))

    def number(name, function, *arguments):
        return Result(name, "number", False, function, arguments)

    yield number(
        "project_lat_long",
        functools.partial(sphere.project_lat_long, degree=degree),
        view.image,
    )
    grid = sphere.gauss_legendre(2 * degree)
    values = sphere.reconstruct(light.astype(jnp.float64), grid.directions)
    yield number("project", lambda values: sphere.project(values, grid, degree), values)
    turn = jnp.asarray([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    yield number("rotate", harmonics.rotate, first, turn)
    yield number("product", harmonics.product, first, second)
    yield number("sample", lambda made: transfer.sample(made).samples, baked)
    sun = jnp.asarray([0.6, 0.0, 0.8])
    exact = functools.partial(sky.project_preetham, degree=degree)
    yield number("project_preetham", exact, sun, jnp.asarray(3.0))
    made = baked.truncated(min(degree, 6))
    day = sky.preetham_harmonics(sun, jnp.asarray(3.0), made.degree)
    seen = transfer.shade_diffuse(day, made.astype(jnp.float64), _ALBEDO)

    def found(seen, made):
        fit = inverse.fit_sky(seen, made, np.asarray(_ALBEDO, made.dtype), throw=False)
        return fit.value.sun

    yield number("fit_sky, the sun", found, seen, made)
