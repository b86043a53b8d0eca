"""Lights from files of other packages: each evaluated by the package's own function."""

import base64
import dataclasses
import io
import json
import warnings

import jax
import jax.numpy as jnp
import light_files as files
import numpy as np
import pytest
from light_files import NORMALS, THREE, THREE_IRRADIANCE
from PIL import Image
from scipy.spatial.transform import Rotation

from jaxsh import harmonics
from jaxsh.imaging import read_light, write_light

OURS = files.turned(NORMALS)
SIGNS = np.array([1, -1, 1, -1, 1, -1, 1, -1, 1])[:, None]


def radiance(light, directions=OURS) -> np.ndarray:
    """Evaluate our own light in NumPy, with the signs of the published polynomials undone."""
    return files.signed(np.asarray(light).T * SIGNS, directions)


def irradiance(light, directions=OURS) -> np.ndarray:
    lambdas = np.pi * np.array([1, *[2 / 3] * 3, *[1 / 4] * 5])
    return radiance(np.asarray(light) * lambdas, directions)


def written(path, content):
    data = json.dumps(content) if isinstance(content, dict | list) else content
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return path


@pytest.mark.parametrize("content", [THREE, files.three_scene(THREE["object"]), THREE["object"]])
def test_three_js_shows_the_same_irradiance(tmp_path, content):
    light = read_light(written(tmp_path / "a.json", content))
    assert light.shape == (3, 9)
    assert light.dtype == jnp.float64
    # Its constants have six digits.
    np.testing.assert_allclose(irradiance(light), THREE_IRRADIANCE, rtol=0, atol=5e-6)


def test_one_of_several_probes_is_named(tmp_path):
    dim = THREE["object"] | {"name": "dim", "intensity": 0.75}
    path = written(tmp_path / "a.json", files.three_scene(THREE["object"], dim))
    with pytest.raises(ValueError, match=r"a\.json: it holds 2 light probes \('sky', 'dim'\): say"):
        read_light(path)
    by_name, by_place = read_light(path, which="dim"), read_light(path, which=0)
    np.testing.assert_allclose(by_place, 2 * by_name, rtol=1e-15)
    with pytest.raises(ValueError, match=r"none of them 'dum'; did you mean 'dim'\?"):
        read_light(path, which="dum")
    with pytest.raises(ValueError, match="and which is 2"):
        read_light(path, which=2)


def test_a_list_is_one_light(tmp_path, unchecked):
    rows = written(tmp_path / "a.json", [[1.0, 2.0, 3.0]] * 9)
    with pytest.raises(ValueError, match=r"one light, got numbers of shape \(9, 3\), which are 9"):
        read_light(rows, convention="unity")
    with pytest.raises(ValueError, match="a list of numbers is one light: which must be None"):
        read_light(rows, convention="three.js", which=1)
    bare = written(tmp_path / "b.json", THREE["object"] | {"sh": [None] * 27})
    with pytest.raises(ValueError, match="27 numbers as 'sh', got a list of 27 with none in it"):
        read_light(bare)
    scene = written(tmp_path / "c.json", THREE)
    assert np.array_equal(read_light(scene, which=np.int64(0)), read_light(scene))  # pyright: ignore


def test_cmgen_prints_three_quantities(tmp_path):
    """Each line's comment says which; the shader and the polynomials of its source agree."""
    values = files.rows()
    said = {", irradiance, pre-scaled base": 1 / np.pi, ", irradiance": 1, "": None}
    for words, factor in said.items():
        light = read_light(written(tmp_path / "sh.txt", files.cmgen(values, words)))
        if "pre-scaled" in words:
            expected, got = files.filament(values, NORMALS), factor * irradiance(light)
        elif factor:
            expected, got = files.signed(values, NORMALS), irradiance(light)
        else:
            expected, got = files.signed(values, NORMALS), radiance(light)
        np.testing.assert_allclose(got, expected, rtol=0, atol=3e-15)


def test_numbers_in_rows_are_read_with_a_convention(tmp_path):
    values = files.rows()
    text = "\n".join("{1.0e0, 2., -.5}," if i == 0 else "3 4 5 # L" for i in range(4))
    light = read_light(written(tmp_path / "a.txt", text), convention="jaxsh")
    assert light[:, 0].tolist() == [1, 2, -0.5]
    with pytest.raises(ValueError, match=r"a\.txt: it does not say its convention: say conv"):
        read_light(tmp_path / "a.txt")
    # What the file says can be overruled; rows stay rows.
    text = files.cmgen(values, "")
    ours = read_light(written(tmp_path / "b.txt", text), convention="jaxsh")
    np.testing.assert_allclose(ours, values.T, rtol=0, atol=1e-15)


