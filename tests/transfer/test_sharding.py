"""Shading on a mesh of devices, sharded over the vertices."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from sharding import ROWS, WHOLE, P, check_sharded

from jaxsh._core import xla
from jaxsh.geometry import Mesh
from jaxsh.sphere import Suns
from jaxsh.transfer import (
    Material,
    QuantizedTransfer,
    SunVisibility,
    Transfer,
    compress,
    fixed_light,
    fixed_view,
    fluence,
    quantize,
    reflected_direction,
    sample,
    shade_diffuse,
    shade_glossy,
    shade_sun,
    unshadowed,
)

V, DEGREE, K = 16, 1, 4
COLUMNS, LAST = P(None, "rows"), P(None, None, "rows")
SAMPLED = LAST, ROWS, COLUMNS, COLUMNS
QUANTIZED = LAST, WHOLE
STILL = P(None, None, None, "rows"), ROWS, COLUMNS, COLUMNS
EYE = np.array([0.3, -2.0, 1.5], np.float32)


def specs_of(prepared, specs):
    """Specs in the place of a prepared object's arrays."""
    return jax.tree.unflatten(jax.tree.structure(prepared), specs)


@pytest.fixture
def frame(rng):
    """Light, transfer, eye and a material with all its arrays per vertex, in float32."""

    def array(*shape):
        return jnp.asarray(rng.uniform(0.1, 1, size=shape), np.float32)

    normals = jnp.asarray(rng.normal(size=(V, 3)), np.float32)
    made = Transfer(
        array(V, K),
        jnp.asarray(rng.normal(size=(V, 3)), np.float32),
        normals,
        jnp.zeros((V, 1), np.int32),
    )
    material = Material(array(V, 3), array(V, 1), 10 * array(V))
    return array(3, K), made, jnp.asarray(EYE), material


def test_fluence_and_what_a_transfer_belongs_to(frame, rng):
    light, made, *_ = frame
    own = jnp.asarray(rng.normal(size=(V, 3, K)), np.float32)
    volume = dataclasses.replace(made, surface="points", cosine=False)
    check_sharded(fluence, (light, volume), (WHOLE, ROWS), ROWS)
    check_sharded(fluence, (own, volume), (ROWS, ROWS), ROWS)
    mesh = Mesh(made.positions, jnp.zeros((1, 3), int), made.normals)
    assert made.sharded(jax.devices()).belongs_to(mesh)


def test_diffuse_shading(frame, rng):
    light, made, _, material = frame
    own = jnp.asarray(rng.normal(size=(V, 3, K)), np.float32)
    for lights, spec in ((light, WHOLE), (own, ROWS)):
        arguments = lights, made, material.diffuse
        check_sharded(shade_diffuse, arguments, (spec, ROWS, ROWS), ROWS)
    batch = jnp.stack([light, 2 * light])[:, None]
    check_sharded(shade_diffuse, (batch, made, material.diffuse), (WHOLE, ROWS, ROWS), COLUMNS)
    check_sharded(
        shade_diffuse,
        (light, sample(made), material.diffuse),
        (WHOLE, specs_of(sample(made), SAMPLED), ROWS),
        ROWS,
    )


def test_its_gradient(frame):
    def loss(coefficients, light, albedo, rest):
        made = Transfer(coefficients, *rest)
        return jnp.sum(shade_diffuse(light, made, albedo) ** 2)

    light, made, _, material = frame
    rest = made.positions, made.normals, made.neighbors
    arguments = made.coefficients, light, material.diffuse, rest
    specs = ROWS, WHOLE, ROWS, ROWS
    check_sharded(jax.grad(loss), arguments, specs, ROWS)
    total = {"all-reduce": "the light is that of all vertices"}
    check_sharded(jax.grad(loss, 1), arguments, specs, WHOLE, exchange=total)


def clusters_of(made):
    """The transfer in clusters, and its specs."""
    small = compress(made, clusters=2, components=2)
    return small, specs_of(small, (COLUMNS, ROWS, WHOLE, WHOLE, ROWS, ROWS, ROWS))


def test_clusters(frame):
    light, made, _, material = frame
    small, specs = clusters_of(made)
    check_sharded(shade_diffuse, (light, small, material.diffuse), (WHOLE, specs, ROWS), ROWS)


