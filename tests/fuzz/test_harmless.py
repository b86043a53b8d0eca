"""Changes that mean nothing: the same mesh, picture or transfer is read, without a warning."""

import io
import json
import zlib

import numpy as np
import pytest
from fuzz_archives import compressed_archive
from fuzz_files import put_beside, seeds
from fuzz_peers import summary
from fuzz_readers import check


def to(end):
    return lambda data: data.replace(b"\n", end)


def before_lines(what):
    return lambda data: what + data.replace(b"\n", b"\n" + what)


def behind_lines(what):
    return lambda data: data.replace(b"\n", what + b"\n")


def line(number, text):
    """Put a line in."""

    def change(data):
        lines = data.split(b"\n")
        return b"\n".join([*lines[:number], text, *lines[number:]])

    return change


def in_header(old, new):
    return lambda data: data.replace(old, new, 1)


def chunk(data):
    """Append a chunk of unknown kind to a GLB, as the specification lets one do."""
    new = data + b"\4\0\0\0ABCDabcd"
    return new[:8] + len(new).to_bytes(4, "little") + new[12:]


def tree(change):
    """Change the JSON of a GLB, and its padding with it."""

    def changed(data):
        size = int.from_bytes(data[12:16], "little")
        content = json.loads(data[20 : 20 + size])
        change(content)
        text = json.dumps(content, indent=1, ensure_ascii=False).encode()
        text += b" " * (-len(text) % 4 + 8)
        new = len(text).to_bytes(4, "little") + b"JSON" + text + data[20 + size :]
        return b"glTF\2\0\0\0" + (12 + len(new)).to_bytes(4, "little") + new

    return changed


def version_2(data):
    """The header of a .npy file with a longer field for its own length."""
    size = int.from_bytes(data[8:10], "little")
    return data[:6] + b"\2\0" + size.to_bytes(4, "little") + data[10:]


def repacked(data):
    import zipfile

    with zipfile.ZipFile(io.BytesIO(data)) as file:
        members = {name: file.read(name) for name in reversed(file.namelist())}
    return compressed_archive(members | {"more.npy": b"anything"}, {})


def png_text(data):
    """Put a comment into a PNG."""
    body = b"tEXtComment\0\xe9"
    new = (len(body) - 4).to_bytes(4, "big") + body + zlib.crc32(body).to_bytes(4, "big")
    return data[:33] + new + data[33:]


