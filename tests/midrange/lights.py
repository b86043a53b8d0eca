"""A flat light's coefficients and their gradient, by plain quadrature over its surface.

Independent of jaxsh: SciPy's harmonics, Gauss–Legendre over triangles, eqs. 6 to 12 of Annen et
al. with their signs put right.
"""

import functools

import numpy as np
from scipy.special import sph_harm_y


def surface_quadrature(vertices, radiance, point, degree, *, nodes=48, two_sided=False):
    """c (3, K) and ∇c (3, K, 3) at a point, of a flat simple polygon that nothing blocks.

    `nodes` along each axis of each triangle: enough for 1e-12 where the point is no nearer to the
    polygon than about half its size. A one-sided polygon seen from behind gives zero.
    """
    vertices, point = np.asarray(vertices, np.float64), np.asarray(point, np.float64)
    radiance = np.asarray(radiance, np.float64)
    x, area, n = triangle_nodes(vertices, nodes)
    s = x - point
    r = np.linalg.norm(s, axis=-1)
    facing = -(s @ n)  # the same for all nodes but for rounding
    if facing[0] < 0 and not two_sided:
        return np.zeros((3, (degree + 1) ** 2)), np.zeros((3, (degree + 1) ** 2, 3))
    sign = np.sign(facing[0])
    y, slope = basis_with_gradient(s, degree)
    g = sign * facing / r**3
    slope_of_g = -sign * n / r[:, None] ** 3 - 3 * g[:, None] * s / r[:, None] ** 2
    values = area * g @ y
    gradient = -np.einsum("n,nkd->kd", area * g, slope) - (area * y.T) @ slope_of_g
    return radiance[:, None] * values, radiance[:, None, None] * gradient


def triangle_nodes(vertices, nodes):
    """Points (N, 3) on a flat simple polygon, their (signed) areas, and its unit normal.

    A fan of triangles around the first vertex; those of a polygon that is not convex overlap, and
    signed areas take away again what is too much.
    """
    corner, edges = vertices[0], vertices[1:] - vertices[0]
    crosses = np.cross(edges[:-1], edges[1:])
    n = crosses.sum(axis=0)
    n = n / np.linalg.norm(n)
    t, w = np.polynomial.legendre.leggauss(nodes)
    t, w = (t + 1) / 2, w / 2
    u, v = (a.ravel() for a in np.meshgrid(t, t, indexing="ij"))
    weight = np.multiply.outer(w, w).ravel() * u  # the square folded onto the triangle
    points, areas = [], []
    for first, second, cross in zip(edges[:-1], edges[1:], crosses, strict=True):
        points.append(corner + np.outer(u * (1 - v), first) + np.outer(u * v, second))
        areas.append(weight * (cross @ n))
    return np.concatenate(points), np.concatenate(areas), n


def basis_with_gradient(s, degree):
    """y_i(s/|s|) (N, K) and its gradient (N, K, 3) in s, by polynomials in x, y, z."""
    r = np.linalg.norm(s, axis=-1, keepdims=True)
    omega = s / r
    values, gradients = [], []
    for l in range(degree + 1):
        powers, coefficients = _solid_harmonics(l)
        y = _monomials(omega, powers) @ coefficients
        solid = []
        for axis in range(3):
            lowered = powers - np.eye(3, dtype=int)[axis]
            slopes = _monomials(omega, np.maximum(lowered, 0)) * powers[:, axis]
            solid.append(slopes @ coefficients)
        radial = omega[:, None, :] * (l * y)[..., None]
        values.append(y)
        gradients.append((np.stack(solid, axis=-1) - radial) / r[..., None])
    return np.concatenate(values, axis=-1), np.concatenate(gradients, axis=1)


@functools.cache
def _solid_harmonics(l):
    """r^l y_lm as homogeneous polynomials: exponents (M, 3) and coefficients (M, 2l+1)."""
    powers = np.array([(i, j, l - i - j) for i in range(l + 1) for j in range(l + 1 - i)])
    theta, phi = np.random.default_rng(l).uniform([[0], [0]], [[np.pi], [2 * np.pi]], (2, 300))
    r = np.sin(theta)
    omega = np.stack([r * np.cos(phi), r * np.sin(phi), np.cos(theta)], axis=-1)
    columns = []
    for m in range(-l, l + 1):
        y = (-1) ** m * sph_harm_y(l, abs(m), theta, phi)  # without Condon and Shortley's phase
        columns.append(y.real if m == 0 else np.sqrt(2) * (y.imag if m < 0 else y.real))
    monomials, y = _monomials(omega, powers), np.stack(columns, axis=-1)
    return powers, np.linalg.lstsq(monomials, y, rcond=None)[0]


def _monomials(omega, powers):
    table = omega[:, :, None] ** np.arange(powers.max() + 1)
    x, y, z = (table[:, axis, powers[:, axis]] for axis in range(3))
    return x * y * z


def rectangle(center, u, v):
    """Corners of the rectangle center ± u ± v, counter-clockwise seen from where u × v points."""
    center, u, v = (np.asarray(a, np.float64) for a in (center, u, v))
    return np.stack([center - u - v, center + u - v, center + u + v, center - u + v])
