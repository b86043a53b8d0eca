"""Lightmaps, read again: by OpenImageIO's and Pillow's own decoders."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image

from jaxsh import geometry, imaging


@pytest.fixture(scope="module")
def texels() -> geometry.Texels:
    """Two triangles apart from each other in the picture of 16 by 8 texels."""
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]])
    mesh = geometry.make_mesh(corners, np.array([[0, 1, 2], [3, 4, 5]]))
    uv = jnp.asarray([[0.05, 0.1], [0.4, 0.1], [0.4, 0.9], [0.6, 0.1], [0.9, 0.1], [0.6, 0.9]])
    return geometry.texels(dataclasses.replace(mesh, uv=uv.astype(jnp.float32)), (16, 8))


def shown(texels, rows) -> np.ndarray:
    """Rows at texels where the picture shows them, by a loop, 0 elsewhere."""
    picture = np.zeros((*texels.shape, rows.shape[1]), rows.dtype)
    for place, row in np.ndenumerate(np.asarray(texels.source)):
        if row >= 0:
            picture[place] = rows[row]
    return picture


def test_an_exr_keeps_each_number(tmp_path, texels, rng):
    light = rng.normal(0, 3, (texels.num_points, 3)).astype(np.float32)
    path = imaging.write_lightmap(tmp_path / "new" / "light.exr", texels, light)
    picture = oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT)
    np.testing.assert_array_equal(picture, shown(texels, light))
    # The texel at the center of which the UV are is its own, v upwards.
    u, v = np.asarray(texels.uv).T
    own = picture[np.floor((1 - v) * 8).astype(int), np.floor(u * 16).astype(int)]
    np.testing.assert_array_equal(own, light)
    seen = imaging.sample_texture(jnp.asarray(picture), texels.uv)
    np.testing.assert_allclose(seen, light, rtol=0, atol=3e-6 * abs(light).max())
    half = imaging.write_lightmap(tmp_path / "half.exr", texels, light[:, :1].astype(np.float16))
    read = oiio.ImageBuf(str(half))
    assert read.spec().format == oiio.HALF
    expected = shown(texels, light[:, :1].astype(np.float16))
    np.testing.assert_array_equal(read.get_pixels(oiio.FLOAT).reshape(8, 16, 1), expected)


def test_a_png_is_what_a_screen_shows_and_says_what_it_cuts(tmp_path, texels, rng):
    light = rng.uniform(0, 2, (texels.num_points, 3)).astype(np.float32)
    path = imaging.write_lightmap(tmp_path / "light.png", texels, light, exposure=0.5)
    codes = np.rint(255 * np.asarray(imaging.tone_map(jnp.asarray(light), 0.5)))
    np.testing.assert_array_equal(np.asarray(Image.open(path)), shown(texels, codes))
    half = np.full(light.shape, 2**-17, np.float16)  # with an exposure beyond float16
    path = imaging.write_lightmap(path, texels, half, exposure=2.0**17)
    np.testing.assert_array_equal(
        np.asarray(Image.open(path)), shown(texels, 255 * np.ones(light.shape))
    )
    light[3, 1], light[5] = 2.5, -0.1
    with pytest.warns(
        UserWarning, match=r"1 of \d+ texels are cut off at 1, the brightest of 1.25"
    ):
        imaging.write_lightmap(path, texels, light, exposure=0.5)


def test_what_does_not_fit_is_refused(tmp_path, texels, unchecked):
    light = np.ones((texels.num_points, 3))
    for message, change in (
        ("cannot write .jpg, only .exr and .png", {"path": tmp_path / "a.jpg"}),
        (r"expected values \(\d+, 3\) or \(\d+, 1\), .* got shape \(5, 3\)", {"values": light[:5]}),
        ("values must be finite, got nan", {"values": light * np.nan}),
        ("exposure must be a number > 0", {"exposure": 0.0}),
        ("an .exr keeps values as they are, got exposure=2", {"exposure": 2.0}),
    ):
        given = {"path": tmp_path / "a.exr", "values": light} | change
        with pytest.raises(ValueError, match=message):
            imaging.write_lightmap(given.pop("path"), texels, given.pop("values"), **given)
    with pytest.raises(ValueError, match="expected known values for values, got traced ones"):
        jax.eval_shape(lambda v: imaging.write_lightmap(tmp_path / "a.png", texels, v), light)
    assert list(tmp_path.iterdir()) == []
