"""Transfer files: what is written is read, and what is not a transfer is refused."""

import dataclasses

import equinox as eqx
import hypothesis.strategies as st
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given

from jaxsh.transfer import Transfer, load, save


def transfer(vertices=7, width=9, dtype=np.float32):
    rng = np.random.default_rng(vertices)
    return Transfer(
        coefficients=jnp.asarray(rng.normal(size=(vertices, width)), dtype),
        positions=jnp.asarray(rng.normal(size=(vertices, 3)), dtype),
        normals=jnp.asarray(rng.normal(size=(vertices, 3)), dtype),
        neighbors=jnp.asarray(rng.integers(vertices, size=(vertices, 5)), np.int32),
    )


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return save(tmp_path_factory.mktemp("transfer") / "whole", transfer()).read_bytes()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", ["a.npz", "b.transfer", "deep/er/c"])
def test_a_file_gives_back_every_bit(tmp_path, dtype, name):
    given = transfer(dtype=dtype)
    path = save(tmp_path / name, given)
    assert path == tmp_path / name
    assert eqx.tree_equal(load(str(path)), given)
    assert [file.name for file in path.parent.iterdir()] == [path.name]
    np.testing.assert_array_equal(np.load(path)["coefficients"], given.coefficients)


def test_a_file_says_what_its_points_are(tmp_path):
    volume = dataclasses.replace(transfer(), surface="points", cosine=False)
    path = save(tmp_path / "a", volume)
    assert eqx.tree_equal(load(path), volume)
    assert np.load(path)["version"] == 2
    assert np.load(save(path, transfer()))["version"] == 1  # which older versions read


def test_a_file_is_replaced_only_by_a_whole_one(tmp_path, monkeypatch):
    path = save(tmp_path / "a", transfer())
    save(path, transfer(11))
    assert len(load(path).coefficients) == 11

    def full(*_, **__):
        raise OSError("no space left on device")

    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(OSError, match="no space left"):
        save(path, transfer())
    assert len(load(path).coefficients) == 11
    assert [file.name for file in tmp_path.iterdir()] == ["a"]


def test_a_folder_is_no_file(tmp_path):
    with pytest.raises(FileNotFoundError, match="a folder, not a transfer file: open reads stores"):
        load(tmp_path)


def test_a_truncated_file_is_refused_at_every_length(tmp_path, whole):
    path = tmp_path / "short"
    for length in [*range(0, len(whole), 13), len(whole) - 1]:
        path.write_bytes(whole[:length])
        with pytest.raises(ValueError, match=r"short: (not a transfer file|damaged)"):
            load(path)


@given(data=st.data())
def test_a_changed_byte_is_refused_or_was_none(tmp_path_factory, whole, data):
    path = tmp_path_factory.getbasetemp() / "changed"
    changed = bytearray(whole)
    for _ in range(data.draw(st.integers(1, 4))):
        changed[data.draw(st.integers(0, len(whole) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(changed)
    try:
        read = load(path)
    except ValueError as error:
        problem = str(error)
    else:  # a byte that says nothing, such as a date
        assert eqx.tree_equal(read, transfer())
        return
    assert problem.startswith(f"{path}: ")


@given(content=st.binary(max_size=300))
def test_random_bytes_are_refused(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "random"
    path.write_bytes(content)
    with pytest.raises(ValueError, match="random: not a transfer file"):
        load(path)


def rewritten(path, **changes):
    arrays = {name: np.asarray(getattr(transfer(), name)) for name in Transfer.__annotations__}
    arrays |= {"format": np.array("jaxsh transfer"), "version": np.array(1)} | changes
    with path.open("wb") as file:
        np.savez(file, **{name: array for name, array in arrays.items() if array is not None})
    return path


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"version": np.array(3)}, "written as version 3, but this jaxsh reads 1 and 2"),
        ({"version": np.array(2), "surface": None}, "damaged: surface must be one of vertices"),
        ({"version": np.array(2), "surface": np.array("sea")}, "damaged: surface must be one of"),
        ({"version": np.array(2), "cosine": np.array(1)}, "damaged: cosine has dtype int64"),
        ({"version": np.array("new")}, "written as version new"),
        ({"format": np.array("pictures")}, "not a transfer file"),
        ({"format": None}, "not a transfer file"),
        ({"normals": None}, "damaged: it holds no normals"),
        ({"coefficients": np.zeros((7, 8))}, "damaged: .* got 8"),
        ({"coefficients": np.zeros((6, 9))}, "damaged: positions or normals are not"),
        ({"coefficients": np.zeros((7, 9), int)}, "damaged: coefficients have dtype int64"),
        ({"neighbors": np.full((7, 2), 7)}, "damaged: neighbors do not name vertices 0 to 6"),
        ({"neighbors": np.array([{}], object)}, "damaged: it holds Python objects, not numbers"),
        ({"version": np.zeros((99, 9))}, r"written as version \[\[0\. [^\n]{,80}, but this jaxsh"),
        ({"normals": np.full((7, 3), np.nan)}, "damaged: 21 of 21 normals are NaN or infinite"),
        ({"positions": np.ones((7, 3), "c8")}, "damaged: positions have dtype complex64"),
    ],
)
def test_other_archives_are_refused(tmp_path, changes, message):
    path = rewritten(tmp_path / "a.npz", **changes)
    with pytest.raises(ValueError, match=rf"a\.npz: {message}"):
        load(path)


def test_a_small_file_does_not_unpack_into_a_large_one(tmp_path):
    path = tmp_path / "a.npz"
    with path.open("wb") as file:
        np.savez_compressed(file, format="jaxsh transfer", coefficients=np.zeros((5_000_000, 4)))
    with pytest.raises(ValueError, match=r"a\.npz: damaged: it unpacks to 160000\d+ bytes out of"):
        load(path)


def test_a_directory_that_announces_too_much_asks_for_no_memory(tmp_path, whole):
    path = tmp_path / "a.npz"
    entry = whole.index(b"PK\1\2")  # of the first file; its packed size is 20 bytes on
    path.write_bytes(whole[: entry + 20] + b"\xf0\xff\xff\x7f" + whole[entry + 24 :])
    with pytest.raises(ValueError, match=r"a\.npz: damaged: its directory announces more than"):
        load(path)


def test_other_orders_of_bytes_are_read(tmp_path):
    given = np.asarray(transfer().normals)
    path = rewritten(tmp_path / "a.npz", normals=given.astype(">f4"))
    np.testing.assert_array_equal(load(path).normals, given)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"gone: there is no such transfer file"):
        load(tmp_path / "gone")


def test_what_is_no_transfer_is_not_written(unchecked, tmp_path):
    wrong = eqx.tree_at(lambda t: t.normals, transfer(), jnp.zeros((6, 3)))
    with pytest.raises(ValueError, match="cannot be written: positions or normals"):
        save(tmp_path / "a", wrong)
    assert not (tmp_path / "a").exists()


def test_doubles_become_floats_without_x64(tmp_path):
    path = save(tmp_path / "a", transfer(dtype=np.float64))
    with jax.enable_x64(False):
        assert load(path).coefficients.dtype == np.float32
        large = rewritten(tmp_path / "b", coefficients=np.full((7, 9), 1e39))
        with pytest.raises(ValueError, match="b: damaged: 63 of 63 coefficients are NaN or inf"):
            load(large)


def test_a_folder_is_no_file_to_write(unchecked, tmp_path):
    with pytest.raises(IsADirectoryError, match="cannot be written: it is a folder"):
        save(tmp_path, transfer())
    with pytest.raises(TypeError, match="expected path as a string or a path, got ''"):
        save("", transfer())
