"""Slow twins of the sky, from the papers line by line: angles, plain loops, panels; no jaxsh."""

import numpy as np
from scipy.special import sph_harm_y

# Preetham et al. 1999, appendix A.2: rows A to E of the slope in T, then of the intercept.
PEREZ = {
    "paper": {
        "Y": (
            [0.1787, -0.3554, -0.0227, 0.1206, -0.0670],
            [-1.4630, 0.4275, 5.3251, -2.5771, 0.3703],
        ),
        "x": (
            [-0.0193, -0.0665, -0.0004, -0.0641, -0.0033],
            [-0.2592, 0.0008, 0.2125, -0.8989, 0.0452],
        ),
        "y": (
            [-0.0167, -0.0950, -0.0079, -0.0441, -0.0109],
            [-0.2608, 0.0092, 0.2102, -1.6537, 0.0529],
        ),
    },
    "code": {
        "Y": (
            [0.17872, -0.3554, -0.02266, 0.12064, -0.06696],
            [-1.46303, 0.42749, 5.32505, -2.57705, 0.37027],
        ),
        "x": (
            [-0.01925, -0.06651, -0.00041, -0.06409, -0.00325],
            [-0.25922, 0.00081, 0.21247, -0.89887, 0.04517],
        ),
        "y": (
            [-0.01669, -0.09495, -0.00792, -0.04405, -0.01092],
            [-0.26078, 0.00921, 0.21023, -1.65369, 0.05291],
        ),
    },
}
ZENITH = {
    "paper": {
        "x": [
            "0.00166 -0.00375 0.00209 0",
            "-0.02903 0.06377 -0.03202 0.00394",
            "0.11693 -0.21196 0.06052 0.25886",
        ],
        "y": [
            "0.00275 -0.00610 0.00317 0",
            "-0.04214 0.08970 -0.04153 0.00516",
            "0.15346 -0.26756 0.06670 0.26688",
        ],
    },
    "code": {
        "x": [
            "0.00165 -0.00374 0.00208 0",
            "-0.02902 0.06377 -0.03202 0.00394",
            "0.11693 -0.21196 0.06052 0.25885",
        ],
        "y": [
            "0.00275 -0.00610 0.00316 0",
            "-0.04214 0.08970 -0.04153 0.00515",
            "0.15346 -0.26756 0.06669 0.26688",
        ],
    },
}


def perez(theta, gamma, a, b, c, d, e):
    """Eq. 3 of Preetham et al."""
    horizon = np.exp(b / np.cos(theta)) if np.cos(theta) > 0 else 0.0
    return (1 + a * horizon) * (1 + c * np.exp(d * gamma) + e * np.cos(gamma) ** 2)


def preetham_xyy(theta, phi, theta_sun, turbidity, constants="paper"):
    """One direction by its angles, φ from the sun's azimuth."""
    cosine = np.sin(theta) * np.sin(theta_sun) * np.cos(phi) + np.cos(theta) * np.cos(theta_sun)
    # Half the chord between the two directions: an angle right near 0, where acos is not.
    chord = np.sin((theta - theta_sun) / 2) ** 2
    chord += np.sin(theta) * np.sin(theta_sun) * np.sin(phi / 2) ** 2
    gamma = 2 * np.arcsin(np.sqrt(min(chord, 1.0))) if cosine > -0.9 else np.arccos(cosine)

    chi = (4 / 9 - turbidity / 120) * (np.pi - 2 * theta_sun)
    zenith = {"Y": (4.0453 * turbidity - 4.9710) * np.tan(chi) - 0.2155 * turbidity + 2.4192}
    for name in "xy":
        matrix = np.array([row.split() for row in ZENITH[constants][name]], float)
        powers = np.array([theta_sun**3, theta_sun**2, theta_sun, 1])
        zenith[name] = np.array([turbidity**2, turbidity, 1]) @ matrix @ powers

    found = {}
    for name, (slope, intercept) in PEREZ[constants].items():
        coefficients = np.array(slope) * turbidity + np.array(intercept)
        found[name] = zenith[name] * perez(theta, gamma, *coefficients)
        found[name] /= perez(0.0, theta_sun, *coefficients)
    return np.array([found["x"], found["y"], found["Y"]])


def xyy_to_xyz(xyy):
    x, y, luminance = xyy
    return np.array([x / y * luminance, luminance, (1 - x - y) / y * luminance])


# CSS Color Module Level 4, "Sample code for color conversions", rounded to nine figures.
XYZ_TO_SRGB = np.array(
    [
        [3.24096994, -1.53738318, -0.49861076],
        [-0.96924364, 1.8759675, 0.04155506],
        [0.05563008, -0.20397696, 1.05697151],
    ]
)


def panels(count, levels, ratio):
    """Gauss–Legendre nodes on [0, 1], in panels graded towards both ends."""
    node, weight = np.polynomial.legendre.leggauss(count)
    edge = np.concatenate([[0], ratio ** np.arange(levels - 1, -1, -1.0)]) / 2
    edge = np.concatenate([edge, 1 - edge[-2::-1]])
    width = np.diff(edge)[:, None]
    return (edge[:-1, None] + width * (node + 1) / 2).ravel(), (width * weight / 2).ravel()