def test_gltf_is_irradiance_turned_by_its_rotation(tmp_path):
    """E'(n) = intensity · E(Rᵀn), in the axes of the file."""
    values, turn = files.rows(), Rotation.from_rotvec([0.3, -1.1, 0.4])
    fields = files.gltf(values, intensity=2.5, rotation=(3 * turn.as_quat()).tolist())
    back = NORMALS @ turn.as_matrix()
    for name, content in (("a.gltf", fields), ("a.glb", files.glb(fields))):
        light = read_light(written(tmp_path / name, content))
        expected = 2.5 * files.signed(values, back)
        np.testing.assert_allclose(irradiance(light), expected, rtol=0, atol=2e-15)


def test_the_light_of_the_scene_is_taken(tmp_path):
    fields = files.gltf(files.rows(), name="first")
    lights = fields["extensions"]["EXT_lights_image_based"]["lights"]
    lights.append(lights[0] | {"intensity": 2.0, "name": "second"})
    fields["scenes"][0]["extensions"]["EXT_lights_image_based"]["light"] = 1
    path = written(tmp_path / "a.gltf", fields)
    shown, first = read_light(path), read_light(path, which="first")
    np.testing.assert_allclose(shown, 2 * first, rtol=1e-15)
    del fields["scenes"][0]["extensions"]
    with pytest.raises(ValueError, match=r"it holds 2 lights \('first', 'second'\): say which"):
        read_light(written(path, fields))


def test_up_says_which_axis_points_up(tmp_path):
    path = written(tmp_path / "a.json", THREE)
    z_up = irradiance(read_light(path, up="z"), NORMALS)
    np.testing.assert_allclose(z_up, THREE_IRRADIANCE, rtol=0, atol=5e-6)
    assert np.array_equal(read_light(path, up="y"), read_light(path))


def test_arrays_of_other_people(tmp_path, rng):
    values = np.tril(rng.normal(size=(3, 2, 3, 3)))
    values[:, 1, :, 0] = 0  # sines of m = 0
    np.savez(tmp_path / "a.npz", clm=values, more=np.ones(3))
    light = read_light(tmp_path / "a.npz", which="clm", convention="pyshtools-4pi")
    back = harmonics.convert(light, "jaxsh", "pyshtools-4pi")
    np.testing.assert_allclose(back, values, rtol=0, atol=2e-15)
    np.savez(tmp_path / "b.npz", coefficients=values, convention="pyshtools-4pi")
    assert np.array_equal(read_light(tmp_path / "b.npz"), light)
    # One channel gives three; a flat list is of the layout that the convention has.
    np.save(tmp_path / "gray.npy", values[0].astype(">f4"))
    gray = read_light(tmp_path / "gray.npy", convention="pyshtools-4pi")
    np.testing.assert_allclose(gray, np.repeat(light[:1], 3, axis=0), rtol=0, atol=4e-7)
    assert gray.dtype == jnp.float32
    np.save(tmp_path / "flat.npy", np.array(THREE["object"]["sh"]))
    flat = read_light(tmp_path / "flat.npy", convention="three.js")
    np.testing.assert_allclose(
        1.5 * flat, read_light(written(tmp_path / "a.json", THREE)), rtol=0, atol=1e-15
    )
    assert np.array_equal(
        read_light(written(tmp_path / "b.json", THREE["object"]["sh"]), convention="three.js"), flat
    )
    red = written(tmp_path / "c.json", THREE["object"]["sh"][::3])  # 9 numbers, of one channel
    gray = read_light(red, convention="three.js")
    np.testing.assert_allclose(gray, np.repeat(flat[:1], 3, axis=0), rtol=0, atol=1e-15)


def test_what_is_written_is_read_back(tmp_path, rng):
    light = rng.normal(size=(3, 9))
    for dtype, atol in ((np.float64, 2e-15), (np.float32, 8e-7)):
        for name in ("a.json", "deep/er/a.txt", "a.npz", "a.gltf", "a.glb"):
            path = write_light(tmp_path / name, jnp.asarray(light, dtype))
            again = read_light(path)
            np.testing.assert_allclose(again, light.astype(dtype), rtol=0, atol=atol)
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {"a.glb", "a.gltf", "a.json", "a.npz", "deep"}


def test_single_precision_at_a_users(tmp_path):
    """Without x64: what float32 cannot hold is refused; halves are written as float32."""
    path = tmp_path / "a.npy"
    with jax.enable_x64(False):
        assert read_light(written(tmp_path / "a.json", THREE)).dtype == jnp.float32
        np.save(path, np.full((3, 9), 1e300))
        with pytest.raises(
            ValueError, match=r"a\.npy: its numbers are beyond the range of float32"
        ):
            read_light(path, convention="jaxsh")
        half = write_light(tmp_path / "a.npz", jnp.ones((3, 9), jnp.bfloat16))
        assert read_light(half).dtype == jnp.float32
    with pytest.raises(ValueError, match="expected known values for light, got traced ones"):
        jax.jit(lambda light: write_light(path, light))(jnp.ones((3, 9)))


