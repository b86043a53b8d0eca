"""Functions on the sphere with known integrals and coefficients, for the tests of sphere."""

import numpy as np
from scipy.special import spherical_in

from jaxsh import harmonics


def unit_vectors(rng, count):
    vectors = rng.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def exponential(axis):
    """f(ω) = exp(a·ω): smooth, of every degree."""
    return lambda directions: np.exp(np.asarray(directions) @ axis)


def exponential_coefficients(axis, degree):
    """∫ exp(a·ω) y_lm dω = 4π i_l(|a|) y_lm(a/|a|), modified spherical Bessel functions."""
    size = np.linalg.norm(axis)
    bands = 4 * np.pi * spherical_in(np.arange(degree + 1), size)
    return bands[harmonics.degrees(degree)] * np.asarray(harmonics.evaluate(axis, degree))


def basis(directions, degree):
    """y_i at any number of directions, (N, K), by one program for each degree."""
    directions, size = np.asarray(directions, np.float64), 512
    blocks = np.resize(directions, (-(-len(directions) // size), size, 3))
    parts = [np.asarray(harmonics.evaluate(block, degree)) for block in blocks]
    return np.concatenate(parts)[: len(directions)]


def dense_project(values, quadrature, degree):
    """Evaluate everything, then sum."""
    weights = np.asarray(quadrature.weights)
    return np.einsum("...n,n,nk->...k", values, weights, basis(quadrature.directions, degree))


def picture(f, height, width):
    """f at the pixel centres of a lat-long picture, by angles: (height, width)."""
    rows = []
    for i in range(height):
        theta = (i + 0.5) * np.pi / height
        phi = (np.arange(width) + 0.5) * 2 * np.pi / width
        ring = [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi]
        rows.append(f(np.stack(ring, axis=-1)))
    return np.stack(rows)
