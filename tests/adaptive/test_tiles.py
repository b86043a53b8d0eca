import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from balls import COUNT, DEGREE, WIDTH, shadowed_ball

from jaxsh import harmonics, sphere, transfer
from jaxsh.adaptive import (
    TileFollower,
    Tiles,
    Tiling,
    _local_rule,
    _tile_samples,
    _tile_set,
    arrange,
    make_tile_atlas,
    make_tiles,
    shade,
)

EYE = np.array([0.5, -3.0, 1.0])


def cast(tree, dtype):
    return jax.tree.map(lambda x: x.astype(dtype) if eqx.is_inexact_array(x) else x, tree)


@pytest.fixture
def ball(rng) -> transfer.Transfer:
    return shadowed_ball(rng)


@pytest.fixture
def light(rng):
    falloff = 1 / (1 + harmonics.degrees(DEGREE)) ** 2
    return jnp.asarray(rng.normal(size=(3, WIDTH)) * falloff)


MATERIAL = transfer.Material(jnp.asarray(0.5), jnp.asarray([0.5, 0.3, 0.1]), jnp.asarray(8.0))


@pytest.mark.parametrize(
    ("dtype", "tolerance"),
    [pytest.param(jnp.float32, 6e-7, marks=pytest.mark.slow), (jnp.float64, 3e-7)],
    ids=["float32", "float64"],
)
def test_tiles_of_one_vertex_with_all_numbers_are_nearly_exact(ball, light, dtype, tolerance):
    """What is left is the rule's polynomials of where the lobe points."""
    ball, light, material = cast((ball, light, MATERIAL), dtype)
    eye = jnp.asarray(EYE, dtype)
    tiles = make_tiles(
        ball, eye, num_tiles=COUNT, block=1, components=16, exponent=8.0, quantized=False
    )
    assert tiles.samples.shape == (COUNT, 16, 1)
    result = tiles(light, eye, material)
    assert result.color.dtype == dtype
    full = transfer.shade_glossy(light, ball, eye, material)
    np.testing.assert_allclose(result.color, full, rtol=0, atol=tolerance)


def test_a_frame_is_the_rule_as_it_is_written(rng):
    """Tile by tile by hand, for two eyes: polynomials about the middle by least squares."""
    exponent, count = 16.0, 70
    normals = sphere.fibonacci(count).directions.at[3].set(jnp.nan)
    rows = jnp.asarray(rng.normal(size=(count, 25)))
    made = transfer.Transfer(rows, jnp.nan_to_num(normals), normals, jnp.zeros((count, 1), int))
    made = eqx.tree_at(lambda t: t.neighbors, made, made.neighbors.astype(jnp.int32))
    light, material = jnp.asarray(rng.normal(size=(3, 25))), transfer.Material(0.0, 1.0, exponent)
    tiles = make_tiles(
        made, EYE, num_tiles=3, block=16, components=12, exponent=exponent, quantized=False
    )
    eyes = jnp.asarray([EYE, EYE + 0.2])
    ours = np.asarray(jax.vmap(lambda eye: tiles(light, eye, material).color)(eyes))
    core = np.tensordot(harmonics.phong(exponent, 4, normalized=True), tiles.core, 1)
    degree = _local_rule.degree_of_monomials(tiles.functions.shape[1])
    order, reach = np.asarray(tiles.tiling.permutation), float(tiles.reach)
    for eye, got in zip(eyes, ours, strict=True):
        axis = np.asarray(transfer.reflected_direction(eye, made.positions, made.normals))
        facing = np.sum(np.nan_to_num(normals) * axis, axis=1)
        for tile, turn in enumerate(np.asarray(_tile_samples.turns(tiles.tiling.axes))):
            blocks = np.flatnonzero(np.asarray(tiles.tiling.tile) == tile)
            members = order[blocks].ravel()
            at = (axis[members] @ turn)[:, :2]
            share = np.maximum(facing[members], 0) + 0.05
            middle = share @ at / share.sum()
            width = np.sqrt(2 * share @ np.sum((at - middle) ** 2, axis=1) / share.sum())
            points = _local_rule.disc(9)
            there = middle + width * points
            there /= np.maximum(np.linalg.norm(there, axis=1), reach)[:, None]
            values = tiles.functions @ np.stack(_local_rule.monomials(*there.T, degree))
            weights = np.einsum("gp,mgn->pmn", values, core)
            fit = np.linalg.lstsq(quadratic(points), weights.reshape(9, -1), rcond=None)[0]
            there = (quadratic((at - middle) / width) @ fit).reshape(len(at), *weights.shape[1:])
            lights = np.asarray(light) @ np.asarray(tiles.lights)[:, tile]
            samples = np.moveaxis(np.asarray(tiles.samples)[blocks], 1, 2).reshape(len(at), -1)
            expected = np.einsum("cm,vmn,vn->vc", lights, there, samples)
            np.testing.assert_allclose(got[members], expected, rtol=0, atol=1e-14 * abs(ours).max())


