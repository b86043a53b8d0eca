"""The same files read by packages that have nothing of ours in them, and what both should agree in.

A mesh is its area and its bounds, a picture the means of its channels, a transfer the sums of its
arrays. Damaged meshes are read in many ways, so a mesh counts as misread where two packages agree
with each other and not with us.
"""

import io
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
from fuzz_files import LIGHTS, MESHES, PICTURES
from fuzz_pictures import CODES

Summary = np.ndarray


def of_triangles(triangles: np.ndarray) -> Summary | None:
    """Give area, lowest and highest corner of triangles (n, 3, 3); None for none, or NaN."""
    triangles = np.asarray(triangles, np.float64)
    if not triangles.size or not np.isfinite(triangles).all():
        return None
    edges = np.diff(triangles, axis=1)
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1).sum() / 2
    corners = triangles.reshape(-1, 3)
    return np.array([area, *corners.min(axis=0), *corners.max(axis=0)])


def summary(kind: str, result) -> Summary | None:
    """Sum up what our reader gave."""
    if kind in MESHES:
        vertices = np.asarray(result.vertices, np.float64) + np.array(result.origin)
        if kind in ("glb", "gltf"):  # in the file's axes
            vertices = vertices[:, [0, 2, 1]] * [1, 1, -1]
        return of_triangles(vertices[np.asarray(result.faces)])
    if kind in PICTURES:
        return np.asarray(result, np.float64).mean(axis=(0, 1))
    if kind in LIGHTS:
        light = np.asarray(result.coefficients if kind == "splats.ply" else result, np.float64)
        return light.reshape(-1, light.shape[-1]).mean(axis=0)
    names = ("coefficients", "positions", "normals", "neighbors")
    return np.array([np.asarray(getattr(result, name), np.float64).sum() for name in names])


def _by_trimesh(path: Path) -> Summary | None:
    import trimesh

    loaded = trimesh.load(path, process=False)
    parts = loaded.dump() if isinstance(loaded, trimesh.Scene) else [loaded]
    meshes = [part for part in parts if isinstance(part, trimesh.Trimesh)]
    return of_triangles(np.concatenate([one.vertices[one.faces] for one in meshes]))


def _by_assimp(path: Path) -> Summary | None:
    import assimp_py

    scene = assimp_py.import_file(
        str(path), assimp_py.Process_Triangulate | assimp_py.Process_PreTransformVertices
    )
    triangles = []
    for one in scene.meshes:
        indices = np.asarray(one.indices).reshape(-1)
        if len(indices) == 3 * one.num_faces:  # no points and lines
            vertices = np.asarray(one.vertices).reshape(-1, 3)
            triangles.append(vertices[indices].reshape(-1, 3, 3))
    return of_triangles(np.concatenate(triangles))


def _by_openexr(path: Path) -> Summary | None:
    import OpenEXR

    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = file.channels()
        return np.array([np.asarray(channels[c].pixels, np.float64).mean() for c in "RGB"])


def _by_openimageio(path: Path) -> Summary | None:
    import OpenImageIO as oiio

    picture = oiio.ImageBuf(str(path))
    pixels = picture.get_pixels(oiio.FLOAT)
    if picture.geterror() or pixels is None:  # asked for, or it is printed at the end
        return None
    return np.broadcast_to(pixels, (*pixels.shape[:2], 3)).astype(np.float64).mean(axis=(0, 1))


def _by_pfm_lines(path: Path) -> Summary | None:
    """Take the numbers of a PFM whose header is three lines, and leave its scale out."""
    kind, size, scale, numbers = path.read_bytes().split(b"\n", 3)
    width, height = map(int, size.split())
    channels = {b"PF": 3, b"Pf": 1}[kind.strip()]
    order = "<f4" if float(scale) < 0 else ">f4"
    pixels = np.frombuffer(numbers, order, width * height * channels).reshape(-1, channels)
    return np.broadcast_to(pixels, (width * height, 3)).astype(np.float64).mean(axis=0)


