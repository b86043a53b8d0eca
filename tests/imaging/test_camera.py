"""The camera, what it sees, and colors from vertices to pixels."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads

from jaxsh.geometry import Mesh, knot, make_mesh, ray_scene
from jaxsh.imaging import Camera, interpolate, rasterize


@pytest.fixture
def sheet():
    """A square in the plane y = 0 that faces -y, split into cells, so that it is no mere quad."""
    x, z = np.meshgrid(np.linspace(-1, 1, 6), np.linspace(-1, 1, 5))
    vertices = np.stack([x, 0 * x, z], axis=-1).reshape(-1, 3)
    a = (np.arange(4)[:, None] * 6 + np.arange(5)).reshape(-1)
    return make_mesh(
        vertices,
        np.concatenate([np.stack([a, a + 1, a + 7], 1), np.stack([a, a + 7, a + 6], 1)]),
    )


def test_rays_run_row_by_row_from_the_top_left():
    camera = Camera(position=(0, -2, 0), target=(0, 0, 0), fov_y=90.0, width=4, height=2)
    origins, directions = camera.rays()
    assert origins.shape == directions.shape == (8, 3)
    np.testing.assert_array_equal(origins, np.tile([0, -2, 0], (8, 1)))
    # At distance 1 the picture is 2 high and 4 wide; +x is to the right, +z up.
    expected = [(x, 1, z) for z in (0.5, -0.5) for x in (-1.5, -0.5, 0.5, 1.5)]
    np.testing.assert_allclose(directions / directions[:, 1:2], expected, rtol=0, atol=1e-6)
    np.testing.assert_allclose(jnp.linalg.norm(directions, axis=1), 1, rtol=1e-6)


def test_up_turns_the_picture():
    camera = Camera((0.0, -2.0, 0.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 90.0, 2, 2)
    np.testing.assert_allclose(
        camera.rays()[1] * np.sqrt(1.5),
        np.array([[1, 2, 1], [1, 2, -1], [-1, 2, 1], [-1, 2, -1]]) / 2,
        rtol=0,
        atol=1e-15,
    )


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_rays_keep_dtype_and_differentiate(dtype):
    def rays(position, fov_y):
        camera = Camera(position, jnp.zeros(3), jnp.array([0.1, 0, 1]), fov_y, width=3, height=2)
        return camera.rays()

    position, angle = jnp.array([1, -2, 0.5], dtype), jnp.asarray(35, dtype)
    plain = [np.asarray(array) for array in rays(position, angle)]
    compiled = jax.jit(rays)(position, angle)
    tolerance = 4 * float(jnp.finfo(dtype).eps)
    for a, b in zip(plain, compiled, strict=True):
        assert a.dtype == b.dtype == dtype
        np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)
    batch = jax.jit(jax.vmap(rays, (0, None)))(np.stack([position, 2 * position]), angle)
    np.testing.assert_allclose(np.asarray(batch[1])[0], plain[1], rtol=0, atol=tolerance)
    if dtype == jnp.float64:
        check_grads(
            jax.jit(rays),
            (position, angle),
            1,
            ("fwd", "rev"),
            atol=1e-7,
            rtol=1e-7,
        )


def test_camera_passes_through_jit():
    camera = Camera((0.0, -2.0, 0.0), (0.0, 0.0, 0.0), width=3, height=2)
    directions = jax.jit(lambda c: c.rays()[1])(camera)
    np.testing.assert_allclose(directions, camera.rays()[1], rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"width": 0}, "needs pixels, got 0 × 512"),
        ({"fov_y": 180.0}, "between 0 and 180 degrees, got 180"),
        ({"fov_y": float("nan")}, "between 0 and 180 degrees, got nan"),
        ({"target": (0.0, -2.0, 0.0)}, "target must differ from position"),
        ({"target": (0.0, -2.0, 5.0)}, "up must not be along the view"),
        ({"up": (0.0, 0.0, 0.0)}, "up must not be along the view"),
        ({"up": (0.0, 0.0, np.nan)}, "up must be finite"),
    ],
)
def test_bad_cameras_are_refused(fields, message):
    with pytest.raises(ValueError, match=message):
        Camera(**{"position": (0.0, -2.0, 0.0), "target": (0.0, 0.0, 0.0), **fields})


@pytest.mark.parametrize(
    ("width", "height", "toward"),
    [(90, 45, (1.0, 1.0, 1.0)), (40, 80, (-2.0, 0.0, -1.0))],
)
def test_facing_fills_the_picture(width, height, toward):
    mesh = knot(2000)
    moved = Mesh(mesh.vertices * 3 + jnp.array([[5, -2, 9]], jnp.float32), mesh.faces, mesh.normals)
    camera = Camera.facing(moved, toward=toward, width=width, height=height, margin=0.0)
    raster = rasterize(moved, camera)
    rows, columns = np.nonzero(np.asarray(raster.mask))
    first, last = (rows.min(), columns.min()), (rows.max(), columns.max())
    # One of the two directions is filled to the last pixel but one, the other is centered.
    free = np.array([first, (height - 1 - last[0], width - 1 - last[1])])
    assert free.sum(axis=0).min() <= 2
    assert np.abs(free[0] - free[1]).max() <= 2
    view = np.asarray(camera.position - camera.target)
    np.testing.assert_allclose(
        view / np.linalg.norm(view), toward / np.linalg.norm(toward), rtol=0, atol=2e-7
    )


def test_facing_sees_faces_and_no_more():
    mesh = knot(300)
    beside = jnp.full((2, 3), 100.0, mesh.vertices.dtype)
    vertices, normals = (jnp.concatenate([some, beside]) for some in (mesh.vertices, mesh.normals))
    found = Camera.facing(Mesh(vertices, mesh.faces, normals))
    np.testing.assert_array_equal(found.position, Camera.facing(mesh).position)
    with pytest.raises(ValueError, match="a mesh that is larger than a point"):
        Camera.facing(Mesh(0 * mesh.vertices, mesh.faces, mesh.normals))


def test_facing_leaves_a_margin():
    mesh = knot(2000)
    camera = Camera.facing(mesh, width=100, height=100, margin=0.2)
    rows, columns = np.nonzero(np.asarray(rasterize(mesh, camera).mask))
    assert min(rows.min(), columns.min(), 99 - rows.max(), 99 - columns.max()) in (9, 10, 11)


def test_a_viewer_in_front_sees_the_front(sheet):
    """From -y: x to the right, z up, and a face that faces -y shows its front."""
    camera = Camera.facing(sheet, toward=(0.0, -1.0, 0.0), width=20, height=20)
    raster = rasterize(sheet, camera)
    place = np.asarray(interpolate(raster, sheet.vertices))
    assert place[10, 18, 0] > 0.8
    assert place[10, 1, 0] < -0.8
    assert place[1, 10, 2] > 0.8
    normal = np.asarray(interpolate(raster, sheet.normals))
    np.testing.assert_allclose(normal[10, 10], [0, -1, 0], rtol=0, atol=1e-6)


def test_the_silhouette_of_a_sphere_is_the_projected_disc():
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=5)
    mesh = make_mesh(ball.vertices, ball.faces)
    camera = Camera(position=(0.0, -4.0, 0.0), target=(0.0, 0.0, 0.0), width=200, height=150)
    raster = rasterize(mesh, camera)
    kept = rasterize(mesh, camera, scene=ray_scene(mesh))
    np.testing.assert_array_equal(kept.face, raster.face)
    directions = np.asarray(camera.rays()[1]).reshape(150, 200, 3)
    # A ray meets the unit ball at distance 4 within asin(1/4) of the axis; the mesh lies inside
    # the ball by up to 6e-4, which 1e-3 covers.
    sine = np.linalg.norm(directions[..., [0, 2]], axis=-1)
    clear = np.abs(sine - 0.25) > 1e-3
    assert clear.mean() > 0.98
    np.testing.assert_array_equal(np.asarray(raster.mask)[clear], (sine < 0.25)[clear])
    # Where it is seen, the surface is that of the sphere, and its normal the place.
    place = np.asarray(interpolate(raster, mesh.vertices))[np.asarray(raster.mask)]
    np.testing.assert_allclose(np.linalg.norm(place, axis=-1), 1, rtol=0, atol=1e-3)
    assert place[:, 1].max() < -0.2


def test_raster_has_its_shapes_and_marks(sheet):
    raster = rasterize(sheet, Camera((0, -9, 0), (0, 0, 0), width=30, height=20))
    assert raster.face.shape == raster.mask.shape == (20, 30)
    assert raster.face.dtype == jnp.int32
    assert raster.barycentric.dtype == jnp.float32
    assert 0.05 < raster.mask.mean() < 0.95
    np.testing.assert_allclose(raster.barycentric.sum(-1), raster.mask, rtol=0, atol=1e-6)
    assert (raster.face[~np.asarray(raster.mask)] == -1).all()


def test_interpolation_is_exact_on_linear_functions_of_place(sheet):
    """Also under perspective: the sheet is seen at a slant."""
    camera = Camera((1.5, -2.0, 0.7), (0.0, 0.0, 0.0), fov_y=50.0, width=40, height=30)
    raster = rasterize(sheet, camera)
    matrix, shift = jnp.array([[1.0, 2, -1], [0.5, 0, 3]]), jnp.array([0.2, -0.3])
    vertices = sheet.vertices.astype(jnp.float64)
    image = np.asarray(interpolate(raster, vertices @ matrix.T + shift[None]))
    # The place that a pixel sees, from its ray and the plane y = 0 alone.
    origins, directions = (np.asarray(rays) for rays in camera.rays())
    place = origins - directions * (origins[:, 1:2] / directions[:, 1:2])
    expected = (place @ np.asarray(matrix).T + np.asarray(shift)).reshape(30, 40, 2)
    mask = np.asarray(raster.mask)
    assert 0.1 < mask.mean() < 0.9
    # Embree's float32: 1.5e-6 measured.
    np.testing.assert_allclose(image[mask], expected[mask], rtol=0, atol=5e-6)
    assert (image[~mask] == 0).all()


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_interpolation_compiles_batches_and_differentiates(sheet, rng, dtype):
    raster = rasterize(sheet, Camera((0, -4, 0), (0, 0, 0), width=8, height=6))
    batch = rng.normal(size=(2, len(sheet.vertices), 3)).astype(dtype)
    behind = jnp.array([1.0, 2, 3], dtype)

    def draw(values, background):
        return interpolate(raster, values, background)

    images, mask = map(np.asarray, (jax.jit(jax.vmap(draw, (0, None)))(batch, behind), raster.mask))
    assert images.dtype == dtype
    np.testing.assert_allclose(images[1], draw(jnp.asarray(batch[1]), behind), rtol=0, atol=1e-6)
    np.testing.assert_array_equal(images[0][~mask][0], behind)

    @jax.jit
    def derivatives(*arguments):
        total = jax.grad(lambda *a: draw(*a).sum(), (0, 1))(*arguments)
        return jax.jacfwd(draw)(*arguments), jax.jacrev(draw)(*arguments), total

    # Linear in the values: the Jacobian is the function, and its transpose collects each weight.
    forward, reverse, total = jax.tree.map(np.asarray, derivatives(batch[0], behind))
    np.testing.assert_allclose(forward, reverse, rtol=0, atol=1e-7)
    found = np.einsum("hwcvk,vk->hwc", forward, batch[0])
    np.testing.assert_allclose(found[mask], images[0][mask], rtol=0, atol=1e-6)
    np.testing.assert_allclose(total[0].sum(), 3 * mask.sum(), rtol=1e-6)
    assert total[1][0] == (~mask).sum()


def test_interpolation_refuses_values_of_another_mesh(unchecked):
    mesh = knot(400)
    raster = rasterize(mesh, Camera.facing(mesh, width=8, height=8))
    with pytest.raises(ValueError, match=rf"values for {len(mesh.vertices)} vertices, got 10"):
        interpolate(raster, jnp.zeros((10, 3)))
    with pytest.raises(ValueError, match=r"values \(v, c\).*got shape"):
        interpolate(raster, jnp.zeros(len(mesh.vertices)))


def test_more_samples_see_more_of_a_silhouette():
    """The share of a disc in each pixel, against a count of many points."""
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=4)
    mesh = make_mesh(ball.vertices, ball.faces)
    camera = Camera((0.0, -4.0, 0.0), (0.0, 0.0, 0.0), width=12, height=10)
    truth = np.asarray(rasterize(mesh, camera, samples=16).alpha)
    errors = []
    for samples in (1, 2, 4):
        raster = rasterize(mesh, camera, samples=samples)
        assert raster.face.shape == (10 * samples, 12 * samples)
        assert raster.alpha.shape == raster.mask.shape == (10, 12)
        assert raster.alpha.dtype == jnp.float32
        np.testing.assert_array_equal(raster.mask, np.asarray(raster.alpha) == 1)
        errors.append(np.abs(np.asarray(raster.alpha) - truth).max())
    assert errors[0] > 0.3 > errors[1] > errors[2]
    assert errors[2] < 0.1


def test_samples_are_averaged_in_linear_light(sheet):
    camera = Camera((0.3, -4.0, 0.2), (0.0, 0.0, 0.0), width=8, height=6)
    finer = Camera((0.3, -4.0, 0.2), (0.0, 0.0, 0.0), width=24, height=18)
    values = sheet.vertices.astype(jnp.float64)
    background = jnp.array([5.0, 6, 7])
    image, fine = (
        np.asarray(interpolate(raster, values, background))
        for raster in (rasterize(sheet, camera, samples=3), rasterize(sheet, finer))
    )
    np.testing.assert_allclose(
        image, fine.reshape(6, 3, 8, 3, 3).mean(axis=(1, 3)), rtol=0, atol=1e-15
    )


def test_background_may_be_a_picture_or_a_mark(sheet, rng, unchecked):
    camera = Camera((0, -4, 0), (0, 0, 0), width=8, height=6)
    raster = rasterize(sheet, camera, samples=2)
    picture = jnp.asarray(rng.uniform(size=(6, 8, 3)), jnp.float32)
    image = interpolate(raster, jnp.zeros_like(sheet.vertices), picture)
    np.testing.assert_allclose(image, (1 - raster.alpha[..., None]) * picture, rtol=0, atol=1e-7)
    marked = interpolate(raster, sheet.vertices, jnp.nan)
    np.testing.assert_array_equal(np.isnan(marked[..., 0]), ~np.asarray(raster.mask))
    gradient = jax.grad(lambda values: interpolate(raster, values, picture).sum())(sheet.vertices)
    np.testing.assert_allclose(gradient.sum(), 3 * float(raster.alpha.sum()), rtol=1e-5)
    with pytest.raises(
        ValueError, match=r"expected background .* or \(6, 8, 3\), got .*\(8, 6, 3\)"
    ):
        interpolate(raster, sheet.vertices, picture.transpose(1, 0, 2))


def test_samples_must_be_there(sheet):
    with pytest.raises(ValueError, match="samples must be an integer >= 1, got 0"):
        rasterize(sheet, Camera((0, -4, 0), (0, 0, 0)), samples=0)
