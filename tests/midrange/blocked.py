"""Lights that a rectangle partly hides, exactly: what is hidden is the light clipped to a cone."""

import numpy as np
from lights import rectangle, surface_quadrature

# The quadrature's nodes: the clipped light may be a sliver, but it is never large.
NODES = 12


def visible(light, radiance, blocker, point, degree):
    """Coefficients (3, K) of the part of a convex light that a convex blocker leaves."""
    whole, _ = surface_quadrature(light, radiance, point, degree, nodes=NODES)
    sides = np.cross(blocker - point, np.roll(blocker, -1, axis=0) - point)
    sides = sides * np.sign(sides[0] @ (blocker.mean(axis=0) - point))
    hidden = light
    for side in sides:
        hidden = _clip(hidden, side, point)
        if len(hidden) < 3:
            return whole
    return whole - surface_quadrature(hidden, radiance, point, degree, nodes=NODES)[0]


def visible_gradient(light, radiance, blocker, point, degree, step=1e-3):
    """d/d point, (3, K, 3), by five points along each axis."""
    axes = []
    for axis in np.eye(3) * step:
        f = [visible(light, radiance, blocker, point + k * axis, degree) for k in (-2, -1, 1, 2)]
        axes.append((f[0] - 8 * f[1] + 8 * f[2] - f[3]) / (12 * step))
    return np.stack(axes, axis=-1)


def configuration(rng):
    """Light, radiance, blocker and point: tilted rectangles, with 30 to 90 % of the light seen."""
    while True:
        point = 0.2 * rng.normal(size=3)
        axis, u, v = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        tilted = [side + axis * rng.uniform(-0.4, 0.4) for side in (u, v, u, v)]
        sizes = rng.uniform([0.4, 0.4, 0.1, 0.1], [1, 1, 0.35, 0.35])
        a, b, c, d = (side * size for side, size in zip(tilted, sizes, strict=True))
        distance = rng.uniform(1.5, 3)
        light = rectangle(point + distance * axis, a, b)
        if np.cross(a, b) @ axis > 0:  # turned away
            light = light[::-1]
        aside = (u * rng.uniform(-1, 1) + v * rng.uniform(-1, 1)) / 4
        blocker = rectangle(point + distance * rng.uniform(0.3, 0.7) * axis + aside, c, d)
        radiance = rng.uniform(0.5, 2, 3)
        left = visible(light, radiance, blocker, point, 0)[0, 0]
        if 0.3 < left / surface_quadrature(light, radiance, point, 0, nodes=NODES)[0][0, 0] < 0.9:
            return light, radiance, blocker, point


def _clip(corners, side, point):
    """The part of a convex polygon where (x - point)·side >= 0."""
    heights, kept = (corners - point) @ side, []
    for i, (a, b) in enumerate(zip(heights, np.roll(heights, -1), strict=True)):
        if a >= 0:
            kept.append(corners[i])
        if (a >= 0) != (b >= 0):
            kept.append(corners[i] + (corners[(i + 1) % len(corners)] - corners[i]) * a / (a - b))
    return np.array(kept)
