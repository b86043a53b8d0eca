import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsh import harmonics, sphere, transfer
from jaxsh.adaptive import _tile_frames, _tile_kernel, _tiles
from jaxsh.adaptive._tile_atlas import TileFollower, make_tile_atlas
from jaxsh.adaptive._tile_sets import Tiling, arrange, make_tiles, make_tiling
from jaxsh.adaptive._tiles import shade_tiles

COUNT, DEGREE = 300, 3
WIDTH = (DEGREE + 1) ** 2
EYE = np.array([0.5, -3.0, 1.0])


def cast(tree, dtype):
    return jax.tree.map(lambda x: x.astype(dtype) if eqx.is_inexact_array(x) else x, tree)


@pytest.fixture
def ball(rng) -> transfer.Transfer:
    """A sphere with shadows that differ from vertex to vertex."""
    normals = sphere.fibonacci(COUNT).directions
    cosine = harmonics.clamped_cosine(DEGREE)[harmonics.degrees(DEGREE)]
    open_sky = harmonics.evaluate(normals, DEGREE) * cosine[None]
    shadows = rng.normal(size=(COUNT, WIDTH)) * 0.05
    ring = (np.arange(COUNT)[:, None] + np.array([-1, 1])) % COUNT
    return transfer.Transfer(open_sky + shadows, normals, normals, jnp.asarray(ring, jnp.int32))


@pytest.fixture
def light(rng):
    falloff = 1 / (1 + harmonics.degrees(DEGREE)) ** 2
    return jnp.asarray(rng.normal(size=(3, WIDTH)) * falloff)


MATERIAL = transfer.Material(jnp.asarray(0.5), jnp.asarray([0.5, 0.3, 0.1]), jnp.asarray(8.0))


@pytest.mark.parametrize(
    ("dtype", "tolerance"), [(jnp.float32, 1e-5), (jnp.float64, 1e-11)], ids=["float32", "float64"]
)
def test_tiles_of_one_direction_are_exact(ball, light, dtype, tolerance):
    ball, light, material = cast((ball, light, MATERIAL), dtype)
    eye = jnp.asarray(EYE, dtype)
    tiles = make_tiles(ball, eye, count=COUNT, block=1)
    result = shade_tiles(light, ball, eye, material, tiles)
    assert result.color.dtype == dtype
    full = transfer.shade_glossy(light, ball, eye, material)
    np.testing.assert_allclose(result.color, full, atol=tolerance)


def test_tiles_with_albedos_per_vertex(ball, light, rng):
    albedos = [jnp.asarray(rng.uniform(size=(COUNT, channels))) for channels in (3, 1)]
    material = transfer.Material(*albedos, jnp.asarray(8.0))
    tiles = make_tiles(ball, EYE, distant=True, count=COUNT, block=1)
    result = shade_tiles(light, ball, EYE, material, tiles, distant=True, normalized=False)
    full = transfer.shade_glossy(light, ball, EYE, material, distant=True, normalized=False)
    np.testing.assert_allclose(result.color, full, atol=1e-11)


def test_bands_0_and_2_are_exact_in_one_tile(ball, light):
    """The monomials span them, so one tile over the whole sphere is enough."""
    tiles = make_tiles(ball, EYE, count=1, block=COUNT)
    axis = ball.normals.T[:, tiles.tiling.order]
    frames = _tile_frames.tile_frames(axis, axis, tiles.areas, tiles.tiling.tile, 1)
    lobe = jnp.asarray([0.7, 0.0, 0.4, 0.0])
    terms = _tiles._terms(light, frames, lobe, jnp.asarray(0.5), jnp.asarray(0.2))
    phi = _tile_frames.monomials(axis, frames, tiles.tiling.tile)
    color = _tile_kernel.polynomial_products(terms, tiles.coefficients, phi)[0].T

    received = ball.coefficients @ harmonics.product_matrix(light)  # (3, V, K)
    lobes = harmonics.convolve(harmonics.evaluate(ball.normals, DEGREE), lobe)
    glossy = np.sum(received * lobes[None], axis=-1).T
    full = 0.5 * glossy + 0.2 / np.pi * ball.coefficients @ light.T
    np.testing.assert_allclose(color, full[tiles.tiling.order[0]], atol=1e-12)


def test_error_falls_with_the_third_power_of_the_width(ball, light):
    material = transfer.Material(jnp.asarray(0.0), jnp.asarray(1.0), jnp.asarray(8.0))
    full = transfer.shade_glossy(light, ball, EYE, material)
    errors = []
    for count in (6, 24):
        tiles = make_tiles(ball, EYE, count=count, block=1)
        color = shade_tiles(light, ball, EYE, material, tiles).color
        errors.append(np.sqrt(np.mean((color - full) ** 2)))
    # A quarter of the area is half of the width.
    assert errors[1] < errors[0] / 4
    assert errors[1] < 0.06 * np.std(full)


def test_frames_reuse_compiled_code(ball, light):
    eyes = [EYE, -EYE]
    tiles = [make_tiles(ball, eye, count=8, block=16) for eye in eyes]
    shade_tiles(light, ball, EYE, MATERIAL, tiles[0])
    before = _tiles._shade_tiles._cache_size()
    for eye, tile_set in zip(eyes, reversed(tiles), strict=True):
        shade_tiles(-light, ball, eye, MATERIAL, tile_set)
    assert _tiles._shade_tiles._cache_size() == before


