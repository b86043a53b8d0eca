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
    [pytest.param(jnp.float32, 2e-6, marks=pytest.mark.slow), (jnp.float64, 1e-14)],
    ids=["float32", "float64"],
)
def test_tiles_are_exact_in_exact_directions(ball, light, dtype, tolerance):
    """At degree 3 there are 38, fewer than are taken."""
    ball, light, material = cast((ball, light, MATERIAL), dtype)
    eye = jnp.asarray(EYE, dtype)
    tiles = make_tiles(ball, eye, num_tiles=5, block=16, quantized=False)
    assert tiles.samples.shape[1] == 38
    result = tiles(light, eye, material)
    assert result.color.dtype == dtype
    full = transfer.shade_glossy(light, ball, eye, material)
    np.testing.assert_allclose(result.color, full, rtol=0, atol=tolerance)


@pytest.mark.parametrize(
    ("dtype", "tolerance"),
    [pytest.param(jnp.float32, 2e-6, marks=pytest.mark.slow), (jnp.float64, 4e-14)],
    ids=["float32", "float64"],
)
def test_a_rule_of_few_directions_is_applied_as_it_is_written(rng, dtype, tolerance):
    """Degree 4, 40 of its 74 directions; tile by tile by hand, for two eyes."""
    degree, exponent, count = 4, 16.0, 70
    normals = sphere.fibonacci(count).directions.at[3].set(jnp.nan)
    rows = rng.normal(size=(2, count, 25))
    made = transfer.Transfer(
        jnp.asarray(rows[0]), normals, normals, jnp.zeros((count, 1), jnp.int32)
    )
    made = eqx.tree_at(lambda t: t.positions, made, jnp.nan_to_num(normals))
    light, material = jnp.asarray(rng.normal(size=(3, 25))), transfer.Material(0.0, 1.0, exponent)
    tiles = make_tiles(made, EYE, num_tiles=3, block=16, exponent=exponent, quantized=False)
    eyes = jnp.asarray([EYE, EYE + 0.2])
    cast_ = [cast(x, dtype) for x in (light, made, eyes, material, tiles)]

    def color(eye):
        return cast_[4](cast_[0], eye, cast_[3]).color

    ours = jax.vmap(color)(cast_[2])
    rule = _local_rule.local_rule(degree, 40, exponent)
    lobe = rule.powers @ np.asarray(harmonics.phong(exponent, degree, normalized=True))
    samples = np.asarray(tiles.samples)
    for eye, got in zip(eyes, np.asarray(ours), strict=True):
        axis = np.asarray(transfer.reflected_direction(eye, made.positions, made.normals))
        for tile, pole in enumerate(tiles.tiling.axes):
            at = np.asarray(tiles.directions[tile])
            np.testing.assert_allclose(at @ pole, rule.directions[:, 2], rtol=0, atol=1e-12)
            lights = np.asarray(harmonics.evaluate(at, degree) @ light.T)
            for block in np.flatnonzero(np.asarray(tiles.tiling.tile) == tile):
                members = np.asarray(tiles.tiling.permutation)[block]
                cosines = np.maximum(axis[members] @ at.T, rule.lowest)
                lobes = np.polynomial.polynomial.polyval(cosines - rule.middle, lobe)
                expected = (lobes * samples[block].T) @ lights
                np.testing.assert_allclose(
                    got[members], expected, rtol=0, atol=tolerance * np.abs(ours).max()
                )


def test_tiles_with_albedos_per_vertex(ball, light, rng):
    albedos = [jnp.asarray(rng.uniform(size=(COUNT, channels))) for channels in (3, 1)]
    material = transfer.Material(*albedos, jnp.asarray(8.0))
    tiles = make_tiles(ball, EYE, distant=True, num_tiles=5, block=16, quantized=False)
    result = tiles(light, EYE, material, distant=True, normalized=False)
    full = transfer.shade_glossy(light, ball, EYE, material, distant=True, normalized=False)
    np.testing.assert_allclose(result.color, full, rtol=0, atol=1e-14)


