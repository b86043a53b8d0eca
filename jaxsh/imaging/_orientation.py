"""Orientation of a picture's own axes in ours."""

import numpy as np
from jaxtyping import Float

# For each layout and orientation, where the picture's right, up and center ("forward") land.
# For the cube, where the x, y and z of its face table land.
#
# Right-handed y-up axes are turned like the vertices of `read_mesh(path, up="y")`, (x, y, z) ->
# (x, -z, y), so that a scene's light and meshes stay together. Sources:
# - mitsuba: Mitsuba 3, `direction_to_uv` in src/emitters/envmap.cpp: y up, center +z, right -x
# - nvdiffrec: `latlong_to_cubemap` in render/util.py: y up, center -z, right +x; also the lat-long
#   files of the USC high-resolution light probe page
# - blender: `direction_to_equirectangular` in Cycles' kernel: z up as here, center +x, right -y
# - openexr: OpenEXR's ImfEnvmap: lat-long as mitsuba; its cube is the face table in axes with z
#   turned round, so that the fifth and sixth face change places (`_layouts`)
# - -z, +z: the text and the formula of Debevec's light probe gallery, which do not agree
# - opengl, direct3d: the same face table in right-handed and in left-handed y-up axes
_DEBEVEC = {"jaxsh": "+y +z -x", "-z": "+x +z +y", "+z": "+x +z -y"}
_LANDS = {
    "lat-long": {
        "jaxsh": "-y +z -x",
        "debevec": "+y +z -x",
        "mitsuba": "-x +z -y",
        "blender": "-y +z +x",
        "nvdiffrec": "+x +z +y",
        "openexr": "-x +z -y",
    },
    "angular-map": _DEBEVEC,
    "horizontal-cross": _DEBEVEC,
    "vertical-cross": _DEBEVEC,
    "cube": {
        "jaxsh": "+x +y +z",
        "direct3d": "+y +z -x",
        "opengl": "+x +z -y",
        "openexr": "+x +z +y",
    },
}

LAYOUTS = tuple(_LANDS)


def axes_of(layout: str, orientation: str | None) -> Float[np.ndarray, "3 3"]:
    """Look up, row by row, where the picture's first, second and third axis land in ours."""
    orientation = "jaxsh" if orientation is None else orientation
    if layout not in _LANDS:
        raise ValueError(f"layout must be one of {LAYOUTS}, got {layout!r}")
    if orientation not in _LANDS[layout]:
        known = tuple(_LANDS[layout])
        raise ValueError(
            f"orientation must be one of {known} for layout {layout!r}, got {orientation!r}"
        )
    axes = np.zeros((3, 3))
    for row, (sign, name) in enumerate(_LANDS[layout][orientation].split()):
        axes[row, "xyz".index(name)] = int(sign + "1")
    return axes


def check_options(layout: str | None, orientation: str | None) -> None:
    """Refuse what is not known, as far as can be said before the file names its own layout."""
    if layout is not None or orientation not in {o for known in _LANDS.values() for o in known}:
        axes_of(layout or "lat-long", orientation)


def turn_columns(
    image: Float[np.ndarray, "h w 3"], axes: Float[np.ndarray, "3 3"]
) -> Float[np.ndarray, "h w 3"]:
    """Bring the columns of a lat-long picture into our order: flipped, rolled, never resampled.

    A roll by a part of a column, as a quarter turn of an odd number of rows asks for, gives each
    pixel its shares of the two that it overlaps: the integral stays, detail is lost.
    """
    width = image.shape[1]
    right, forward = (np.arctan2(axis[1], axis[0]) for axis in (axes[0], axes[2]))
    # The center, at half the width, goes to φ = forward.
    if np.sin(right - forward) < 0:  # φ falls to the right
        image = image[:, ::-1]
    columns = width * (forward - np.pi) / (2 * np.pi)
    whole = int(np.floor(columns + 1e-6))
    rolled = np.roll(image, whole, axis=1) if whole % width else image
    part = np.float32(columns - whole)
    if part < 1e-3:
        return rolled
    return rolled * (1 - part) + np.roll(rolled, 1, axis=1) * part
