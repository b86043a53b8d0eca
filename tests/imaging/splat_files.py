"""Splat files in the order of the original `save_ply`, and the color that its renderer gives."""

import numpy as np

# Real harmonics with the sign (-1)^m as 3D Gaussian splatting evaluates them, by their constants.
C0, C1 = 0.28209479177387814, 0.4886025119029199
C2 = (1.0925484305920792, 0.31539156525252005, 0.5462742152960396)
C3 = (0.5900435899266435, 2.890611442640554, 0.4570457994644658, 0.3731763325901154)


def basis(d: np.ndarray) -> np.ndarray:
    """(n, 16) for unit directions (n, 3)."""
    x, y, z = d.T
    xx, yy, zz = x * x, y * y, z * z
    rows = [C0 + 0 * x, -C1 * y, C1 * z, -C1 * x]
    rows += [C2[0] * x * y, -C2[0] * y * z, C2[1] * (2 * zz - xx - yy), -C2[0] * x * z]
    rows += [C2[2] * (xx - yy)]
    rows += [-C3[0] * y * (3 * xx - yy), C3[1] * x * y * z, -C3[2] * y * (4 * zz - xx - yy)]
    rows += [C3[3] * z * (2 * zz - 3 * xx - 3 * yy), -C3[2] * x * (4 * zz - xx - yy)]
    rows += [C3[1] / 2 * z * (xx - yy), -C3[0] * x * (xx - 3 * yy)]
    return np.stack(rows, axis=1)


def names(degree: int) -> list[str]:
    rest = 3 * ((degree + 1) ** 2 - 1)
    return [
        *("x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"),
        *(f"f_rest_{i}" for i in range(rest)),
        *("opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"),
    ]


def table(count: int, degree: int, seed: int = 0) -> np.ndarray:
    """Random values of all properties (count, number of them), float32, normals zero."""
    values = np.random.default_rng(seed).normal(size=(count, len(names(degree))))
    values[:, 3:6] = 0
    return values.astype(np.float32)


def ply(values: np.ndarray, properties: list[str], kind: str = "float", more: str = "") -> bytes:
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(values)}"]
    lines += [f"property {kind} {name}" for name in properties]
    return ("\n".join(lines) + f"\n{more}end_header\n").encode() + values.tobytes()


def text(values: np.ndarray, properties: list[str]) -> bytes:
    head = ply(values[:0], properties).replace(b"binary_little_endian", b"ascii")
    head = head.replace(b"vertex 0", f"vertex {len(values)}".encode())
    return head + "".join(" ".join(map(repr, row)) + "\n" for row in values.tolist()).encode()


def features(values: np.ndarray, degree: int) -> np.ndarray:
    """The (n, K, 3) that `load_ply` makes of a table."""
    count = (degree + 1) ** 2
    rest = values[:, 9 : 9 + 3 * (count - 1)].reshape(len(values), 3, count - 1)
    return np.concatenate([values[:, 6:9, None], rest], axis=2).transpose(0, 2, 1)


def colors(values: np.ndarray, degree: int, eye: np.ndarray) -> np.ndarray:
    """The color of each splat from an eye, in the axes of the file."""
    ahead = values[:, :3] - eye
    ahead = ahead / np.linalg.norm(ahead, axis=1, keepdims=True)
    held = features(values.astype(np.float64), degree)
    return np.maximum(np.einsum("nk,nkc->nc", basis(ahead)[:, : held.shape[1]], held) + 0.5, 0)
