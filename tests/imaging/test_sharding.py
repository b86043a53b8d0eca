"""Pictures on a mesh of devices: rows shared out, what they look up whole on each device."""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.sharding import AxisType, NamedSharding
from sharding import ROWS, WHOLE, check_sharded, collectives

from jaxsh import geometry, imaging
from jaxsh.imaging import Camera, Raster

CAMERA = Camera((0.3, -4.0, 0.2), (0.0, 0.0, 0.0), width=6, height=8)


@pytest.fixture(scope="module")
def scene():
    mesh = geometry.knot(300)
    raster = imaging.rasterize(mesh, CAMERA, samples=2)
    return mesh, (raster.face, raster.barycentric, raster.faces)


@pytest.mark.parametrize(("shape", "spec"), [((3,), WHOLE), ((8, 6, 3), ROWS)])
def test_interpolate_keeps_the_rows_of_the_raster(scene, rng, shape, spec):
    mesh, raster = scene
    background = rng.uniform(size=shape).astype(np.float32)

    def draw(face, barycentric, faces, values, background):
        return imaging.interpolate(Raster(face, barycentric, faces, 2), values, background)

    specs = (ROWS, ROWS, WHOLE, WHOLE, spec)
    check_sharded(draw, (*raster, mesh.normals, background), specs, ROWS)


@pytest.mark.parametrize("kind", [AxisType.Auto, AxisType.Explicit])
def test_values_shared_out_by_vertex_make_a_whole_picture(scene, kind):
    """Shading on a mesh of devices ends so, and is drawn and differentiated."""
    mesh, raster = scene
    devices = jax.make_mesh((2,), ("rows",), axis_types=(kind,))
    values = jax.device_put(mesh.normals, NamedSharding(devices, ROWS))

    def loss(values):
        image = imaging.interpolate(Raster(*raster, 2), values, 0.5)
        return jnp.sum(image**2), image

    step = jax.jit(jax.value_and_grad(loss, has_aux=True))
    (_, image), gradient = step(values)
    (_, whole), expected = step(mesh.normals)
    np.testing.assert_allclose(image, whole, rtol=0, atol=1e-6)
    np.testing.assert_allclose(gradient, expected, rtol=0, atol=1e-5)
    assert image.sharding.is_fully_replicated


def test_the_gradient_in_the_background_keeps_the_rows(scene, rng):
    mesh, raster = scene
    background = rng.uniform(size=(8, 6, 3)).astype(np.float32)

    def loss(background, face, barycentric, faces, values):
        image = imaging.interpolate(Raster(face, barycentric, faces, 2), values, background)
        return jnp.sum(image**2)

    specs = (ROWS, ROWS, ROWS, WHOLE, WHOLE)
    check_sharded(jax.grad(loss), (background, *raster, mesh.normals), specs, ROWS)


def test_alpha_and_mask_keep_the_rows(scene):
    def marks(*arrays):
        raster = Raster(*arrays, 2)
        return raster.alpha, raster.mask.astype(np.float32)

    check_sharded(marks, scene[1], (ROWS, ROWS, WHOLE), (ROWS, ROWS))


def test_look_up_keeps_the_sharding_of_directions(rng):
    environment = rng.uniform(size=(4, 8, 3)).astype(np.float32)
    directions = rng.normal(size=(64, 3)).astype(np.float32)
    check_sharded(imaging.look_up, (environment, directions), (WHOLE, ROWS), ROWS)
    gradient = jax.grad(lambda d, e: jnp.sum(imaging.look_up(e, d) ** 2))
    check_sharded(gradient, (directions, environment), (ROWS, WHOLE), ROWS)


@pytest.mark.slow
def test_textures_keep_the_sharding_of_coordinates(rng):
    texture = rng.uniform(size=(4, 6, 3)).astype(np.float32)
    uv = rng.uniform(-1, 2, size=(8, 2)).astype(np.float32)
    footprint = rng.normal(size=(8, 2, 2)).astype(np.float32)
    arguments, specs = (texture, uv, footprint), (WHOLE, ROWS, ROWS)
    check_sharded(imaging.sample_texture, arguments, specs, ROWS)


@pytest.mark.slow
def test_gradients_of_textures_keep_it_too(rng):
    texture = rng.uniform(size=(4, 6, 3)).astype(np.float32)
    uv = rng.uniform(-1, 2, size=(8, 2)).astype(np.float32)
    footprint = rng.normal(size=(8, 2, 2)).astype(np.float32)
    gradient = jax.grad(lambda uv, t, f: jnp.sum(imaging.sample_texture(t, uv, f) ** 2))
    check_sharded(gradient, (uv, texture, footprint), (ROWS, WHOLE, ROWS), ROWS)


