"""Lat-long pictures: the separable transforms."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from fields import basis, exponential, exponential_coefficients, picture
from hypothesis import given, settings
from hypothesis import strategies as st
from jax.test_util import check_grads

from jaxsh import harmonics, sphere
from jaxsh.sphere import _folds

SIZES = [(16, 32), (15, 32), (17, 32), (13, 20)]


def generic(image, degree):
    """The same, by evaluating every pixel's direction."""
    height, width, channels = image.shape
    quadrature = sphere.lat_long(height, width)
    rows, y = np.reshape(image, (-1, channels)), basis(quadrature.directions, degree)
    return np.einsum("nc,n,nk->ck", rows, np.asarray(quadrature.weights), y)


@pytest.mark.parametrize(("height", "width"), SIZES)
def test_project_is_the_generic_sum(height, width, rng):
    image = rng.normal(size=(height, width, 2))
    result = sphere.project_lat_long(image, 6)
    assert result.shape == (2, 49)
    np.testing.assert_allclose(result, generic(image, 6), 0, 2e-14)
    streamed = sphere.project(image.reshape(-1, 2).T, sphere.lat_long(height, width), 6)
    np.testing.assert_allclose(result, streamed, 0, 2e-14)


@pytest.mark.parametrize("columns", [24, pytest.param(48, marks=pytest.mark.slow)])
def test_a_picture_that_is_folded(columns, rng, monkeypatch):
    """Of high degree, on a CPU: in a loop over two blocks, and in one."""
    degree, channels = 21, columns // 24  # another shape each, which is compiled anew
    blocks, fold = [], _folds._folded

    def folded(*arguments):
        blocks.append(arguments[-1])
        return fold(*arguments)

    monkeypatch.setattr(_folds, "_BLOCK", 22 * columns * channels)
    monkeypatch.setattr(_folds, "_folded", folded)
    image, pull = rng.normal(size=(44, 96, channels)), rng.normal(size=(channels, 484))
    project = functools.partial(sphere.project_lat_long, degree=degree)
    found, derivative = jax.jvp(project, (image,), (2 * image,))
    (back,) = jax.vjp(project, image)[1](pull)
    expected = generic(image, degree)
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-14)
    np.testing.assert_allclose(derivative, 2 * expected, rtol=0, atol=4e-14)
    directions, weights = sphere.lat_long(44, 96).directions, sphere.lat_long(44, 96).weights
    expected = np.asarray(weights)[:, None] * (basis(directions, degree) @ pull.T)
    np.testing.assert_allclose(back, expected.reshape(image.shape), rtol=0, atol=1e-14)
    assert set(blocks) == {columns}


@pytest.mark.parametrize(("height", "width"), SIZES)
def test_reconstruct_is_the_generic_sum(height, width, rng):
    c = rng.normal(size=(2, 49))
    image = sphere.reconstruct_lat_long(c, height, width)
    assert image.shape == (height, width, 2)
    directions = sphere.lat_long(height, width).directions
    expected = (basis(directions, 6) @ c.T).reshape(height, width, 2)
    np.testing.assert_allclose(image, expected, 0, 2e-14)


def test_pixels_are_at_their_angles(rng):
    c = np.zeros((3, 4))
    c[0, 3] = c[1, 1] = c[2, 2] = np.sqrt(4 * np.pi / 3)  # x, y, z
    image = sphere.reconstruct_lat_long(c, 5, 8)
    expected = np.stack([picture(lambda d, i=i: d[:, i], 5, 8) for i in range(3)], axis=-1)
    np.testing.assert_allclose(image, expected, 0, 1e-15)
    assert image[0, 0, 2] > 0.9  # row 0 touches +z
    assert image[2, 0, 0] > 0.9  # column 0 starts at +x
    assert image[2, 1, 1] > 0.9  # and φ grows to the right, towards +y


def test_project_a_known_picture():
    axis = np.array([0.7, -1.2, 0.9])
    image = picture(exponential(axis), 41, 64)[..., None]
    expected = exponential_coefficients(axis, 8)
    np.testing.assert_allclose(sphere.project_lat_long(image, 8)[0], expected, 0, 4e-14)


