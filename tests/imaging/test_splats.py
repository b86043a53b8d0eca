"""Splats: the original's order of properties and its colors, to the last bit there and back."""

import warnings

import jax.numpy as jnp
import numpy as np
import pytest
import splat_files as files
from scipy.spatial.transform import Rotation

from jaxsh.imaging import Splats, read_splats, write_splats

EYE = np.array([0.3, -0.2, 5.0])
SIGNS = np.array([1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1])
# Our axes over the file's.
TURNS = {
    "z": np.eye(3),
    "y": np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]),
    "-y": np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]),
}


def color(splats, eye) -> np.ndarray:
    """The formula of `Splats`, in NumPy: our basis is the original's with the signs undone."""
    ahead = np.asarray(splats.positions, np.float64) - eye
    ahead = ahead / np.linalg.norm(ahead, axis=1, keepdims=True)
    k = splats.coefficients.shape[2]
    basis = (files.basis(ahead) * SIGNS)[:, :k]
    return np.maximum(np.einsum("nk,nck->nc", basis, np.asarray(splats.coefficients)) + 0.5, 0)


@pytest.mark.parametrize("degree", [0, 1, 3])
def test_a_renderer_shows_the_same_colors_however_it_is_turned(tmp_path, degree):
    values = files.table(7, degree)
    path = tmp_path / "a.ply"
    path.write_bytes(files.ply(values, files.names(degree)))
    expected = files.colors(values, degree, EYE)
    for up, turn in TURNS.items():
        splats = read_splats(path, up=up)
        assert splats.coefficients.shape == (7, 3, (degree + 1) ** 2)
        np.testing.assert_allclose(color(splats, turn @ EYE), expected, rtol=0, atol=3e-7)
        axes = Rotation.from_quat(values[:, [-3, -2, -1, -4]]).as_matrix()
        ours = np.asarray(splats.rotations)[:, [1, 2, 3, 0]]
        got = Rotation.from_quat(ours).as_matrix()
        np.testing.assert_allclose(got, turn @ axes, rtol=0, atol=3e-7)
        np.testing.assert_array_equal(splats.positions, values[:, :3] @ turn.T)
        np.testing.assert_array_equal(splats.opacities, values[:, -8])
        np.testing.assert_array_equal(splats.scales, values[:, -7:-4])


def test_what_is_read_is_written_back_to_the_last_bit(tmp_path):
    """Also numbers that XLA takes for zero, zeros with a sign, and an opacity of one."""
    values = files.table(5, 3)
    values[0, 6:20] = [1e-42, -1e-44, 0.0, -0.0, 3e38, *[-1e-40] * 9]
    values[1, -8] = np.inf
    data = files.ply(values, files.names(3))
    (tmp_path / "a.ply").write_bytes(data)
    path = write_splats(tmp_path / "new" / "b.ply", read_splats(tmp_path / "a.ply"))
    assert path.read_bytes() == data
    for up in ("y", "-y"):
        splats = read_splats(tmp_path / "a.ply", up=up)
        again = read_splats(write_splats(tmp_path / "c.ply", splats, up=up))
        np.testing.assert_array_equal(again.positions, values[:, :3])
        expected = files.features(values[1:], 3).transpose(0, 2, 1) * SIGNS
        np.testing.assert_allclose(again.coefficients[1:], expected, rtol=0, atol=6e-7)
        np.testing.assert_allclose(again.rotations, values[:, -4:], rtol=0, atol=5e-7)