def test_an_archive_keeps_any_convention(tmp_path, rng):
    many = rng.normal(size=(5, 3, 9))
    path = write_light(tmp_path / "own.npz", many)
    assert np.array_equal(read_light(path), many)
    mirrored = dataclasses.replace(harmonics.conventions()["unity"], quantity="irradiance")
    for convention, up in (("unity", None), ("filament", "z"), (mirrored, None)):
        path = write_light(tmp_path / "a.npz", many, convention=convention, up=up)
        with np.load(path) as held:
            shape = held["coefficients"].shape
        assert shape == ((5, 9, 3) if up else (5, 27))
        np.testing.assert_allclose(read_light(path), many, rtol=0, atol=2e-15)


def test_an_archive_with_other_axes_has_no_name(tmp_path, rng):
    light = rng.normal(size=(3, 9))
    for up, name in ((None, "three.js"), ("y", "three.js"), ("z", "see facts")):
        path = write_light(tmp_path / "a.npz", light, convention="three.js", up=up)
        assert str(np.load(path)["convention"]) == name
        np.testing.assert_allclose(read_light(path), light, rtol=0, atol=2e-15)


def test_what_a_format_cannot_hold_is_said(tmp_path, rng):
    light = rng.normal(size=(3, 16))
    with pytest.warns(UserWarning, match=r"a\.json: left out what is above degree 2"):
        path = write_light(tmp_path / "a.json", light)
    np.testing.assert_allclose(read_light(path), light[:, :9], rtol=0, atol=2e-15)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        path = write_light(tmp_path / "a.txt", light, convention="filament-sh")
        np.testing.assert_allclose(read_light(path), light, rtol=0, atol=2e-15)
        path = write_light(tmp_path / "b.json", light[:, :4])
    assert np.array_equal(read_light(path)[:, 4:], np.zeros((3, 5)))
    with pytest.raises(ValueError, match=r"a\.npz: cannot be written: between radiance and irr"):
        write_light(tmp_path / "a.npz", light, convention="irradiance")
    with pytest.raises(ValueError, match=r"a\.json: a \.json is in three\.js: write \.npz"):
        write_light(tmp_path / "a.json", light, convention="unity")
    with pytest.raises(ValueError, match=r"a\.json: a \.json holds one light"):
        write_light(tmp_path / "a.json", light[None])
    with pytest.raises(ValueError, match=r"light must be finite, got nan in 1 of 48 places"):
        write_light(tmp_path / "a.json", np.where(np.arange(48).reshape(3, 16) == 7, np.nan, light))
    (tmp_path / "b.npz").mkdir()
    with pytest.raises(IsADirectoryError, match=r"b\.npz: cannot be written: it is a folder"):
        write_light(tmp_path / "b.npz", light)


def test_gltf_shows_the_light_in_its_pictures_too(tmp_path):
    """Unpacked as Babylon.js does, and looked at from inside: +x has +z to the right, y up."""
    light = np.zeros((3, 9))
    light[:, :4] = [[9.0, 1.0, -2.0, 4.0], [2.0, 0.5, 0.5, -1.0], [-3.0, 1.0, 0.0, 0.0]]
    fields = json.loads(write_light(tmp_path / "a.gltf", light).read_bytes())
    binary = write_light(tmp_path / "a.glb", light).read_bytes()
    one = fields["extensions"]["EXT_lights_image_based"]["lights"][0]
    assert set(one) == {"irradianceCoefficients", "specularImages", "specularImageSize"}
    seen = {"+x": "+x +z +y", "-x": "-x -z +y", "+y": "+y -x -z", "-y": "-y -x +z"}
    seen |= {"+z": "+z -x +y", "-z": "-z +x +y"}  # ahead, right, up
    at = (2 * np.arange(16) + 1) / 16 - 1
    for index, names in zip(one["specularImages"][0], seen.values(), strict=True):
        ahead, right, up = (
            int(name[0] + "1") * np.eye(3)["xyz".index(name[1])] for name in names.split()
        )
        directions = ahead + at[:, None] * right - at[:, None, None] * up
        directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
        expected = np.maximum(radiance(light, files.turned(directions.reshape(-1, 3))), 0)
        head, data = fields["images"][index]["uri"].split(",")
        assert head == "data:image/png;base64"
        data = base64.b64decode(data)
        assert data in binary
        with Image.open(io.BytesIO(data)) as picture:
            pixels = np.asarray(picture).reshape(-1, 4) / 255
        assert pixels.shape == (256, 4)
        got = pixels[:, :3] ** 2.2 / pixels[:, 3:]
        # Bytes of a curve: 1 % of the largest channel.
        assert np.abs(got - expected).max() < 0.01 * expected.max()