@pytest.mark.slow
def test_glossy_light_on_clusters(frame):
    light, made, eye, material = frame
    small, specs = clusters_of(made)
    check_sharded(shade_glossy, (light, small, eye, material), (WHOLE, specs, WHOLE, ROWS), ROWS)


def test_eight_bits(frame, rng):
    light, made, _, material = frame
    # Both halves have the same largest coefficients, so that inside shard_map scales are the same.
    half = rng.uniform(-1, 1, size=(V // 2, K))
    twice = jnp.asarray(np.concatenate([half, -half]), np.float32)
    made = Transfer(twice, made.positions, made.normals, made.neighbors)

    def both(light, made, albedo):
        return shade_diffuse(light, quantize(made), albedo)

    largest = {"all-reduce": "a scale is the largest coefficient of all points"}
    arguments = light, made, material.diffuse
    check_sharded(both, arguments, (WHOLE, ROWS, ROWS), ROWS, exchange=largest)
    blocks = quantize(made)
    codes = jnp.moveaxis(blocks.codes[..., :V], 0, 1).reshape(1, K, V)  # a single block of V
    single = QuantizedTransfer(codes, blocks.scales, 0)
    check_sharded(
        shade_diffuse,
        (light, single, material.diffuse),
        (WHOLE, specs_of(single, QUANTIZED), ROWS),
        ROWS,
    )


def test_glossy_shading(frame, rng):
    light, made, eye, material = frame
    specs = WHOLE, ROWS, WHOLE, ROWS
    check_sharded(shade_glossy, frame, specs, ROWS)
    sampled = light, sample(made), eye, material
    check_sharded(shade_glossy, sampled, (WHOLE, specs_of(sampled[1], SAMPLED), WHOLE, ROWS), ROWS)
    own = jnp.asarray(rng.normal(size=(V, 3, K)), np.float32)
    check_sharded(shade_glossy, (own, made, eye, material), (ROWS, ROWS, WHOLE, ROWS), ROWS)


@pytest.mark.slow
def test_glossy_shading_where_memory_is_short(rng, monkeypatch):
    """Pass after pass on each device, in the room that its own vertices leave."""
    normals = jnp.asarray(rng.normal(size=(1002, 3)), np.float32)
    light = jnp.asarray(rng.normal(size=(3, 36)), np.float32)
    material = Material(*(jnp.asarray(x, np.float32) for x in (0.5, 0.3, 8.0)))

    def room(made):
        arguments = light, made.sharded(jax.devices()[:2]), EYE, material
        compiled = jax.jit(shade_glossy).lower(*arguments).compile()
        return compiled.memory_analysis().temp_size_in_bytes

    large = room(unshadowed(normals[:1000], normals[:1000], 5))
    monkeypatch.setattr(xla, "_ROOM", 1)  # of another number of points, so that all is traced anew
    made = unshadowed(normals, normals, 5)
    check_sharded(shade_glossy, (light, made, EYE, material), (WHOLE, ROWS, WHOLE, WHOLE), ROWS)
    assert room(made) < large / 2


@pytest.mark.slow
def test_rough_materials(frame):
    """The lobe of each vertex is made where the vertex is."""
    light, made, eye, material = frame
    rough = Material.ggx(material.diffuse, material.specular, material.exponent / 10)
    specs = WHOLE, ROWS, WHOLE, ROWS
    check_sharded(shade_glossy, (light, made, eye, rough), specs, ROWS)

    def slope(roughness, light, made, eye, diffuse):
        def loss(roughness):
            material = Material.ggx(diffuse, 0.5, roughness)
            return jnp.sum(shade_glossy(light, made, eye, material) ** 2)

        return jax.grad(loss)(roughness)

    arguments = rough.roughness, light, made, eye, rough.diffuse
    check_sharded(slope, arguments, (ROWS, WHOLE, ROWS, WHOLE, ROWS), ROWS)


@pytest.mark.slow
def test_its_gradient_in_the_normals(frame):
    def slope(normals, light, made, eye, material):
        def loss(normals):
            turned = Transfer(made.coefficients, made.positions, normals, made.neighbors)
            return jnp.sum(shade_glossy(light, turned, eye, material) ** 2)

        return jax.grad(loss)(normals)

    light, made, eye, material = frame
    arguments = made.normals, light, made, eye, material
    check_sharded(slope, arguments, (ROWS, WHOLE, ROWS, WHOLE, ROWS), ROWS)


def test_samples(frame):
    made = frame[1]
    check_sharded(sample, (made,), (ROWS,), specs_of(sample(made), SAMPLED))
    check_sharded(lambda made: made.truncated(0).astype(np.float64), (made,), (ROWS,), ROWS)


def test_fixed_views(frame):
    _, made, eye, material = frame
    check_sharded(
        lambda made, eye, material: fixed_view(made, eye, material).coefficients,
        (made, eye, material),
        (ROWS, WHOLE, ROWS),
        ROWS,
    )
    check_sharded(
        lambda light, made, eye, material: fixed_view(made, eye, material)(light),
        frame,
        (WHOLE, ROWS, WHOLE, ROWS),
        ROWS,
    )


@pytest.mark.slow
def test_fixed_lights(frame):
    light, made, *_ = frame
    out = specs_of(fixed_light(light, made), STILL)
    check_sharded(fixed_light, (light, made), (WHOLE, ROWS), out)
    check_sharded(
        lambda light, made, eye, material: fixed_light(light, made)(eye, material),
        frame,
        (WHOLE, ROWS, WHOLE, ROWS),
        ROWS,
    )
    one = Material(0.5, 0.5, 8.0)
    check_sharded(
        lambda light, made, eye: fixed_light(light, made)(eye, one),
        frame[:3],
        (WHOLE, ROWS, WHOLE),
        ROWS,
    )


def test_unshadowed_transfer_and_its_gradient(frame):
    made, light = frame[1], frame[0]

    def transfer(positions, normals):
        return unshadowed(positions, normals, DEGREE)

    def arrays(positions, normals):
        made = transfer(positions, normals)  # its neighbors are the points' own numbers
        return made.coefficients, made.positions, made.normals

    arguments = made.positions, made.normals
    check_sharded(arrays, arguments, (ROWS, ROWS), (ROWS, ROWS, ROWS))

    def slope(positions, normals, light):
        def loss(normals):
            return jnp.sum(shade_diffuse(light, transfer(positions, normals), 0.5) ** 2)

        return jax.grad(loss)(normals)

    check_sharded(slope, (*arguments, light), (ROWS, ROWS, WHOLE), ROWS)


def test_reflected_directions(frame):
    _, made, eye, _ = frame
    arguments = eye, made.positions, made.normals
    check_sharded(reflected_direction, arguments, (WHOLE, ROWS, ROWS), ROWS)


@pytest.fixture
def sunny(frame, rng):
    """Two suns, and what V vertices see of them."""
    sun = Suns(np.array([[0.3, 0.4, 0.8], [-0.5, 0, 0.6]]), np.array([0.1, 0.2]), np.ones((2, 3)))
    sun = jax.tree.map(lambda array: array.astype(np.float32), sun)
    seen, draw = rng.random((V, 2, 4)) < 0.5, rng.integers(2**32, size=V, dtype=np.uint32)
    visibility = SunVisibility(jnp.asarray(seen), jnp.asarray(draw), sun.direction, sun.solid_angle)
    return sun, visibility, specs_of(visibility, (ROWS, ROWS, WHOLE, WHOLE))


def test_suns(frame, sunny):
    sun, visibility, specs = sunny
    _, made, _, material = frame
    arguments = sun, made, visibility, material.diffuse
    check_sharded(shade_sun, arguments, (WHOLE, ROWS, specs, ROWS), ROWS)


@pytest.mark.slow
def test_suns_on_what_is_glossy_and_their_gradient(frame, sunny):
    sun, visibility, specs = sunny
    _, made, eye, material = frame

    def shade(sun, made, visibility, material, eye):
        return shade_sun(sun, made, visibility, material=material, eye=eye)

    arguments = sun, made, visibility, material, eye
    spread = WHOLE, ROWS, specs, ROWS, WHOLE
    check_sharded(shade, arguments, spread, ROWS)
    shape = jnp.asarray(sun.rays(8), np.float32)
    check_sharded(
        shade,
        (Suns(sun.direction, sun.solid_angle, sun.radiance, shape), *arguments[1:]),
        spread,
        ROWS,
    )

    def slope(normals, *rest):
        def loss(normals):
            turned = Transfer(made.coefficients, made.positions, normals, made.neighbors)
            return jnp.sum(shade(sun, turned, *rest) ** 2)

        return jax.grad(loss)(normals)

    check_sharded(
        slope,
        (made.normals, visibility, material, eye),
        (ROWS, specs, ROWS, WHOLE),
        ROWS,
        mapped=False,
    )