def project_by_panels(sky, theta_sun, degree, *, count=12, levels=12, ratio=0.4):
    """Coefficients of sky(θ, φ) -> (C, T, P), even in φ, for a sun at azimuth 0: (C, K)."""
    node, weight = panels(count, levels, ratio)
    theta = np.concatenate([theta_sun * node, theta_sun + (np.pi / 2 - theta_sun) * node])
    weights = np.concatenate([theta_sun * weight, (np.pi / 2 - theta_sun) * weight])
    weights *= np.sin(theta)
    phi = np.pi * node
    values = sky(theta[:, None], phi[None, :])
    coefficients = np.zeros((len(values), (degree + 1) ** 2))
    for m in range(degree + 1):
        along = values @ (2 * np.pi * weight * np.cos(m * phi))
        for l in range(m, degree + 1):
            profile = sph_harm_y(l, m, theta, 0.0).real * (-1) ** m * (np.sqrt(2) if m else 1)
            coefficients[:, l * (l + 1) + m] = along @ (profile * weights)
    return coefficients


def xyz_to_srgb(xyz):
    return XYZ_TO_SRGB @ xyz


def attenuated_sun(elevation, turbidity, wavelengths, solar, ozone, water, observer):
    """Preetham et al. 1999, appendix A.1, one wavelength at a time: XYZ in kcd/m²."""
    theta = 90.0 - elevation
    mass = 1 / (np.cos(np.radians(theta)) + 0.15 * (93.885 - theta) ** -1.253)
    xyz = np.zeros(3)
    for i, nanometres in enumerate(wavelengths):
        micrometres = nanometres / 1000
        transmitted = np.exp(-0.008735 * micrometres**-4.08 * mass)
        transmitted *= np.exp(-(0.04608 * turbidity - 0.04586) * micrometres**-1.3 * mass)
        transmitted *= np.exp(-ozone[i] * 0.35 * mass)
        vapour = water[i] * 2.0 * mass
        transmitted *= np.exp(-0.2385 * vapour / (1 + 20.07 * vapour) ** 0.45)
        xyz += 683 * 10 * observer[:, i] * solar[i] * transmitted
    return xyz / 1000


# CIE S 011, table 1, in its arrangement: six gradations, six indicatrices, and who has which.
GRADATION = {
    "I": (4.0, -0.7),
    "II": (1.1, -0.8),
    "III": (0.0, -1.0),
    "IV": (-1.0, -0.55),
    "V": (-1.0, -0.32),
    "VI": (-1.0, -0.15),
}
INDICATRIX = {
    1: (0, -1.0, 0),
    2: (2, -1.5, 0.15),
    3: (5, -2.5, 0.30),
    4: (10, -3.0, 0.45),
    5: (16, -3.0, 0.30),
    6: (24, -2.8, 0.15),
}
CIE_TYPES = [
    "I1",
    "I2",
    "II1",
    "II2",
    "III1",
    "III2",
    "III3",
    "III4",
    "IV2",
    "IV3",
    "IV4",
    "V4",
    "V5",
    "VI5",
    "VI6",
]


def cie_ratio(view, sun, kind):
    """Luminance over that of the zenith, by angles."""
    name = CIE_TYPES[kind - 1]
    a, b = GRADATION[name[:-1]]
    c, d, e = INDICATRIX[int(name[-1])]
    zenith, zenith_sun, chi = np.arccos(view[2]), np.arccos(sun[2]), np.arccos(view @ sun)

    def f(x):
        return 1 + c * (np.exp(d * x) - np.exp(d * np.pi / 2)) + e * np.cos(x) ** 2

    def phi(z):
        return 1 + a * np.exp(b / np.cos(z))

    return f(chi) * phi(zenith) / (f(zenith_sun) * phi(0))


def hosek_spectrum(tensors, view, sun, turbidity):
    """Hosek and Wilkie 2012, eqs. 8 and 9, at albedo 0: wavelengths in nm, radiance at each."""
    elevation, cosine, gamma = np.arcsin(sun[2]), view[2], np.arccos(view @ sun)
    x = (elevation / (np.pi / 2)) ** (1 / 3)
    curve = np.array([1, 5, 10, 10, 5, 1]) * x ** np.arange(6) * (1 - x) ** np.arange(5, -1, -1)
    a, b, c, d, e, f, g, h, i = np.tensordot(
        curve, tensors["sky_params_spec"][turbidity - 1, 0], 1
    ).T
    mean = np.tensordot(curve, tensors["sky_rad_spec"][turbidity - 1, 0], 1)
    halo = (1 + np.cos(gamma) ** 2) / (1 + i**2 - 2 * i * np.cos(gamma)) ** 1.5
    around = c + d * np.exp(e * gamma) + f * np.cos(gamma) ** 2 + g * halo + h * np.sqrt(cosine)
    return np.arange(320, 721, 40), (1 + a * np.exp(b / (cosine + 0.01))) * around * mean


def hosek_sun_spectrum(tensors, elevation, turbidity):
    """Hosek and Wilkie 2013: mean radiance of the disc, W/(m² sr nm), every 40 nm from 320 nm.

    45 pieces of the elevation, each a cubic in the elevation above the piece's lower end, times
    the mean over the disc of the limb darkening Σ_k d_k μ^k, of which μ^k gives 2/(k + 2).
    """
    piece = int((elevation / (np.pi / 2)) ** (1 / 3) * 45)
    above = elevation - (piece / 45) ** 3 * np.pi / 2
    center = tensors["sun_rad_spec"][turbidity - 1, piece] @ above ** np.arange(4)
    return center * (tensors["sun_ld_spec"] @ (2 / (np.arange(6) + 2)))


def observers_luminance(wavelengths, spectrum):
    """Integral with Wyman, Sloan and Shirley's (2013) ȳ, the spectrum linear in between."""
    fine = np.arange(380.0, 721.0, 5.0)

    def lobe(height, center, below, above):
        width = np.where(fine < center, below, above)
        return height * np.exp(-(((fine - center) / width) ** 2) / 2)

    observer = lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1)
    return 5 * np.interp(fine, wavelengths, spectrum) @ observer