def test_other_kinds_of_numbers_and_of_splats(tmp_path):
    values = files.table(4, 1)
    path = tmp_path / "a.ply"
    path.write_bytes(files.ply(values, files.names(1)))
    single = read_splats(path)
    assert single.coefficients.dtype == jnp.float32
    path.write_bytes(files.ply(values.astype(np.float64), files.names(1), "double"))
    double = read_splats(path)
    assert double.coefficients.dtype == jnp.float64
    assert write_splats(tmp_path / "b.ply", double).read_bytes().count(b"double") == 26 - 3
    path.write_bytes(files.text(values, files.names(1)))
    again = read_splats(path)
    for one in (double, again):
        np.testing.assert_array_equal(one.coefficients, single.coefficients)
    # Discs have two scales; a cloud of colors has none of the rest.
    flat = Splats(single.positions, single.coefficients, scales=single.scales[:, :2])
    back = read_splats(write_splats(path, flat))
    assert back.scales.shape == (4, 2)
    assert back.opacities is None
    assert back.rotations is None
    none = Splats(*(one[:0] for one in (single.positions, single.coefficients)))
    assert read_splats(write_splats(path, none)).coefficients.shape == (0, 3, 4)
    order = np.random.default_rng(0).permutation(len(files.names(1)))
    shuffled = values[:, order], [files.names(1)[i] for i in order]
    path.write_bytes(files.ply(*shuffled))
    np.testing.assert_array_equal(read_splats(path).coefficients, single.coefficients)


def test_what_is_left_out_is_said(tmp_path):
    values, path = files.table(3, 0), tmp_path / "a.ply"
    more = "element chunk 0\nproperty float a\n"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        path.write_bytes(files.ply(values, files.names(0), more=more))
        read_splats(path)
    values[1, 4] = 1.0
    path.write_bytes(files.ply(values, [*files.names(0)[:-1], "label"]).replace(b"rot_", b"tor_"))
    with pytest.warns(
        UserWarning, match=r"a\.ply: properties ignored \(ny tor_0 tor_1 tor_2 label\)"
    ):
        read_splats(path)


def replaced(old: str, new: str):
    return lambda data: data.replace(old.encode(), new.encode(), 1)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda data: data[:-1], "it announces 3 rows of 'vertex', which take"),
        (lambda data: data[:200], "its header is not whole"),
        (replaced("ply", "plo"), "it does not begin with 'ply'"),
        (replaced("f_dc_1", "f_de_1"), "it holds no splats, which are vertices with x, y, z and"),
        (replaced("f_rest_8", "g_rest_8"), "it has 8 properties f_rest, expected 0, 9, 24, 45"),
        (replaced("f_rest_8", "f_rest_9"), "it has 9 properties f_rest, but no number f_rest_8"),
        (replaced("rot_3", "rat_3"), "it has 3 properties scale and 3 rot, expected 3 and 4"),
        (lambda data: data[:-4] + b"\0\0\xc0\x7f", "1 of 12 numbers of its rotations are NaN"),
    ],
)
def test_a_fault_is_named(tmp_path, change, expected):
    path = tmp_path / "a.ply"
    path.write_bytes(change(files.ply(files.table(3, 1), files.names(1))))
    with pytest.raises(ValueError, match=rf"a\.ply: {expected}"):
        read_splats(path)


def test_what_is_no_splat_is_not_written(tmp_path, unchecked):
    positions = jnp.zeros((3, 3))
    path = tmp_path / "a.ply"
    for splats, expected in (
        (Splats(positions, jnp.zeros((3, 3, 36))), "its degree is 5, and a file holds 4"),
        (Splats(positions, jnp.full((3, 3, 1), jnp.nan)), "9 of 9 numbers of its coefficients"),
    ):
        with pytest.raises(ValueError, match=rf"a\.ply: cannot be written: {expected}"):
            write_splats(path, splats)
    good = Splats(positions, jnp.zeros((3, 3, 1)))
    with pytest.raises(ValueError, match=r"a\.obj: cannot write \.obj, only \.ply"):
        write_splats(tmp_path / "a.obj", good)
    with pytest.raises(ValueError, match="up must be one of z, y, -y, got 'x'"):
        write_splats(path, good, up="x")
    with pytest.raises(FileNotFoundError, match=r"b\.ply: there is no such file of splats"):
        read_splats(tmp_path / "b.ply")
    assert not list(tmp_path.iterdir())
