"""Frames among the cases of `python -m benchmarks.gpu`: diffuse, glossy, of samples, in tiles."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from jaxsh import adaptive, harmonics, sphere, transfer

from ._gpu_case import SWITCH, Case

_DEGREE = 10


@functools.cache
def _made(vertices: int) -> transfer.Transfer:
    """Transfer of points on a sphere: shading takes as long whatever the numbers are."""
    points = jnp.asarray(sphere.fibonacci(vertices).directions.astype(np.float32))
    return transfer.unshadowed(points, points, _DEGREE)


def _frame() -> tuple[jax.Array, jax.Array, transfer.Material]:
    """Light, eye and material."""
    width = harmonics.num_coefficients(_DEGREE)
    light = jnp.asarray(np.random.default_rng(0).normal(size=(3, width)), jnp.float32)
    eye = jnp.asarray([0.0, -3.0, 1.0], jnp.float32)
    return light, eye, transfer.Material(np.float32(0.5), np.float32(0.5), np.float32(32))


def shading(vertices: int) -> list[Case]:
    """Diffuse and glossy frames from coefficients, in full and in TF32."""
    _made.cache_clear()  # one mesh at a time
    made, (light, eye, material) = _made(vertices), _frame()
    codes = transfer.quantize(made)
    width = made.coefficients.shape[1]
    table, colors, own = 4.0 * vertices * width, 12.0 * vertices, 24.0 * vertices
    nodes = jax.eval_shape(functools.partial(transfer.sample, degree=_DEGREE), made).samples
    summed = 2.0 * nodes.shape[0] * nodes.shape[1] * vertices  # of one row of a product
    common = {"items": vertices, "unit": "vertices"}
    found = []
    for precision in SWITCH:
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
                (light, made, eye, material),
                traffic=table + colors + own,
                limit=precision,
                operations=summed * (width + 3) + 6.0 * width * vertices,
                goal=0.4,
                **common,
            ),
        ]
    return found


def samples(vertices: int) -> list[Case]:
    """Glossy shading of sampled transfer, which takes three times the memory."""
    made, (light, eye, material) = transfer.sample(_made(vertices)), _frame()
    passes, nodes, _ = made.samples.shape
    width = made.coefficients.shape[1]
    return [
        Case(
            f"shade_glossy of samples, {vertices} vertices",
            transfer.shade_glossy,
            (light, made, eye, material),
            items=vertices,
            unit="vertices",
            # Samples, coefficients, colors, and position and normal.
            traffic=4.0 * vertices * (passes * nodes + width + 3 + 6),
            limit="read",
            operations=6.0 * (passes * nodes + width) * vertices,
        )
    ]


def tiles(vertices: int, part: int) -> list[Case]:
    """Tiles of a part of the mesh, repeated: how they are chosen costs no time in a frame."""
    copies = max(1, vertices // part)
    part = vertices // copies
    whole = _made(vertices)
    vertices = copies * part
    first, made = (
        transfer.Transfer(*(leaf[:count] for leaf in jax.tree.leaves(whole)))
        for count in (part, vertices)
    )
    frame = _frame()
    small = adaptive.make_tiles(first, frame[1])
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
    directions, width = small.samples.shape[1], made.coefficients.shape[1]
    return [
        Case(
            f"tiles, {vertices} vertices",
            lambda tiles, *frame: tiles(*frame).color,
            (tiles, *frame),
            items=vertices,
            unit="vertices",
            # Samples, diffuse part, place, colors, and position and normal.
            traffic=vertices * (directions + width + 4.0 + 12.0 + 24.0),
            limit="read",
            operations=6.0 * (directions + width) * vertices,
        )
    ]