@pytest.mark.parametrize(
    ("of", "onto", "height", "width"),
    [(6, 6, 13, 20), (6, 6, 13, 64), (9, 3, 13, 20), (0, 0, 1, 2)],
)
def test_exact_where_the_degrees_stay_below_height_and_width(of, onto, height, width, rng):
    c = rng.normal(size=(1, (of + 1) ** 2))
    image = sphere.reconstruct_lat_long(c, height, width)
    expected = np.zeros((1, (onto + 1) ** 2))
    shared = min(expected.size, c.size)
    expected[:, :shared] = c[:, :shared]
    np.testing.assert_allclose(sphere.project_lat_long(image, onto), expected, 0, 2e-14)


@pytest.mark.parametrize(("height", "width"), [(12, 64), (64, 12)])
def test_and_not_beyond(height, width):
    """At degree 6 + 6 = 12 rows or columns something aliases."""
    image = sphere.reconstruct_lat_long(np.eye(49), height, width)
    weights = np.asarray(sphere.lat_long(height, width).weights).reshape(height, width, 1, 1)
    image = np.asarray(image)
    gram = (weights * image[..., None] * image[..., None, :]).sum(axis=(0, 1))
    assert np.abs(gram - np.eye(49)).max() > 0.005  # 0.009 for rows, 1 for columns


def test_shifting_the_columns_turns_about_z(rng):
    image = rng.normal(size=(16, 24, 2))
    c = sphere.project_lat_long(image, 7)
    for columns in (1, 6, 17):
        shifted = sphere.project_lat_long(np.roll(image, columns, axis=1), 7)
        turned = harmonics.rotate_z(c, columns * 2 * np.pi / 24)
        np.testing.assert_allclose(shifted, turned, 0, 2e-14)


def test_flipping_the_picture_mirrors_the_function(rng):
    image = rng.normal(size=(15, 24, 1))
    c = np.asarray(sphere.project_lat_long(image, 7))
    l, m = harmonics.degrees(7), harmonics.orders(7)
    upside_down = sphere.project_lat_long(image[::-1], 7)
    np.testing.assert_allclose(upside_down, c * (-1.0) ** (l + m), 0, 2e-14)
    left_right = sphere.project_lat_long(image[:, ::-1], 7)  # φ -> -φ
    np.testing.assert_allclose(left_right, c * np.where(m < 0, -1, 1), 0, 2e-14)


def test_a_constant_picture_has_a_mean_alone():
    c = sphere.project_lat_long(np.full((14, 30, 1), 2.0), 6)[0]
    np.testing.assert_allclose(c, 2 * np.sqrt(4 * np.pi) * (np.arange(49) == 0), 0, 1e-14)