def quadratic(points):
    x, y = points.T
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1)


def test_tiles_with_albedos_per_vertex(ball, light, rng):
    albedos = [jnp.asarray(rng.uniform(size=(COUNT, channels))) for channels in (3, 1)]
    tiles = make_tiles(ball, EYE, distant=True, num_tiles=5, block=16, quantized=False)

    def color(diffuse, specular):
        material = transfer.Material(diffuse, specular, jnp.asarray(8.0))
        return tiles(light, EYE, material, distant=True, normalized=False).color

    one, none = jnp.ones(()), jnp.zeros(())
    expected = albedos[0] * color(one, none) + albedos[1] * color(none, one)
    np.testing.assert_allclose(color(*albedos), expected, rtol=0, atol=1e-14)


@pytest.mark.slow
def test_error_falls_with_the_numbers_and_with_the_tiles(ball, light):
    material = transfer.Material(jnp.asarray(0.0), jnp.asarray(1.0), jnp.asarray(8.0))
    full = transfer.shade_glossy(light, ball, EYE, material)
    errors = []
    for components, tiles in ((4, 300), (8, 300), (16, 300), (16, 75)):
        made = make_tiles(ball, EYE, num_tiles=tiles, block=1, components=components, exponent=8.0)
        color = made(light, EYE, material).color
        errors.append(np.sqrt(np.mean((color - full) ** 2)) / np.std(full))
    assert errors[0] > 2 * errors[1] > 4 * errors[2]
    assert errors[2] < 9e-6
    assert errors[2] < errors[3] < 0.02


def test_tiles_of_another_view_are_less_exact_and_no_more(ball, light):
    """Beyond the rule's reach its polynomials must not run away."""
    material = transfer.Material(jnp.asarray(0.0), jnp.asarray(1.0), jnp.asarray(8.0))
    tiles = make_tiles(ball, EYE, num_tiles=24, block=1, components=16, exponent=8.0)
    for eye in (-EYE, EYE[::-1]):
        full = transfer.shade_glossy(light, ball, eye, material)
        color = tiles(light, eye, material).color
        assert np.sqrt(np.mean((color - full) ** 2)) < 1.5 * np.std(full)


def test_quantized_samples_are_half_a_scale_off(ball, light):
    plain, rounded = (
        make_tiles(ball, EYE, num_tiles=5, block=16, quantized=q) for q in (False, True)
    )
    assert rounded.samples.dtype == jnp.int8
    scales = np.asarray(rounded.scales)[..., None]
    difference = np.asarray(rounded.samples) * scales - np.asarray(plain.samples)
    assert np.all(np.abs(difference) <= 0.501 * scales)
    colors = [t(light, EYE, MATERIAL).color for t in (plain, rounded)]
    np.testing.assert_allclose(*colors, rtol=0, atol=6e-3 * np.abs(colors[0]).max())


def test_frames_reuse_compiled_code(ball, light):
    eyes = [EYE, -EYE]
    tiles = [make_tiles(ball, eye, num_tiles=8, block=16) for eye in eyes]
    tiles[0](light, EYE, MATERIAL)
    before = _tile_set._shade_tiles._cache_size()
    for eye, tile_set in zip(eyes, reversed(tiles), strict=True):
        tile_set(-light, eye, MATERIAL)
    assert _tile_set._shade_tiles._cache_size() == before


def test_tiles_differentiate_as_differences_say(ball, light, rng):
    tiles = make_tiles(ball, EYE, num_tiles=5, block=16, quantized=False)
    weights = jnp.asarray(rng.normal(size=(COUNT, 3)))

    @jax.jit
    def loss(frame):
        light, material, eye = frame
        return jnp.sum(weights * tiles(light, eye, material).color)

    frame = light, MATERIAL, jnp.asarray(EYE)
    tangents = jax.tree.map(lambda x: jnp.asarray(rng.normal(size=x.shape)), frame)
    step = 1e-5

    def along(t):
        return loss(jax.tree.map(lambda x, tangent: x + t * tangent, frame, tangents))

    expected = (along(step) - along(-step)) / (2 * step)
    _, forward = jax.jvp(loss, (frame,), (tangents,))
    np.testing.assert_allclose(forward, expected, rtol=1e-9)
    gradient = jax.grad(loss)(frame)
    backward = sum(jax.tree.leaves(jax.tree.map(lambda a, b: jnp.sum(a * b), gradient, tangents)))
    np.testing.assert_allclose(forward, backward, rtol=1e-12)


def test_tiles_of_a_batch_of_lights(ball, light):
    tiles = make_tiles(ball, EYE, num_tiles=8, block=16)

    def color(light):
        return tiles(light, EYE, MATERIAL).color

    lights = jnp.stack([light, 2 * light])
    both = jax.vmap(color)(lights)
    np.testing.assert_allclose(both[1], color(lights[1]), rtol=0, atol=1e-12)
    np.testing.assert_allclose(both[1], 2 * both[0], rtol=0, atol=1e-12)


