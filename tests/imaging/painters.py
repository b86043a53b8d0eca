"""Pictures of the sphere painted forwards: for each pixel its direction in our axes.

Written from the sources' own formulas, one by one, and not from jaxsh's tables. Pixels that are no
part of a picture have the direction NaN.
"""

import numpy as np

FORWARD, RIGHT, UP = np.array([-1.0, 0, 0]), np.array([0, 1.0, 0]), np.array([0, 0, 1.0])


def from_y_up(x, y, z):
    return np.stack(np.broadcast_arrays(x, -z, y), axis=-1)


def _angles(height, width):
    theta = (np.arange(height)[:, None] + 0.5) * np.pi / height
    return theta, 2 * np.pi * (np.arange(width) + 0.5) / width


def _z_up(theta, phi):
    z = np.cos(theta) + 0 * phi
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), z], axis=-1)


def jaxsh_lat_long(n):
    return _z_up(*_angles(n, 2 * n))


def debevec_lat_long(n):
    theta, turn = _angles(n, 2 * n)
    return _z_up(theta, 2 * np.pi - turn)  # the center at -x, a quarter to its right +y


def mitsuba_lat_long(n):
    # uv_to_direction
    theta, phi = _angles(n, 2 * n)
    return from_y_up(np.sin(phi) * np.sin(theta), np.cos(theta), -np.cos(phi) * np.sin(theta))


def blender_lat_long(n):
    # equirectangular_to_direction, its v running upwards
    theta, turn = _angles(n, 2 * n)
    return _z_up(theta, np.pi - turn)


def nvdiffrec_lat_long(n):
    # cubemap_to_latlong
    theta, turn = _angles(n, 2 * n)
    phi = turn - np.pi
    return from_y_up(np.sin(theta) * np.sin(phi), np.cos(theta), -np.sin(theta) * np.cos(phi))


def _disc(n):
    u = (2 * np.arange(n) + 1) / n - 1
    v = -u[:, None]
    r = np.hypot(u, v)
    angle, alpha = np.where(r <= 1, np.pi * r, np.nan), np.arctan2(v, u)
    return np.sin(angle) * np.cos(alpha), np.sin(angle) * np.sin(alpha), np.cos(angle)


def jaxsh_angular_map(n):
    right, up, forward = _disc(n)
    return np.stack([-forward, right, up], axis=-1)


def minus_z_angular_map(n):
    right, up, forward = _disc(n)
    return from_y_up(right, up, -forward)


def plus_z_angular_map(n):
    return from_y_up(*_disc(n))


def _face(n, outward, right, down):
    step = ((2 * np.arange(n) + 1) / n - 1)[:, None]
    return outward + step * right + step[:, None] * down


def _cross(n, shape, back):
    picture = np.full((shape[0] * n, shape[1] * n, 3), np.nan)
    for (row, column), face in {
        (1, 1): (FORWARD, RIGHT, -UP),
        (1, 0): (-RIGHT, FORWARD, -UP),
        (1, 2): (RIGHT, -FORWARD, -UP),
        (0, 1): (UP, RIGHT, FORWARD),
        (2, 1): (-UP, RIGHT, -FORWARD),
        **back,
    }.items():
        picture[row * n : row * n + n, column * n : column * n + n] = _face(n, *face)
    return picture


def jaxsh_horizontal_cross(n):
    return _cross(n, (3, 4), {(1, 3): (-FORWARD, -RIGHT, -UP)})


def jaxsh_vertical_cross(n):
    return _cross(n, (4, 3), {(3, 1): (-FORWARD, RIGHT, UP)})


def _to_minus_z(picture):
    """From forward -x, right +y to the y-up axes' forward -z, right +x, turned: +y and +x."""
    return np.stack([picture[..., 1], -picture[..., 0], picture[..., 2]], axis=-1)


def minus_z_vertical_cross(n):
    return _to_minus_z(jaxsh_vertical_cross(n))


def plus_z_horizontal_cross(n):
    return _to_minus_z(jaxsh_horizontal_cross(n)) * [1, -1, 1]