@settings(max_examples=5)
@given(st.integers(0, 6), st.integers(1, 9), st.integers(1, 9), st.integers(1, 4))
def test_reconstruct_then_project_at_any_size(degree, more_rows, more_columns, channels):
    c = np.random.default_rng(0).normal(size=(channels, (degree + 1) ** 2))
    height = 2 * degree + more_rows
    size = height, max(2 * degree + more_columns, -(-3 * height // 2))
    image = sphere.reconstruct_lat_long(c, *size)
    np.testing.assert_allclose(sphere.project_lat_long(image, degree), c, 0, 2e-14)


def test_dtype_is_that_of_the_picture(rng, unchecked):
    image = rng.uniform(0, 1, (64, 128, 3))
    single = sphere.project_lat_long(image.astype(np.float32), 10)
    assert single.dtype == jnp.float32
    np.testing.assert_allclose(single, sphere.project_lat_long(image, 10), 0, 1e-5)  # 2e-6
    back = sphere.reconstruct_lat_long(single, 8, 16)
    assert back.dtype == jnp.float32
    np.testing.assert_allclose(
        back, sphere.reconstruct_lat_long(single.astype(jnp.float64), 8, 16), 0, 1e-5
    )


def test_linear_and_differentiable(rng):
    image, pull = rng.normal(size=(10, 16, 2)), rng.normal(size=(2, 16))
    project = functools.partial(sphere.project_lat_long, degree=3)
    check_grads(project, (image,), order=1, modes=["fwd", "rev"], rtol=1e-8)
    gradient = jax.grad(lambda image: jnp.sum(pull * project(image)))(image)
    # the adjoint: weights times reconstruction
    weights = np.asarray(sphere.lat_long(10, 16).weights).reshape(10, 16, 1)
    expected = weights * np.asarray(sphere.reconstruct_lat_long(pull, 10, 16))
    np.testing.assert_allclose(gradient, expected, 0, 1e-14)
    reconstruct = functools.partial(sphere.reconstruct_lat_long, height=10, width=16)
    check_grads(reconstruct, (pull,), order=1, modes=["fwd", "rev"], rtol=1e-8)


def test_jit_and_vmap_agree(rng):
    images = rng.normal(size=(3, 10, 16, 2))
    project = functools.partial(sphere.project_lat_long, degree=3)
    expected = np.stack([project(image) for image in images])
    np.testing.assert_allclose(jax.jit(jax.vmap(project))(images), expected, 0, 4e-15)
    reconstruct = functools.partial(sphere.reconstruct_lat_long, height=10, width=16)
    back = np.stack([reconstruct(c) for c in expected])
    np.testing.assert_allclose(jax.jit(jax.vmap(reconstruct))(expected), back, 0, 4e-15)


@pytest.mark.parametrize(("height", "width"), [(12, 64), (6, 12), (1, 2)])
def test_a_picture_too_small_is_refused(height, width):
    message = f"{height} rows and {width} columns is too small for degree 6: both must be above 12"
    with pytest.raises(ValueError, match=message):
        sphere.project_lat_long(np.ones((height, width, 1)), 6)


def test_bad_input_is_refused(unchecked):
    for image, message in {
        "gray": (np.ones((9, 18)), r"\(height, width, channels\), got shape \(9, 18\); a gray"),
        "batch": (np.ones((2, 9, 18, 3)), "jax.vmap"),
        "empty": (np.ones((0, 0, 3)), r"got shape \(0, 0, 3\)"),
        "channels first": (np.ones((3, 64, 128)), r"\(3, 64, 128\); channels come last"),
        "square": (np.ones((9, 9, 1)), "twice as wide .* width 9 and height 9, .* angular map"),
        "transposed": (np.ones((18, 9, 3)), "width 9 and height 18; is it transposed"),
        "a cross": (np.ones((24, 32, 3)), "a horizontal cross"),
        "codes": (np.ones((9, 18, 3), np.uint8), r"got uint8.*srgb_decode\(image / 255\)"),
        "deep codes": (np.ones((9, 18, 3), np.uint16), r"got uint16.*image / 65535\)"),
        "integers": (np.ones((9, 18, 3), int), "expected image in floats, got int64"),
        "a mask": (np.ones((9, 18, 3), bool), "got bool"),
        "text": ("probe.hdr", "expected image as an array of floats, got str"),
    }.values():
        with pytest.raises(ValueError, match=message):
            sphere.project_lat_long(image, 2)
    for value in (np.nan, np.inf):
        image = np.ones((9, 18, 3))
        image[4, 4, 1] = image[5, 5, 2] = value
        with pytest.raises(ValueError, match=f"image must be finite, got {value} in 2 of 486"):
            sphere.project_lat_long(image, 2)
        assert not np.isfinite(jax.jit(sphere.project_lat_long, static_argnums=1)(image, 2)).all()
    with pytest.raises(ValueError, match=r"degree must be an integer >= 0.*got -1"):
        sphere.project_lat_long(np.ones((9, 9, 1)), -1)
    with pytest.raises(ValueError, match=r"coefficients \(channels, K\), got shape \(9,\)"):
        sphere.reconstruct_lat_long(np.ones(9), 4, 8)
    with pytest.raises(ValueError, match=r"1, 4, 9, 16.*got shape .*8,?\)"):
        sphere.reconstruct_lat_long(np.ones((1, 8)), 4, 8)
    with pytest.raises(ValueError, match=r"height must be an integer >= 1, got 0"):
        sphere.reconstruct_lat_long(np.ones((1, 9)), 0, 8)