@pytest.mark.parametrize(("count", "block"), [(7, 16), (1, 8), (1000, 7)])
def test_tiling_holds_each_vertex(ball, count, block):
    tiles = make_tiles(ball, EYE, num_tiles=count, block=block)
    order, tile = np.asarray(tiles.tiling.permutation), np.asarray(tiles.tiling.tile)
    blocks = -(-COUNT // block)
    assert order.shape == (blocks, block)
    assert len(tiles.tiling.axes) == min(count, blocks)
    np.testing.assert_array_equal(np.unique(tile), np.arange(min(count, blocks)))
    np.testing.assert_array_equal(order.ravel()[tiles.place], np.arange(COUNT))
    np.testing.assert_array_equal(tiles.positions.T, ball.positions[order.ravel()])


def test_tiles_refuse_what_does_not_fit(ball, light, unchecked):
    tiles = make_tiles(ball, EYE, num_tiles=4, block=32)
    per_vertex = transfer.Material(jnp.asarray(0.5), jnp.asarray(0.5), jnp.full((COUNT,), 8.0))
    with pytest.raises(ValueError, match="one exponent"):
        tiles(light, EYE, per_vertex)
    with pytest.raises(ValueError, match="one light"):
        tiles(light[None, None], EYE, MATERIAL)
    other = make_tiles(jax.tree.map(lambda x: x[:100] % 100, ball), EYE, num_tiles=2, block=32)
    with pytest.raises(ValueError, match="expected tiles of 300"):
        shade(light, ball, EYE, MATERIAL, Tiles(other))
    with pytest.raises(ValueError, match="expected a tiling of 300"):
        arrange(ball, Tiling(other.tiling.permutation, other.tiling.tile, other.tiling.axes))
    with pytest.raises(ValueError, match="light of the tiles' degree"):
        tiles(light[:, :9], EYE, MATERIAL)
    twice = Tiling(
        tiles.tiling.permutation.at[0].set(tiles.tiling.permutation[1]),
        tiles.tiling.tile,
        tiles.tiling.axes,
    )
    with pytest.raises(ValueError, match="expected a tiling of 300 vertices, got one of 2"):
        arrange(ball, twice)
    with pytest.raises(ValueError, match="expected a tiling of 100 vertices, got one of 300"):
        arrange(jax.tree.map(lambda x: x[:100] % 100, ball), tiles.tiling)
    for wrong in ({"components": 0}, {"exponent": -1.0}, {"exponent": float("nan")}):
        with pytest.raises(
            ValueError, match=r"components must be an integer >= 1|exponent must be a number > -1"
        ):
            make_tiles(ball, EYE, **wrong)
        with pytest.raises(
            ValueError, match=r"components must be an integer >= 1|exponent must be a number > -1"
        ):
            make_tile_atlas(ball, **wrong)
    with pytest.raises(ValueError, match="a view from 0 to 1, got 2"):
        make_tile_atlas(ball, views=2, num_tiles=2).tiling(2)
    none = transfer.unshadowed(np.zeros((0, 3)), np.zeros((0, 3)), degree=2)
    with pytest.raises(ValueError, match="at least one point"):
        make_tiles(none, EYE)
    with pytest.raises(ValueError, match="num_tiles must be an integer >= 1"):
        make_tiles(ball, EYE, num_tiles=0)
    with pytest.raises(ValueError, match="eye"):
        make_tiles(ball, EYE[:2])
    with pytest.raises(ValueError, match="keep of at least 2"):
        TileFollower(make_tile_atlas(ball, views=1, num_tiles=2), ball, EYE, keep=1)
    with pytest.raises(ValueError, match="views must be an integer >= 1"):
        make_tile_atlas(ball, views=0)


def test_a_method_makes_its_tiles_and_takes_a_diffuse_part(ball, light, unchecked):
    frame = light, ball, EYE, MATERIAL
    given = make_tiles(ball, EYE, num_tiles=5, block=16, exponent=8.0)
    assert isinstance(given.diffuse, transfer.QuantizedTransfer)
    on_the_way = shade(*frame, Tiles(num_tiles=5, block=16))
    np.testing.assert_array_equal(on_the_way.color, given(light, EYE, MATERIAL).color)
    assert make_tiles(ball, EYE, num_tiles=5, block=16, quantized=False).diffuse is ball
    atlas = make_tile_atlas(ball, views=2, num_tiles=4, block=32)
    assert atlas.nearest(ball, EYE, diffuse=ball).diffuse is ball
    for make in (lambda ball: make_tiles(ball, EYE), lambda ball: make_tile_atlas(ball, views=1)):
        with pytest.raises(ValueError, match="looks at the values of its arguments"):
            jax.jit(make)(ball)
    with pytest.raises(ValueError, match="Tiles without a tile set looks at the values"):
        jax.jit(lambda eye: shade(light, ball, eye, MATERIAL, "tiles").color)(jnp.asarray(EYE))
