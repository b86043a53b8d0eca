"""The cases of `python -m benchmarks.gpu`, with the bytes and operations that none can avoid."""

import functools
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxsh import geometry, harmonics, midrange, sky, sphere, transfer

from . import _gpu_frames
from ._gpu_case import Case

_DEGREE = 10


class Sizes(NamedTuple):
    """How much of everything."""

    directions: int
    vertices: tuple[int, ...]
    tiled: int  # vertices that are grouped in tiles, and repeated up to the others
    polygon_points: int
    picture: int  # rows
    suns: int
    exact_suns: int
    bake_vertices: int
    bake_directions: int
    copied: int  # numbers
    side: int  # of a square matrix


FULL = Sizes(
    directions=10**6,
    vertices=(50_000, 5_000_000),
    tiled=50_000,
    polygon_points=50_000,
    picture=1024,
    suns=100_000,
    exact_suns=1000,
    bake_vertices=50_000,
    bake_directions=2048,
    copied=2**28,
    side=8192,
)
TINY = Sizes(
    directions=200,
    vertices=(300,),
    tiled=100,
    polygon_points=20,
    picture=32,
    suns=20,
    exact_suns=2,
    bake_vertices=300,
    bake_directions=16,
    copied=2**16,
    side=64,
)


def cases(sizes: Sizes) -> Iterator[Callable[[], list[Case]]]:
    """Groups of cases, each made when its turn comes, the most wanted first."""
    yield functools.partial(_basis, sizes.directions)
    for vertices in sizes.vertices:
        yield functools.partial(_gpu_frames.shading, vertices)
        yield functools.partial(_gpu_frames.samples, vertices)
        yield functools.partial(_gpu_frames.tiles, vertices, sizes.tiled)
    yield functools.partial(_lat_long, sizes.picture)
    yield functools.partial(_polygons, sizes.polygon_points)
    yield functools.partial(_skies, sizes.suns, sizes.exact_suns)
    yield functools.partial(_bake, sizes.bake_vertices, sizes.bake_directions)


def _basis(count: int) -> list[Case]:
    vectors = jnp.asarray(sphere.fibonacci(count).directions.astype(np.float32))
    found = []
    for degree in (10, 6, 3):
        width = harmonics.num_coefficients(degree)
        values = functools.partial(harmonics.evaluate, degree=degree, axis=0)
        with_gradient = functools.partial(harmonics.evaluate_with_gradient, degree=degree, axis=0)

        cotangent = jnp.ones((width, count), jnp.float32)
        size, own = 4.0 * width * count, 12.0 * count
        goal = 0.6 if degree == 10 else None
        common = {"items": count, "unit": "directions"}
        found += [
            Case(
                f"evaluate, degree {degree}",
                values,
                (vectors,),
                traffic=size + own,
                limit="write",
                goal=goal,
                **common,
            ),
            Case(
                f"evaluate_with_gradient, degree {degree}",
                with_gradient,
                (vectors,),
                traffic=4 * size + own,
                limit="write",
                **common,
            ),
            Case(
                f"reverse mode of evaluate, degree {degree}",
                _reverse(values),
                (vectors, cotangent),
                traffic=size + 2 * own,
                limit="read",
                **common,
            ),
        ]
    return found + _sphericart(vectors)


def _reverse(function: Callable[..., Any]) -> Callable[..., Any]:
    def reverse(vectors, cotangent):
        return jax.vjp(function, vectors)[1](cotangent)[0]

    return reverse


def _sphericart(vectors) -> list[Case]:
    """Its kernels beside, where they are installed; the layout is its own, (N, K)."""
    try:
        import sphericart.jax
    except ImportError:
        return []
    count = len(vectors)
    found = []
    for degree in (10, 6, 3):
        width = harmonics.num_coefficients(degree)

        def values(vectors, degree=degree):
            return sphericart.jax.spherical_harmonics(vectors, degree)

        cotangent = jnp.ones((count, width), jnp.float32)
        size, own = 4.0 * width * count, 12.0 * count
        for name, function, arguments, limit in (
            ("values", values, (vectors,), "write"),
            ("reverse mode", _reverse(values), (vectors, cotangent), "read"),
        ):
            title = f"sphericart: {name}, degree {degree}"
            traffic = size + own * len(arguments)
            found.append(Case(title, function, arguments, count, "directions", traffic, limit))
    return found


def _lat_long(rows: int) -> list[Case]:
    image = jnp.ones((rows, 2 * rows, 3), jnp.float32)
    project = functools.partial(sphere.project_lat_long, degree=_DEGREE)
    orders, along = 2 * _DEGREE + 1, 6.0 * rows * 2 * rows
    return [
        Case(
            f"project_lat_long, {2 * rows} x {rows}, degree {_DEGREE}",
            project,
            (image,),
            items=image.size,
            unit="numbers",
            traffic=4.0 * image.size,
            limit="read",
            operations=along * orders,
        )
    ]


def _polygons(points: int) -> list[Case]:
    corners = jnp.asarray([[1, -1, 2], [-1, -1, 2], [-1, 1, 2], [1, 1, 2]], jnp.float32)
    lamp = midrange.Polygon(corners, jnp.ones(3, jnp.float32))
    where = jnp.asarray(sphere.fibonacci(points).directions.astype(np.float32))
    found = []
    for name, function, outputs in (
        ("polygon_harmonics", midrange.polygon_harmonics, 3),
        ("polygon_harmonics_with_gradient", midrange.polygon_harmonics_with_gradient, 12),
    ):
        call = functools.partial(function, lamp, degree=6)
        traffic = points * (12.0 + 4 * 49 * outputs)
        title = f"{name}, degree 6, {points} points"
        found.append(Case(title, call, (where,), points, "points", traffic, "write"))
    return found


def _skies(fitted: int, exact: int) -> list[Case]:
    found = []
    for name, function, count in (
        ("preetham_harmonics", sky.preetham_harmonics, fitted),
        ("project_preetham", sky.project_preetham, exact),
    ):
        height = np.linspace(0.1, 1.5, count)
        suns = np.stack([np.cos(height), np.zeros(count), np.sin(height)], axis=-1)
        suns = jnp.asarray(suns, jnp.float32)
        call = functools.partial(function, degree=6)
        haze = jnp.full(count, 3.0, jnp.float32)
        traffic = count * (16.0 + 12 * 49)
        title = f"{name}, degree 6, {count} suns"
        found.append(Case(title, call, (suns, haze), count, "suns", traffic, "write"))
    return found


def _bake(vertices: int, directions: int) -> list[Case]:
    mesh = geometry.knot(vertices)
    there = {"scene": geometry.JaxRayScene(mesh), "device": True}  # its tree is built by the host
    # The rays that leave a vertex are half of the directions, those above its horizon.
    rays = directions / 2 * len(mesh.vertices)
    return [
        Case(
            f"bake, degree 6, {directions} directions, {len(mesh.vertices)} vertices",
            functools.partial(
                transfer.bake, mesh, 6, directions=directions, progress=False, **there
            ),
            (),
            items=rays,
            unit="rays",
            traffic=None,
            compiled=False,
        )
    ]