TEXT = {
    "CR LF": to(b"\r\n"),
    "CR": to(b"\r"),
    "blanks behind": behind_lines(b" \t "),
    "no last line end": lambda data: data.rstrip(b"\n"),
    "blank lines at the end": lambda data: data + b"\n\n  \n",
}
LOOSE = {
    "blanks before": before_lines(b"  \t"),
    "blank lines": to(b"\n\n"),
    "tabs": lambda data: data.replace(b" ", b"\t"),
    "many blanks": lambda data: data.replace(b" ", b"    "),
    "byte-order mark": lambda data: b"\xef\xbb\xbf" + data,
}
HASH = {
    "comments": before_lines(b"# 1 2 3 \xff\n"),
    "comments behind": behind_lines(b" # f 1 2 3"),
}
NUMBERS = {
    "plus signs": lambda data: data.replace(b" 0.5", b" +0.5"),
    "exponents": lambda data: data.replace(b" 0.5", b" 5.0E-01"),
    "more digits": lambda data: data.replace(b" 0.5", b" 0.5000000000000000000000000000001"),
    "bare points": lambda data: data.replace(b" 0.5", b" .5"),
}
# (format, which seed) -> changes
HARMLESS = {
    ("obj", 0): TEXT | LOOSE | HASH | NUMBERS | {
        "continued lines": lambda data: data.replace(b"f 6", b"f \\\n 6"),
        "a fourth coordinate": lambda data: data.replace(b"v 0 0 0\n", b"v 0 0 0 1\n"),
        "names of any text": line(3, "o \U0001f4a1 f 1 2 3 \u2028 v".encode()),
        "UTF-16": lambda data: data.decode().encode("utf-16"),
    },
    ("off", 0): TEXT | LOOSE | HASH | NUMBERS | {
        "counts on the first line": in_header(b"OFF\n", b"OFF "),
        "counts glued on": in_header(b"OFF\n", b"OFF"),
        "two counts": in_header(b"12 8 18", b"12 8"),
    },
    ("stl", 1): TEXT | LOOSE | NUMBERS | {
        "upper case": bytes.upper,
        "normals that are none": in_header(b"normal 0 0 -1", b"normal nan -nan(ind) 1.#IND"),
        "a name of any text": in_header(b"solid one", "solid facet \U0001f4a1 endsolid".encode()),
    },
    ("stl", 0): {"a header that begins with solid": lambda data: b"solid" + data[5:]},
    ("ply", 0): TEXT | NUMBERS | {
        "comments": in_header(
            b"element", b"comment format binary_little_endian 1.0\ncomment end_header\nelement"
        ),
        "other names of types": lambda data: (
            data.replace(b"float", b"float32").replace(b"uchar", b"uint8")
        ),
        "another name of the list": in_header(b"vertex_indices", b"vertex_index"),
    },
    ("ply", 1): {
        "comments": in_header(b"element", b"comment format ascii 1.0\nelement"),
        "CR LF in the header": lambda data: (
            data.split(b"end_header\n")[0].replace(b"\n", b"\r\n") + b"end_header\r\n"
            + data.split(b"end_header\n")[1]
        ),
    },
    ("glb", 1): {
        "an unknown chunk": chunk,
        "spaces and order": tree(lambda json: json.update(asset=json.pop("asset"))),
        "extras": tree(lambda json: json["nodes"][0].update(
            extras={"mesh": [None, "é"]}, name="\U0001f4a1")),
        "an unknown extension in use": tree(lambda json: json.update(
            extensionsUsed=["VENDOR_x"], extensions={"VENDOR_x": {}})),
    },
    ("hdr", 1): {
        "CR LF": lambda data: (
            data.split(b"\n\n")[0].replace(b"\n", b"\r\n") + b"\r\n\r\n" + data.split(b"\n\n", 1)[1]
        ),
        "another first line": in_header(b"#?RADIANCE", b"#?RGBE"),
        "no format": in_header(b"FORMAT=32-bit_rle_rgbe\n", b""),
        "more of the header": in_header(b"EXPOSURE", b"VIEW=-vtv\nSOFTWARE=\xe9\nEXPOSURE"),
    },
    ("pfm", 0): {
        "CR LF": lambda data: data[:15].replace(b"\n", b"\r\n") + data[15:],
        "a comment": in_header(b"PF\n", b"PF\n# made by hand\n"),
        "one line": lambda data: data[:7].replace(b"\n", b" ") + data[7:],
    },
    ("npy", 0): {"version 2": version_2, "padding": lambda data: data + bytes(16)},
    ("png", 0): {"a comment": png_text},
    ("gltf", 0): {"spaces": to(b" \n"), "byte-order mark": lambda data: b"\xef\xbb\xbf" + data},
    ("npz", 0): {"packed, in another order, with more": repacked},
}  # fmt: skip
CASES = [(*key, name) for key, changes in HARMLESS.items() for name in changes]


@pytest.mark.parametrize(("kind", "which", "name"), CASES)
def test_what_means_nothing_changes_nothing(tmp_path, kind, which, name):
    path = tmp_path / f"a.{kind}"
    put_beside(path)
    read = []
    for data in (seeds(kind)[which], HARMLESS[kind, which][name](seeds(kind)[which])):
        path.write_bytes(data)
        result, warned = check(kind, path)
        assert result is not None
        assert not warned
        read.append(summary(kind, result))
    np.testing.assert_allclose(*read, rtol=0, atol=1e-9)