@pytest.mark.slow
def test_error_falls_with_the_directions(ball, light):
    material = transfer.Material(jnp.asarray(0.0), jnp.asarray(1.0), jnp.asarray(8.0))
    full = transfer.shade_glossy(light, ball, EYE, material)
    errors = []
    for directions in (8, 16, 32):
        tiles = make_tiles(ball, EYE, num_tiles=24, block=1, directions=directions, exponent=8.0)
        color = tiles(light, EYE, material).color
        errors.append(np.sqrt(np.mean((color - full) ** 2)) / np.std(full))
    assert errors[0] < 0.12
    assert errors[1] < 0.1
    assert errors[2] < 0.03


@pytest.mark.slow
def test_tiles_of_another_view_are_less_exact_and_no_more(ball, light):
    """The lobe has few terms where its directions are, and must not run away elsewhere."""
    material = transfer.Material(jnp.asarray(0.0), jnp.asarray(1.0), jnp.asarray(8.0))
    tiles = make_tiles(ball, EYE, num_tiles=24, block=1, directions=32, exponent=8.0)
    assert tiles.lowest > -1
    for eye in (-EYE, EYE[::-1]):
        full = transfer.shade_glossy(light, ball, eye, material)
        color = tiles(light, eye, material).color
        assert np.sqrt(np.mean((color - full) ** 2)) < 0.5 * np.std(full)


def test_quantized_samples_are_half_a_scale_off(ball, light):
    plain, rounded = (
        make_tiles(ball, EYE, num_tiles=5, block=16, quantized=q) for q in (False, True)
    )
    assert rounded.samples.dtype == jnp.int8
    scales = np.asarray(rounded.scales)[..., None]
    difference = np.asarray(rounded.samples) * scales - np.asarray(plain.samples)
    assert np.all(np.abs(difference) <= 0.501 * scales)
    colors = [t(light, EYE, MATERIAL).color for t in (plain, rounded)]
    np.testing.assert_allclose(*colors, rtol=0, atol=4e-3 * np.abs(colors[0]).max())


def test_frames_reuse_compiled_code(ball, light):
    eyes = [EYE, -EYE]
    tiles = [make_tiles(ball, eye, num_tiles=8, block=16) for eye in eyes]
    tiles[0](light, EYE, MATERIAL)
    before = _tile_set._shade_tiles._cache_size()
    for eye, tile_set in zip(eyes, reversed(tiles), strict=True):
        tile_set(-light, eye, MATERIAL)
    assert _tile_set._shade_tiles._cache_size() == before


def test_tiles_differentiate_as_the_full_computation(ball, light, rng):
    tiles = make_tiles(ball, EYE, num_tiles=5, block=16, quantized=False)
    weights = jnp.asarray(rng.normal(size=(COUNT, 3)))

    def loss(shade):
        return lambda *frame: jnp.sum(weights * shade(*frame))

    def by_tiles(light, material, eye):
        return tiles(light, eye, material).color

    def in_full(light, material, eye):
        return transfer.shade_glossy(light, ball, eye, material)

    frame = light, MATERIAL, jnp.asarray(EYE)
    ours, theirs = (
        jax.grad(loss(shade), argnums=(0, 1, 2))(*frame) for shade in (by_tiles, in_full)
    )
    jax.tree.map(
        lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-11, atol=1e-11), ours, theirs
    )
    tangents = jax.tree.map(lambda x: jnp.asarray(rng.normal(size=x.shape)), frame)
    _, forward = jax.jvp(loss(by_tiles), frame, tangents)
    backward = jax.tree.reduce(jnp.add, jax.tree.map(lambda a, b: jnp.sum(a * b), ours, tangents))
    np.testing.assert_allclose(forward, backward, rtol=1e-10)


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
    for wrong in ({"directions": 0}, {"exponent": -1.0}, {"exponent": float("nan")}):
        with pytest.raises(
            ValueError, match=r"directions must be an integer >= 1|exponent must be a number > -1"
        ):
            make_tiles(ball, EYE, **wrong)
        with pytest.raises(
            ValueError, match=r"directions must be an integer >= 1|exponent must be a number > -1"
        ):
            make_tile_atlas(ball, **wrong)
    with pytest.raises(ValueError, match="a view from 0 to 1, got 2"):
        make_tile_atlas(ball, views=2, num_tiles=2).tiling(2)
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
