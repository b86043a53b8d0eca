"""Ways to the light of a mesh from few samples, and how far each is from the exact one."""

import functools
import itertools
import math
from collections.abc import Callable, Sequence
from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from jaxsh import imaging, midrange, transfer

from ..shared.subjects import Subject
from .scenes import exact_expansion, psnr

Rule = Literal["none", "half", "full"]

EXPONENTS = (1.0, 2.0, 4.0, 6.0, 8.0)
_FILL = 256
_NODES = 400  # samples on each triangle of a light, where derivatives are those of its integral


class Blend(NamedTuple):
    """The best of several exponents of eq. 16, by PSNR."""

    psnr: float
    exponent: float
    radiance: Float[Array, "v 3"]


class Trial(NamedTuple):
    """A mesh under lights, and its radiance by the exact light of each vertex."""

    subject: Subject
    reference: Float[Array, "v 3"]
    exposure: float

    @classmethod
    def of(cls, subject: Subject, light: Float[Array, "v 3 k"]) -> "Trial":
        """Of white surfaces: PSNR is the same for all."""
        reference = transfer.shade_diffuse(light, subject.baked, 1.0)
        return cls(subject, reference, float(imaging.auto_exposure(reference[None])))

    def shade(
        self,
        expansion: midrange.Expansion,
        weights: midrange.Weights | None = None,
        rule: Rule = "full",
    ) -> Float[Array, "v 3"]:
        return midrange.shade(expansion, self.subject.baked, 1.0, weights=weights, rule=rule)

    def psnr(self, radiance: Float[Array, "v 3"]) -> float:
        return psnr(radiance.astype(self.reference.dtype), self.reference, self.exposure)

    def blend(self, expansion: midrange.Expansion, rule: Rule) -> Blend:
        """Eqs. 15 and 16, with the exponent that suits best."""
        positions, points = self.subject.baked.positions, expansion.point
        tried = []
        for exponent in EXPONENTS if len(points) > 1 else EXPONENTS[:1]:
            weights = midrange.inverse_distance_weights(positions, points, exponent=exponent)
            radiance = self.shade(expansion, weights, rule)
            tried.append(Blend(self.psnr(radiance), exponent, radiance))
        return max(tried, key=lambda blend: blend.psnr)


def box_grid(subject: Subject, count: int) -> midrange.Grid:
    """count³ samples that span the bounding box."""
    return midrange.Grid(*subject.box, (count, count, count))


def inner_grid(subject: Subject, count: int) -> midrange.Grid:
    """count³ samples within the bounding box, nearer to the object."""
    return midrange.grid_around(subject.mesh.vertices, (count, count, count))


def take(expansion: midrange.Expansion, rows: int | slice) -> midrange.Expansion:
    """Some of the samples, or one."""
    return jax.tree.map(lambda a: a[rows], expansion)


def exact_samples(
    lights: Sequence[midrange.Polygon], points: Float[ArrayLike, "s 3"], degree: int
) -> midrange.Expansion:
    """`exact_expansion`, its points filled up: few numbers of them compile, and that takes long."""
    points = jnp.asarray(points)
    filled = jnp.pad(points, ((0, -len(points) % _FILL), (0, 0)), mode="edge")
    return take(exact_expansion(lights, filled, degree), slice(len(points)))


def expand(
    lights: Sequence[midrange.Polygon], points: Float[Array, "s 3"], degree: int, order: int
) -> midrange.Expansion:
    """Exact expansions to any order, of lights that do not hide each other.

    By autodiff of the integral over the lights' surfaces (eqs. 6 and 7), which shares nothing with
    the moments of a cube that it is compared with.
    """
    samples = midrange.surface_samples(lights, _NODES)
    samples = jax.tree.map(lambda a: a.astype(points.dtype), samples)
    return midrange.Expansion(points, _terms(samples, points, degree, order))


@functools.partial(jax.jit, static_argnums=(2, 3))
def _terms(samples: midrange.SurfaceSamples, points: Float[Array, "s 3"], degree: int, order: int):
    derivatives: list[Callable[[Array], Array]] = [
        functools.partial(midrange.project_surface, samples, degree=degree)
    ]
    for _ in range(order):
        derivatives.append(jax.jacfwd(derivatives[-1]))

    def at(point):
        terms = []
        for size, derivative in enumerate(derivatives):
            value = derivative(point)
            for axes in itertools.combinations_with_replacement(range(3), size):
                factor = math.prod(math.factorial(axes.count(axis)) for axis in range(3))
                terms.append(value[(..., *axes)] / factor)
        return jnp.stack(terms, axis=-1)

    return jax.lax.map(at, points)
