"""An environment along directions and behind a mesh."""

import jax
import jax.numpy as jnp
import numpy as np
import painters
import pytest
from jax.test_util import check_grads

from jaxsh.geometry import knot
from jaxsh.imaging import Camera, backdrop, interpolate, look_up, rasterize


def twin(environment, direction):
    """Bilinear look-up with every neighbor fetched by hand, in float64."""
    environment = np.asarray(environment, np.float64)
    height, width, _ = environment.shape
    x, y, z = np.asarray(direction, np.float64) / np.linalg.norm(direction)
    row = np.arccos(np.clip(z, -1, 1)) / np.pi * height - 0.5
    column = np.arctan2(y, x) / (2 * np.pi) * width - 0.5

    def along(i):
        j = int(np.floor(column))
        t = column - j
        return environment[i, j % width] * (1 - t) + environment[i, (j + 1) % width] * t

    if row < 0:
        pole = environment[0].mean(axis=0)
        return pole + (along(0) - pole) * (row + 0.5) * 2
    if row > height - 1:
        pole = environment[-1].mean(axis=0)
        return pole + (along(height - 1) - pole) * (height - 0.5 - row) * 2
    i = int(row)
    t = row - i
    return along(i) if t == 0 else along(i) * (1 - t) + along(i + 1) * t


@pytest.mark.parametrize("shape", [(8, 16), (5, 8), (1, 2), (2, 3)])
def test_look_up_is_the_slow_twin(rng, shape):
    environment = jnp.asarray(rng.uniform(size=(*shape, 2)))
    directions = rng.normal(size=(300, 3)) * rng.uniform(0.1, 10, size=(300, 1))
    directions[:100, :2] *= 0.05  # near the poles
    directions[100:150, 1] *= 1e-3  # and where φ wraps
    expected = [twin(environment, direction) for direction in directions]
    found = jax.jit(look_up)(environment, jnp.asarray(directions))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)
    batch = look_up(environment, jnp.asarray(directions).reshape(3, 100, 3))
    np.testing.assert_allclose(batch.reshape(300, 2), found, rtol=0, atol=1e-12)


def test_pixel_centers_are_met_exactly(rng):
    # Unoptimized code, as in `make test`, would round a place anew in each use.
    environment = jnp.asarray(rng.uniform(size=(6, 12, 3)))
    directions = jnp.asarray(painters.jaxsh_lat_long(6))
    np.testing.assert_allclose(look_up(environment, directions), environment, rtol=0, atol=1e-13)


def test_a_pole_is_one_value_from_all_sides(rng):
    environment = jnp.asarray(rng.uniform(size=(6, 12, 3)))
    for z, row in ((1.0, 0), (-1.0, -1)):
        phi = np.linspace(0, 2 * np.pi, 9)
        around = np.stack([1e-9 * np.cos(phi), 1e-9 * np.sin(phi), 0 * phi + z], axis=-1)
        around[0] = 0, 0, z
        mean = np.tile(environment[row].mean(axis=0), (9, 1))
        np.testing.assert_allclose(
            look_up(environment, jnp.asarray(around)), mean, rtol=0, atol=1e-8
        )
    found, mean = look_up(environment, jnp.zeros(3)), environment[0].mean(axis=0)
    np.testing.assert_allclose(found, mean, rtol=1e-15)


def test_constant_and_bounded(rng):
    directions = jnp.asarray(rng.normal(size=(2000, 3)))
    np.testing.assert_allclose(look_up(jnp.full((5, 10, 1), 0.7), directions), 0.7, rtol=1e-14)
    spots = jnp.asarray(rng.uniform(size=(4, 8, 1)) < 0.3, float)
    seen = look_up(spots, directions)
    assert float(seen.min()) > -1e-15
    assert float(seen.max()) < 1 + 1e-15


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
@pytest.mark.parametrize("other", [jnp.float32, jnp.float64])
def test_look_up_keeps_the_environments_dtype(rng, dtype, other):
    environment = jnp.asarray(rng.uniform(size=(4, 8, 3)), dtype)
    assert look_up(environment, jnp.asarray([0.3, 0.2, 0.1], other)).dtype == dtype


