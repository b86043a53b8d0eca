"""The cases of `python -m benchmarks.gpu`, with the bytes and operations that none can avoid."""

import functools
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from jaxsh import adaptive, geometry, harmonics, midrange, sky, sphere, transfer

_DEGREE = 10
_SWITCH = {"float32": None, "tf32": "tensorfloat32"}
_EYE = np.array([0.0, -3.0, 1.0], np.float32)


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


class Case(NamedTuple):
    """A function to compile, its arguments, and what one call of it comes to.

    `traffic` are the bytes of arguments and results, read or written once; `operations` those of
    its matrix products, None where it has none to speak of: then XLA's count stands beside. `limit`
    names what it is measured against, `goal` the share of that to be reached on an H200.
    """

    name: str
    function: Callable[..., Any]
    arguments: tuple
    items: float
    unit: str
    traffic: float | None
    limit: str = "copy"
    operations: float | None = None
    goal: float | None = None
    precision: str = "float32"
    compiled: bool = True

    @property
    def switch(self) -> str | None:
        """The value of `jax.default_matmul_precision` that it runs under."""
        return _SWITCH[self.precision]


def cases(sizes: Sizes) -> Iterator[Callable[[], list[Case]]]:
    """Groups of cases, each made when its turn comes, the most wanted first."""
    yield functools.partial(_basis, sizes.directions)
    for vertices in sizes.vertices:
        yield functools.partial(_shading, vertices)
        yield functools.partial(_samples, vertices)
        yield functools.partial(_tiles, vertices, sizes.tiled)
    yield functools.partial(_lat_long, sizes.picture)
    yield functools.partial(_polygons, sizes.polygon_points)
    yield functools.partial(_skies, sizes.suns, sizes.exact_suns)
    yield functools.partial(_bake, sizes.bake_vertices, sizes.bake_directions)


def _basis(count: int) -> list[Case]:
    vectors = sphere.fibonacci(count).directions.astype(np.float32)
    vectors = jnp.asarray(vectors)
    found = []
    for degree in (10, 6, 3):
        width = harmonics.num_coefficients(degree)
        values = functools.partial(harmonics.evaluate, degree=degree, axis=0)
        with_gradient = functools.partial(harmonics.evaluate_with_gradient, degree=degree, axis=0)

        def reverse(vectors, cotangent, values=values):
            return jax.vjp(values, vectors)[1](cotangent)[0]

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
                reverse,
                (vectors, cotangent),
                traffic=size + 2 * own,
                limit="read",
                **common,
            ),
        ]
    return found + _sphericart(vectors)


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

        def reverse(vectors, cotangent, values=values):
            return jax.vjp(values, vectors)[1](cotangent)[0]

        cotangent = jnp.ones((count, width), jnp.float32)
        size, own = 4.0 * width * count, 12.0 * count
        for name, function, arguments, limit in (
            ("values", values, (vectors,), "write"),
            ("reverse mode", reverse, (vectors, cotangent), "read"),
        ):
            title = f"sphericart: {name}, degree {degree}"
            traffic = size + own * len(arguments)
            found.append(Case(title, function, arguments, count, "directions", traffic, limit))
    return found


@functools.cache
def _made(vertices: int) -> transfer.Transfer:
    """Transfer of points on a sphere: shading takes as long whatever the numbers are."""
    points = jnp.asarray(sphere.fibonacci(vertices).directions.astype(np.float32))
    return transfer.unshadowed(points, points, _DEGREE)


def _light() -> jax.Array:
    width = harmonics.num_coefficients(_DEGREE)
    return jnp.asarray(np.random.default_rng(0).normal(size=(3, width)), jnp.float32)