# OpenGL 4.6, table 8.19: major axis, s to the right, t downwards.
_TABLE = np.array(
    [
        [(1, 0, 0), (0, 0, -1), (0, -1, 0)],
        [(-1, 0, 0), (0, 0, 1), (0, -1, 0)],
        [(0, 1, 0), (1, 0, 0), (0, 0, 1)],
        [(0, -1, 0), (1, 0, 0), (0, 0, -1)],
        [(0, 0, 1), (1, 0, 0), (0, -1, 0)],
        [(0, 0, -1), (-1, 0, 0), (0, -1, 0)],
    ]
)


def jaxsh_cube(n):
    return np.concatenate([_face(n, *face) for face in _TABLE])


def opengl_cube(n):
    return from_y_up(*np.moveaxis(jaxsh_cube(n), -1, 0))


def direct3d_cube(n):
    x, y, z = np.moveaxis(jaxsh_cube(n), -1, 0)
    return -z[..., None] * [1, 0, 0] + x[..., None] * RIGHT + y[..., None] * UP


def openexr_lat_long(n):
    # ImfEnvmap, LatLongMap::direction: the outermost pixels are on the poles and on the seam
    latitude = -np.pi * (np.arange(n)[:, None] / (n - 1) - 0.5)
    longitude = -2 * np.pi * (np.arange(2 * n) / (2 * n - 1) - 0.5)
    return from_y_up(
        np.sin(longitude) * np.cos(latitude),
        np.sin(latitude),
        np.cos(longitude) * np.cos(latitude),
    )


def openexr_cube(n):
    # CubeMap::direction of a position in a face, and CubeMap::pixelPosition of that position
    picture = np.empty((6, n, n, 3))
    at = np.arange(n)
    x, y = np.meshgrid(at, at, indexing="ij")  # positions in the face
    a, b = 2 * x / (n - 1) - 1, 2 * y / (n - 1) - 1
    one, last = np.ones((n, n)), n - 1
    picture[0, last - x, y] = from_y_up(one, a, b)
    picture[1, last - x, last - y] = from_y_up(-one, a, b)
    picture[2, last - y, x] = from_y_up(a, one, b)
    picture[3, y, x] = from_y_up(a, -one, b)
    picture[4, last - y, last - x] = from_y_up(a, b, one)
    picture[5, last - y, x] = from_y_up(a, b, -one)
    return picture.reshape(6 * n, n, 3)


PAINTERS = {
    ("lat-long", "jaxsh"): jaxsh_lat_long,
    ("lat-long", "debevec"): debevec_lat_long,
    ("lat-long", "mitsuba"): mitsuba_lat_long,
    ("lat-long", "blender"): blender_lat_long,
    ("lat-long", "nvdiffrec"): nvdiffrec_lat_long,
    ("angular-map", "jaxsh"): jaxsh_angular_map,
    ("angular-map", "-z"): minus_z_angular_map,
    ("angular-map", "+z"): plus_z_angular_map,
    ("horizontal-cross", "jaxsh"): jaxsh_horizontal_cross,
    ("horizontal-cross", "+z"): plus_z_horizontal_cross,
    ("vertical-cross", "jaxsh"): jaxsh_vertical_cross,
    ("vertical-cross", "-z"): minus_z_vertical_cross,
    ("cube", "jaxsh"): jaxsh_cube,
    ("cube", "opengl"): opengl_cube,
    ("cube", "direct3d"): direct3d_cube,
    ("lat-long", "openexr"): openexr_lat_long,
    ("cube", "openexr"): openexr_cube,
}

AXES = {
    (1, 0, 0): (1, 0, 0),
    (-1, 0, 0): (0, 1, 1),
    (0, 1, 0): (0, 1, 0),
    (0, -1, 0): (1, 0, 1),
    (0, 0, 1): (0, 0, 1),
    (0, 0, -1): (1, 1, 0),
}


def colored_axes(directions):
    """Red, green and blue around +x, +y, +z, their complements opposite; NaN where no picture."""
    unit = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    return sum(
        np.exp(8 * (unit @ axis - 1))[..., None] * np.array(color) for axis, color in AXES.items()
    )