def test_look_up_differentiates(rng):
    environment = jnp.asarray(rng.uniform(size=(4, 8, 2)))
    directions = jnp.asarray(rng.normal(size=(20, 3)))
    check_grads(
        jax.jit(look_up), (environment, directions), 1, ("fwd", "rev"), atol=1e-6, rtol=1e-6
    )
    # At the poles and along φ = 0, where angles are at their worst.
    odd = jnp.array([[0, 0, 1.0], [0, 0, -1], [0, 0, 0], [1, 0, 0], [-1, 0, 0], [-1, -0.0, 0]])
    slope = jax.jit(jax.grad(lambda d: look_up(environment, d).sum()))(odd)
    assert np.isfinite(slope).all()
    np.testing.assert_array_equal(slope[:3], 0)
    # Linear in the environment: each direction's weights sum to one.
    gradient = jax.jit(jax.grad(lambda e: look_up(e, odd).sum()))(environment)
    np.testing.assert_allclose(gradient.sum(), 12, rtol=1e-12)


def test_backdrop_shows_each_axis_where_the_camera_looks():
    """Also that a picture so drawn is no mirror image: from -y, +x is to the right."""
    environment = jnp.asarray(painters.colored_axes(painters.jaxsh_lat_long(64)))
    for axis, color in painters.AXES.items():
        up = (0.0, 0.0, 1.0) if axis[2] == 0 else (0.0, 1.0, 0.0)
        camera = Camera((5.0, 6.0, 7.0), tuple(np.add((5, 6, 7), axis)), up, width=9, height=7)
        view = backdrop(environment, camera)
        assert view.shape == (7, 9, 3)
        np.testing.assert_allclose(view[3, 4], color, rtol=0, atol=0.02)
    wide = Camera((0.0, -2.0, 0.0), (0.0, 0.0, 0.0), fov_y=120.0, width=9, height=9)
    view = backdrop(environment, wide)
    assert view[4, 8, 0] > view[4, 0, 0]  # red +x to the right
    assert view[0, 4, 2] > view[8, 4, 2]  # blue +z above


def test_a_mesh_stands_before_its_environment(rng):
    mesh = knot(500)
    camera = Camera.facing(mesh, width=24, height=20)
    environment = jnp.asarray(rng.uniform(size=(8, 16, 3)), jnp.float32)
    behind = backdrop(environment, camera)
    raster = rasterize(mesh, camera, samples=2)
    white = jnp.ones((len(mesh.vertices), 3), jnp.float32)
    image = interpolate(raster, white, behind)
    alpha = np.asarray(raster.alpha)[..., None]
    np.testing.assert_allclose(image, alpha + (1 - alpha) * behind, rtol=0, atol=1e-6)
    slope = jax.jit(jax.grad(lambda e: interpolate(raster, white, backdrop(e, camera)).sum()))
    np.testing.assert_allclose(slope(environment).sum(), 3 * (1 - alpha).sum(), rtol=1e-6)
    # In float32 throughout: a camera's, a mesh's and an environment's usual dtype.
    assert image.dtype == behind.dtype == jnp.float32


def test_other_shapes_are_refused(unchecked):
    directions, camera = jnp.ones((5, 3)), Camera((0.0, -2.0, 0.0), (0.0, 0.0, 0.0), width=2)
    for environment, message in {
        "gray": (jnp.ones((4, 8)), r"expected environment .* got shape \(4, 8\); a gray one"),
        "first": (jnp.ones((3, 8, 16)), r"got shape \(3, 8, 16\); channels come last"),
        "square": (jnp.ones((8, 8, 3)), "twice as wide as high, got width 8 and height 8"),
        "codes": (jnp.ones((4, 8, 3), jnp.uint8), r"in floats, got uint8.*srgb_decode"),
    }.values():
        with pytest.raises(ValueError, match=message):
            look_up(environment, directions)
        with pytest.raises(ValueError, match=message):
            backdrop(environment, camera)
    spoilt = jnp.ones((4, 8, 3)).at[1, 2, 0].set(jnp.nan)
    for call in (lambda e: look_up(e, directions), lambda e: backdrop(e, camera)):
        with pytest.raises(ValueError, match="environment must be finite, got nan in 1 of 96"):
            call(spoilt)
    assert jnp.isnan(jax.jit(look_up)(spoilt, jnp.asarray(painters.jaxsh_lat_long(4)))).any()
    with pytest.raises(ValueError, match=r"expected directions \(..., 3\).* got shape \(3, 5\)"):
        look_up(jnp.ones((4, 8, 3)), jnp.ones((3, 5)))
    with pytest.raises(TypeError, match="expected camera as a Camera, got a tuple of 3"):
        backdrop(jnp.ones((4, 8, 3)), (0, 0, 0))