def test_tiles_differentiate_as_the_full_computation(ball, light, rng):
    tiles = make_tiles(ball, EYE, count=COUNT, block=1)
    weights = jnp.asarray(rng.normal(size=(COUNT, 3)))

    def loss(shade):
        return lambda light, material: jnp.sum(weights * shade(light, material))

    def by_tiles(light, material):
        return shade_tiles(light, ball, EYE, material, tiles).color

    def in_full(light, material):
        return transfer.shade_glossy(light, ball, EYE, material)

    ours, theirs = (
        jax.grad(loss(shade), argnums=(0, 1))(light, MATERIAL) for shade in (by_tiles, in_full)
    )
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-8, atol=1e-9), ours, theirs)
    tangents = jax.tree.map(lambda x: jnp.asarray(rng.normal(size=x.shape)), (light, MATERIAL))
    _, forward = jax.jvp(loss(by_tiles), (light, MATERIAL), tangents)
    backward = jax.tree.reduce(jnp.add, jax.tree.map(lambda a, b: jnp.sum(a * b), ours, tangents))
    np.testing.assert_allclose(forward, backward, rtol=1e-10)


def test_tiles_of_a_batch_of_lights(ball, light):
    tiles = make_tiles(ball, EYE, count=8, block=16)

    def color(light):
        return shade_tiles(light, ball, EYE, MATERIAL, tiles).color

    lights = jnp.stack([light, 2 * light])
    both = jax.vmap(color)(lights)
    np.testing.assert_allclose(both[1], color(lights[1]), atol=1e-12)
    np.testing.assert_allclose(both[1], 2 * both[0], atol=1e-12)


def test_written_out_products_are_the_matrix_products(rng):
    shapes = (3, 6, 3, 9), (3, 9, 8), (3, 6, 8)
    terms, columns, phi = (jnp.asarray(rng.uniform(-1, 1, size=shape)) for shape in shapes)
    expected = np.einsum("ntck,nkb,ntb->ncb", terms, columns, phi)
    for form in (_tile_kernel._written_out, _tile_kernel._as_matrices):
        np.testing.assert_allclose(form(terms, columns, phi), expected, atol=1e-13)


@pytest.mark.parametrize(("count", "block"), [(7, 16), (1, 8), (1000, 7)])
def test_tiling_holds_each_vertex(ball, count, block):
    tiles = make_tiles(ball, EYE, count=count, block=block)
    order, tile = np.asarray(tiles.tiling.order), np.asarray(tiles.tiling.tile)
    blocks = -(-COUNT // block)
    assert order.shape == (blocks, block)
    assert tiles.tiling.count == min(count, blocks)
    np.testing.assert_array_equal(np.unique(tile), np.arange(tiles.tiling.count))
    np.testing.assert_array_equal(order.ravel()[tiles.place], np.arange(COUNT))
    np.testing.assert_array_equal(tiles.coefficients[1:, 3], ball.coefficients[order[1:], 3])
    assert np.count_nonzero(tiles.areas) == COUNT


def test_atlas_takes_the_nearest_view(ball):
    atlas = make_tile_atlas(ball, distance=3.0, views=5, count=4, block=32)
    for view in (0, 3):
        eye = atlas.centre + 2.5 * atlas.directions[view]
        assert atlas.view(eye) == view
    eye = atlas.centre + 3.0 * atlas.directions[3]
    expected = make_tiling(ball, eye, count=4, block=32)
    np.testing.assert_array_equal(atlas.nearest(ball, eye).tiling.order, expected.order)


def test_follower_arrives_at_the_nearest_view(ball):
    atlas = make_tile_atlas(ball, views=6, count=4, block=32)
    follow = TileFollower(atlas, ball, atlas.directions[0])
    for eye in atlas.directions:
        jax.block_until_ready(follow(eye))
    jax.block_until_ready(follow._next)
    arrived = follow(atlas.directions[-1])
    np.testing.assert_array_equal(arrived.tiling.order, atlas.order[-1])


def test_tiles_refuse_what_does_not_fit(ball, light, unchecked):
    tiles = make_tiles(ball, EYE, count=4, block=32)
    per_vertex = transfer.Material(jnp.asarray(0.5), jnp.asarray(0.5), jnp.full((COUNT,), 8.0))
    with pytest.raises(ValueError, match="one exponent"):
        shade_tiles(light, ball, EYE, per_vertex, tiles)
    with pytest.raises(ValueError, match="one light"):
        shade_tiles(light[None, None], ball, EYE, MATERIAL, tiles)
    other = make_tiles(jax.tree.map(lambda x: x[:100] % 100, ball), EYE, count=2, block=32)
    with pytest.raises(ValueError, match="expected tiles of 300"):
        shade_tiles(light, ball, EYE, MATERIAL, other)
    with pytest.raises(ValueError, match="expected a tiling of 300"):
        arrange(ball, Tiling(other.tiling.order, other.tiling.tile, 2))
    with pytest.raises(ValueError, match="at least 1"):
        make_tiles(ball, EYE, count=0)
    with pytest.raises(ValueError, match="eye"):
        make_tiles(ball, EYE[:2])
    with pytest.raises(ValueError, match="at least 1 view"):
        make_tile_atlas(ball, views=0)