def _shading(vertices: int) -> list[Case]:
    _made.cache_clear()  # one mesh at a time
    made, light = _made(vertices), _light()
    width = made.coefficients.shape[1]
    table, colors, own = 4.0 * vertices * width, 12.0 * vertices, 24.0 * vertices
    mirror = transfer.Material(np.float32(0.5), np.float32(0.5), np.float32(32))
    eye, codes = jnp.asarray(_EYE), transfer.quantize(made)
    nodes = jax.eval_shape(functools.partial(transfer.sample, degree=_DEGREE), made).samples
    summed = 2.0 * nodes.shape[0] * nodes.shape[1] * vertices  # of one row of a product
    common = {"items": vertices, "unit": "vertices"}
    found = []
    for precision in _SWITCH:
        common |= {"precision": precision}
        found += [
            Case(
                f"shade_diffuse, {vertices} vertices",
                transfer.shade_diffuse,
                (light, made, np.float32(0.5)),
                traffic=table + colors,
                limit="read",
                operations=6.0 * width * vertices,
                goal=0.7 if precision == "float32" else None,
                **common,
            ),
            Case(
                f"shade_diffuse, eight bits, {vertices} vertices",
                transfer.shade_diffuse,
                (light, codes, np.float32(0.5)),
                traffic=table / 4 + colors,
                limit="read",
                operations=6.0 * width * vertices,
                **common,
            ),
            Case(
                f"shade_glossy, {vertices} vertices",
                transfer.shade_glossy,
                (light, made, eye, mirror),
                traffic=table + colors + own,
                limit=precision,
                operations=summed * (width + 3) + 6.0 * width * vertices,
                goal=0.4,
                **common,
            ),
        ]
    return found


def _samples(vertices: int) -> list[Case]:
    """Glossy shading of sampled transfer, which takes three times the memory."""
    made, light = transfer.sample(_made(vertices)), _light()
    mirror = transfer.Material(np.float32(0.5), np.float32(0.5), np.float32(32))
    passes, nodes, _ = made.samples.shape
    width = made.coefficients.shape[1]
    return [
        Case(
            f"shade_glossy of samples, {vertices} vertices",
            transfer.shade_glossy,
            (light, made, jnp.asarray(_EYE), mirror),
            items=vertices,
            unit="vertices",
            # Samples, coefficients, colors, and position and normal.
            traffic=4.0 * vertices * (passes * nodes + width + 3 + 6),
            limit="read",
            operations=6.0 * (passes * nodes + width) * vertices,
        )
    ]


def _tiles(vertices: int, part: int) -> list[Case]:
    """Tiles of a part of the mesh, repeated: how they are chosen costs no time in a frame."""
    copies = max(1, vertices // part)
    part = vertices // copies
    whole = _made(vertices)
    vertices = copies * part
    first, made = (
        transfer.Transfer(*(leaf[:count] for leaf in jax.tree.leaves(whole)))
        for count in (part, vertices)
    )
    small = adaptive.make_tiles(first, _EYE)
    places = small.tiling.permutation.size
    which = np.arange(copies, dtype=np.int32)

    def again(array, axis=0):
        return jnp.concatenate([array] * copies, axis)

    def renumbered(array, step):
        moved = jnp.asarray(step * which).reshape(-1, *[1] * array.ndim) + array[None]
        return moved.reshape(-1, *array.shape[1:])

    tiles = eqx.tree_at(
        lambda t: (
            *(t.tiling.permutation, t.tiling.tile, t.place, t.samples, t.scales),
            *(t.positions, t.normals, t.diffuse),
        ),
        small,
        (
            renumbered(small.tiling.permutation, part),
            again(small.tiling.tile),
            renumbered(small.place, places),
            again(small.samples),
            again(small.scales),
            again(small.positions, 1),
            again(small.normals, 1),
            transfer.quantize(made),
        ),
    )
    mirror = transfer.Material(np.float32(0.5), np.float32(0.5), np.float32(32))
    directions, width = small.samples.shape[1], made.coefficients.shape[1]
    return [
        Case(
            f"tiles, {vertices} vertices",
            lambda tiles, *frame: tiles(*frame).color,
            (tiles, _light(), jnp.asarray(_EYE), mirror),
            items=vertices,
            unit="vertices",
            # Samples, diffuse part, place, colors, and position and normal.
            traffic=vertices * (directions + width + 4.0 + 12.0 + 24.0),
            limit="read",
            operations=6.0 * (directions + width) * vertices,
        )
    ]


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
