"""Slow twins of the harmonics, independent of the library: SciPy, plain loops, quadrature, hand."""

import math

import numpy as np
import scipy.special


def unit_vectors(rng, count):
    vectors = rng.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def scipy_basis(vectors, degree):
    """(..., 3) -> (..., K) in float64: complex Y_lm turned real, Condon–Shortley phase removed."""
    x, y, z = np.moveaxis(np.asarray(vectors, np.float64), -1, 0)
    theta, phi = np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)
    columns = []
    for l in range(degree + 1):
        for m in range(-l, l + 1):
            value = scipy.special.sph_harm_y(l, abs(m), theta, phi)
            scale = 1 if m == 0 else math.sqrt(2) * (-1) ** m
            columns.append(scale * (value.imag if m < 0 else value.real))
    return np.stack(columns, axis=-1)


def loop_basis(vector, degree):
    """One vector, plain Python: Green's recursion for P_lm, factorials, angles."""
    x, y, z = (float(c) for c in vector)
    r = math.sqrt(x * x + y * y + z * z)
    ct, st, phi = z / r, math.hypot(x, y) / r, math.atan2(y, x)

    def associated_legendre(l, m):
        pmm = 1.0
        for k in range(1, m + 1):
            pmm *= (2 * k - 1) * st
        if l == m:
            return pmm
        before, now = pmm, ct * (2 * m + 1) * pmm
        for n in range(m + 2, l + 1):
            before, now = now, ((2 * n - 1) * ct * now - (n + m - 1) * before) / (n - m)
        return now

    values = []
    for l in range(degree + 1):
        for m in range(-l, l + 1):
            n = abs(m)
            k = (2 * l + 1) / (4 * math.pi) * math.factorial(l - n) / math.factorial(l + n)
            azimuth = 1.0 if m == 0 else math.sqrt(2) * (math.sin if m < 0 else math.cos)(n * phi)
            values.append(math.sqrt(k) * associated_legendre(l, n) * azimuth)
    return values


def hand_basis(vectors):
    """Degree 2 as it stands in every graphics paper, on unit vectors."""
    x, y, z = np.moveaxis(np.asarray(vectors, np.float64), -1, 0)
    a, b, c = math.sqrt(1 / (4 * math.pi)), math.sqrt(3 / (4 * math.pi)), math.sqrt(15 / math.pi)
    return np.stack(
        [
            a + 0 * x,
            b * y,
            b * z,
            b * x,
            c / 2 * x * y,
            c / 2 * y * z,
            math.sqrt(5 / math.pi) / 4 * (3 * z * z - 1),
            c / 2 * x * z,
            c / 4 * (x * x - y * y),
        ],
        axis=-1,
    )


def product_grid(degree):
    """Directions and weights that integrate polynomials of `degree`, turned off the axes."""
    z, ring = np.polynomial.legendre.leggauss(degree // 2 + 1)
    phi = 0.3 + 2 * np.pi * np.arange(degree + 1) / (degree + 1)
    z, phi = (t.ravel() for t in np.meshgrid(z, phi, indexing="ij"))
    r = np.sqrt(1 - z**2)
    weights = np.repeat(ring * 2 * np.pi / (degree + 1), degree + 1)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1), weights


def rotations(rng, count):
    """Uniform rotation matrices, (count, 3, 3)."""
    q, r = np.linalg.qr(rng.normal(size=(count, 3, 3)))
    q = q * np.sign(np.diagonal(r, axis1=-2, axis2=-1))[:, None]
    return q * np.linalg.det(q)[:, None, None]


def hat(w):
    """The rotation by |w| about w, to first order: 1 + hat(w)."""
    return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


def slow_rotation_matrix(rotation, degree):
    """D_ij = ∫ y_i(ω) y_j(Rᵀω) dω with SciPy's basis."""
    directions, weights = product_grid(2 * degree)
    turned = scipy_basis(directions @ rotation, degree)
    return (scipy_basis(directions, degree) * weights[:, None]).T @ turned


def slow_gaunt(degree):
    directions, weights = product_grid(3 * degree)
    y = scipy_basis(directions, degree)
    return np.einsum("n,ni,nj,nk->ijk", weights, y, y, y, optimize=True)


def slope(f, h):
    """f'(0) by five points: error h⁴ f⁽⁵⁾/30, and rounding over h."""
    f = [np.asarray(f(k * h), np.float64) for k in (-2, -1, 1, 2)]
    return (f[0] - 8 * f[1] + 8 * f[2] - f[3]) / (12 * h)