@pytest.mark.slow
def test_base_color_keeps_the_rows_of_the_raster(scene, rng):
    mesh, raster = scene
    codes = rng.integers(0, 256, size=(4, 6, 4), dtype=np.uint8)
    chosen = np.zeros(len(mesh.faces), np.int32)
    part = geometry.BaseColor(texture=codes)
    uv = rng.uniform(size=(300, 2)).astype(np.float32)
    footprint = rng.normal(size=(*raster[0].shape, 2, 2)).astype(np.float32)

    def color(vertices, uv, chosen, face, barycentric, faces, footprint):
        mesh = geometry.Mesh(vertices, faces, vertices, uv, None, chosen, (part,))
        return imaging.base_color(mesh, Raster(face, barycentric, faces, 2, footprint=footprint))

    specs = (WHOLE, WHOLE, WHOLE, ROWS, ROWS, WHOLE, ROWS)
    check_sharded(color, (mesh.vertices, uv, chosen, *raster, footprint), specs, ROWS)


@pytest.mark.slow
def test_base_color_keeps_the_sharding_of_texels(rng):
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    mesh = geometry.make_mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    part = geometry.BaseColor(texture=rng.integers(0, 256, size=(4, 6, 4), dtype=np.uint8))
    mesh = dataclasses.replace(
        mesh, uv=mesh.vertices[:, :2], face_material=0 * mesh.faces[:, 0], materials=(part,)
    )
    held = geometry.texels(mesh, 4)

    def color(positions, normals, uv, face, barycentric):
        at = geometry.Texels(
            positions, normals, uv, face, barycentric, held.source, held.mesh, held.vertex
        )
        return imaging.base_color(mesh, at)

    arrays = held.positions, held.normals, held.uv, held.face, held.barycentric
    check_sharded(color, arrays, (ROWS,) * 5, ROWS)


@pytest.mark.parametrize("curve", ["clip", "reinhard"])
def test_tone_curves_keep_the_rows_of_a_picture(rng, curve):
    image = rng.uniform(0, 4, size=(8, 6, 3)).astype(np.float32)
    shown = functools.partial(imaging.tone_map, curve=curve)
    check_sharded(shown, (image, np.float32(0.5)), (ROWS, WHOLE), ROWS)
    check_sharded(jax.grad(lambda image: shown(image).sum()), (image,), (ROWS,), ROWS)


def test_srgb_keeps_the_rows_of_a_picture(rng):
    image = rng.uniform(size=(8, 6, 3)).astype(np.float32)
    for curve in (imaging.srgb_encode, imaging.srgb_decode):
        check_sharded(curve, (image,), (ROWS,), ROWS)


NUMBERS = {
    "psnr": lambda image: imaging.psnr(image, 0 * image + 0.5, image[..., 0] < 0.5),
    "auto_exposure": lambda image: imaging.auto_exposure(image, image[..., 0] < 0.5, 90.0),
}


@pytest.mark.parametrize("name", NUMBERS)
def test_numbers_of_pictures_keep_the_sharding_of_a_batch(rng, name):
    images = rng.uniform(size=(4, 8, 6, 3)).astype(np.float32)
    check_sharded(jax.vmap(NUMBERS[name]), (images,), (ROWS,), ROWS)


@pytest.mark.parametrize("kind", [AxisType.Auto, AxisType.Explicit])
@pytest.mark.parametrize("name", NUMBERS)
def test_a_number_of_one_picture_is_over_all_its_rows(rng, name, kind):
    image = rng.uniform(size=(8, 6, 3)).astype(np.float32)
    mesh = jax.make_mesh((2,), ("rows",), axis_types=(kind,))
    placed = jax.device_put(image, NamedSharding(mesh, ROWS))
    compiled = jax.jit(NUMBERS[name]).lower(placed).compile()
    np.testing.assert_allclose(compiled(placed), NUMBERS[name](jnp.asarray(image)), rtol=1e-6)
    if name == "psnr":  # a percentile wants all pixels together, a mean does not
        assert set(collectives(compiled)) == {"all-reduce"}


def test_rays_keep_the_sharding_of_cameras(rng):
    positions = (rng.normal(size=(4, 3)) + np.array([0, -9, 0])).astype(np.float32)

    def rays(position):
        return Camera(position, (0.0, 0.0, 0.0), width=3, height=2).rays()

    check_sharded(jax.vmap(rays), (positions,), (ROWS,), (ROWS, ROWS))
