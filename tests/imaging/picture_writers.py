"""Picture files for tests, of what our own writer does not write."""

import numpy as np
import OpenImageIO as oiio

from jaxsh.imaging import write_image


def spec_of(pixels, names=None, kind="float", **attributes):
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    if names:
        spec.channelnames = tuple(names)
    for key, value in attributes.items():
        if key == "chromaticities":
            spec.attribute(key, oiio.TypeDesc("float[8]"), value)
        elif hasattr(spec, key):
            setattr(spec, key, value)
        else:
            spec.attribute(key.replace("__", ":"), value)
    return spec


def save(path, pixels, names=None, kind="float", **attributes):
    """Write any channels, as our own writer would not."""
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec_of(pixels, names, kind, **attributes)), out.geterror()
    assert out.write_image(np.ascontiguousarray(pixels))
    assert out.close()
    return path


def pfm(pixels, kind=b"PF", scale=b"-1.0", order="<f4") -> bytes:
    height, width = pixels.shape[:2]
    return b"%s\n%d %d\n%s\n" % (kind, width, height, scale) + pixels[::-1].astype(order).tobytes()


def encoded(folder, suffix: str) -> bytes:
    """Give a small picture as a file of a format."""
    pixels = np.random.default_rng(5).uniform(0, 4, size=(8, 16, 3)).astype(np.float32)
    path = folder / f"whole{suffix}"
    if suffix == ".pfm":
        return pfm(pixels)
    if suffix == ".npy":
        np.save(path, pixels)
        return path.read_bytes()
    return write_image(path, pixels).read_bytes()