def _by_pillow(path: Path) -> Summary | None:
    from PIL import Image

    with Image.open(path) as image:
        if image.getexif().get(274, 1) != 1 or image.mode not in ("RGB", "RGBA", "L", "LA", "P"):
            return None
        if image.format == "TIFF" and 262 not in getattr(image, "tag_v2", {}):
            return None  # it does not say whether 0 is black, as it must
        share = np.asarray(image.convert("RGB")) / 255
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return linear.mean(axis=(0, 1))


def _by_numpy(path: Path) -> Summary | None:
    pixels = np.load(path, allow_pickle=False).astype(np.float64)
    pixels = pixels[..., None] if pixels.ndim == 2 else pixels
    return np.broadcast_to(pixels, (*pixels.shape[:2], 3)).mean(axis=(0, 1))


def _by_numpy_zip(path: Path) -> Summary | None:
    with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as file:
        names = ("coefficients", "positions", "normals", "neighbors")
        return np.array([file[name].astype(np.float64).sum() for name in names])


_MESHES = {"trimesh": _by_trimesh, "assimp": _by_assimp}
PEERS: dict[str, dict[str, Callable[[Path], Summary | None]]] = {
    **dict.fromkeys(MESHES, _MESHES),
    "hdr": {"OpenImageIO": _by_openimageio},
    "exr": {"OpenEXR": _by_openexr},
    "pfm": {"NumPy": _by_pfm_lines},
    "npy": {"NumPy": _by_numpy},
    "mtl": {},
    **{kind: {"Pillow": _by_pillow} for kind in CODES},
    "npz": {"NumPy": _by_numpy_zip},
    **{kind: {} for kind in LIGHTS},
}


def missing(kind: str) -> list[str]:
    """Name the packages that a format wants as peers and that are not there."""
    modules = {"trimesh": "trimesh", "assimp": "assimp_py", "OpenEXR": "OpenEXR"}
    modules |= {"OpenImageIO": "OpenImageIO", "NumPy": "numpy", "Pillow": "PIL"}
    found = []
    for name in PEERS[kind]:
        try:
            __import__(modules[name])
        except ImportError:
            found.append(modules[name])
    return found


def _flat(kind: str, path: Path) -> bool:
    """Tell whether all polygons lie in planes and pass each point once.

    Others have an area for each way to cut them, or are cut wrongly by others.
    """
    from jaxsh.geometry._read import _PARSERS

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        polygons = _PARSERS[f".{kind}"](path, path.read_bytes())
    ends = np.cumsum(polygons.sizes)
    for start, end in zip(ends - polygons.sizes, ends, strict=True):
        ring = polygons.positions[polygons.corners[start:end]]
        if len(np.unique(ring, axis=0)) < len(ring):
            return False
        ring = ring - ring.mean(axis=0)
        extents = np.linalg.svd(ring, compute_uv=False)
        if end - start > 3 and extents[2] > 1e-4 * extents[1]:
            return False
    return True


def _agree(one: Summary, other: Summary, share: float) -> bool:
    size = max(np.abs(one).max(), np.abs(other).max(), 1e-30)
    return bool(np.abs(one - other).max() <= share * size)


def disagreement(kind: str, path: Path, ours: Summary) -> str | None:
    """Say how a file is read elsewhere, where that is not how we read it; None where we agree."""
    theirs = {}
    for name, read in PEERS[kind].items():
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                found = read(path)
        except Exception:  # what it cannot read is no matter here
            found = None
        if found is not None and np.isfinite(found).all():
            theirs[name] = found
    wanted = 2 if kind in MESHES else 1
    share = 0.02 if kind == "jpg" else 1e-4  # decoders of JPEG differ by a code here and there
    if len(theirs) < wanted or any(_agree(ours, one, share) for one in theirs.values()):
        return None
    if kind in ("obj", "ply", "off") and not _flat(kind, path):
        return None
    first = next(iter(theirs.values()))
    if not all(_agree(first, one, share) for one in theirs.values()):
        return None
    return f"read as {ours.tolist()}, but as {first.tolist()} by {' and '.join(theirs)}"
