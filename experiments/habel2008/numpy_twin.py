"""What the experiment `habel2008.cost` compares with: the same sky in NumPy, as users write it."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from jaxsh import harmonics, sky

Angles = Float[np.ndarray, " n"]


def polynomial(fit: sky.SkyFit) -> Callable[[Angles, Angles, Angles], np.ndarray]:
    """Eqs. 1 and 4 in float64: f(θ, φ, τ) -> (n, 3, K), one matrix product and the rotation."""
    l, m = harmonics.degrees(fit.degree), harmonics.orders(fit.degree)
    table = sky.habel2008_monomials(fit)[m >= 0]
    rows, i, j, channels = table.shape
    matrix = np.ascontiguousarray(table.transpose(1, 2, 3, 0).reshape(i * j, channels * rows))
    powers = np.arange(i), np.arange(j)
    places, cosine = l * (l + 1) // 2 + np.abs(m), m >= 0

    def evaluate(theta: Angles, phi: Angles, turbidity: Angles) -> np.ndarray:
        terms = (theta[:, None] ** powers[0])[:, :, None] * (turbidity[:, None] ** powers[1])[
            :, None
        ]
        weights = (terms.reshape(len(theta), -1) @ matrix).reshape(len(theta), channels, rows)
        angle = np.arange(fit.degree + 1) * phi[:, None]
        waves = np.where(cosine, np.cos(angle)[:, np.abs(m)], np.sin(angle)[:, np.abs(m)])
        return weights[:, :, places] * waves[:, None]

    return evaluate


def projection(
    views: Float[np.ndarray, "n 3"], weight: float, degree: int
) -> Callable[[Float[np.ndarray, "3"], float], np.ndarray]:
    """Σ of samples, f(sun, τ) -> (3, K) in float64; the harmonics are tabulated beforehand."""
    basis = weight * np.asarray(harmonics.evaluate(views, degree), np.float64)
    cosine = views[:, 2].astype(np.float64)
    table, matrix = sky.preetham_constants("paper"), sky.xyz_to_srgb().T

    def relative(coefficients, sun, turbidity, gamma):
        a, b, c, d, e = (slope * turbidity + intercept for slope, intercept in coefficients)
        theta = np.arccos(sun[2])
        seen = (1 + a * np.exp(b / cosine)) * (1 + c * np.exp(d * gamma) + e * np.cos(gamma) ** 2)
        up = (1 + a * np.exp(b)) * (1 + c * np.exp(d * theta) + e * sun[2] ** 2)
        return seen / up

    def project(sun, turbidity):
        theta = np.arccos(sun[2])
        gamma = np.arccos(np.clip(views @ sun, -1, 1))
        chi = (4 / 9 - turbidity / 120) * (np.pi - 2 * theta)
        zenith = (4.0453 * turbidity - 4.9710) * np.tan(chi) - 0.2155 * turbidity + 2.4192
        quadratic, cubic = np.array([turbidity**2, turbidity, 1]), theta ** np.arange(3, -1, -1)
        luminance = zenith * relative(table.luminance, sun, turbidity, gamma)
        x = quadratic @ table.zenith_x @ cubic * relative(table.x, sun, turbidity, gamma)
        y = quadratic @ table.zenith_y @ cubic * relative(table.y, sun, turbidity, gamma)
        scale = luminance / y
        xyz = np.stack([scale * x, luminance, scale * (1 - x - y)], axis=-1)
        return (xyz @ matrix).T @ basis

    return project
