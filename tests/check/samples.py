"""Lights and bases by hand, in NumPy alone: nothing here comes from the table that is checked."""

import numpy as np

# The constants of degree 2 as they stand in papers and in code.
CONSTANTS = np.array(
    [0.282095, 0.488603, 0.488603, 0.488603, 1.092548, 1.092548, 0.315392, 1.092548, 0.546274]
)
CS = np.array([1, -1, 1, -1, 1, -1, 1, -1, 1.0])
DIRECTION = np.array([0.3, 0.5, 0.8]) / np.linalg.norm([0.3, 0.5, 0.8])


def polynomials(directions):
    x, y, z = np.moveaxis(np.asarray(directions), -1, 0)
    one = np.ones_like(x)
    rows = [one, y, z, x, x * y, y * z, 3 * z * z - 1, x * z, x * x - y * y]
    return np.stack(rows, axis=-1)


def basis(directions):
    return CONSTANTS * polynomials(directions)


def picture(rng, height=16, channels=3, lamps=4):
    """Sky, ground and a few lamps of several colors."""
    directions, _ = pixels(height)
    z = directions[..., 2:]
    image = 0.3 * rng.uniform(0.3, 1, channels) * (1 + z) + 0.2 * rng.uniform(0.2, 1, channels)
    for _ in range(lamps):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        lobe = np.exp(rng.uniform(2, 12) * (directions @ axis - 1))[..., None]
        image = image + rng.uniform(0.3, 3) * rng.uniform(0.2, 1, channels) * lobe
    return image


def pixels(height):
    """Directions (H, W, 3) and solid angles (H, W) of a lat-long picture's pixels."""
    theta = (np.arange(height) + 0.5) * np.pi / height
    phi = (np.arange(2 * height) + 0.5) * np.pi / height
    theta, phi = np.meshgrid(theta, phi, indexing="ij")
    sine = np.sin(theta)
    directions = np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)], axis=-1)
    return directions, sine * (np.pi / height) ** 2


def project(image, basis=basis):
    """Coefficients (C, K) as usual code has them: a sum over pixels with their solid angles."""
    directions, solid_angles = pixels(len(image))
    return np.einsum("hwc,hwk,hw->ck", image, basis(directions), solid_angles)
