"""Real spherical harmonics: the basis, sums, rotation, products, kernels, windows, conventions.

Orthonormal, no Condon–Shortley phase, index i = l(l+1) + m, coefficients on the last axis. A
function of degree L has K = (L+1)² coefficients. Directions are x, y, z.
"""

from ._basis import evaluate, evaluate_with_gradient
from ._convention import Convention
from ._conventions import conventions
from ._convert import convert
from ._dering import dering
from ._indexing import degree_of, degrees, index, num_coefficients, orders
from ._products import gaunt, product, product_matrix, triple_integral
from ._rotation import rotate, rotate_z, rotation_matrix
from ._synthesize import synthesize
from ._tables import legendre
from ._windows import damping, softening, window
from ._zonal import clamped_cosine, convolve, disc, phong

__all__ = [
    "Convention",
    "clamped_cosine",
    "conventions",
    "convert",
    "convolve",
    "damping",
    "degree_of",
    "degrees",
    "dering",
    "disc",
    "evaluate",
    "evaluate_with_gradient",
    "gaunt",
    "index",
    "legendre",
    "num_coefficients",
    "orders",
    "phong",
    "product",
    "product_matrix",
    "rotate",
    "rotate_z",
    "rotation_matrix",
    "softening",
    "synthesize",
    "triple_integral",
    "window",
]
