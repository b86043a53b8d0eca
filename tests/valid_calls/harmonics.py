"""Valid calls of `jaxsh.harmonics`."""

import numpy as np

from jaxsh import harmonics

from .shared import K, floats, of


def calls():
    h = harmonics
    f, vectors = floats(2, K), floats(5, 3)
    return {
        "clamped_cosine": of(h.clamped_cosine, degree=2),
        "Convention": of(
            h.Convention,
            phase="none",
            order="ascending",
            normalization="orthonormal",
            basis_axes="xyz",
            axes="y-up",
            layout="coefficients-last",
            quantity="radiance",
            degree=2,
            about="",
            host=True,
            free="about degree order axes",
        ),
        "conventions": of(h.conventions),
        "convert": of(h.convert, coefficients=f, source="jaxsh", target="e3nn-norm"),
        "convolve": of(h.convolve, coefficients=f, zonal=floats(3)),
        "damping": of(h.damping, strength=floats(), degree=2),
        "degree_of": of(h.degree_of, count=9),
        "degrees": of(h.degrees, degree=2),
        "disc": of(h.disc, solid_angle=floats(), degree=2, finite="solid_angle"),
        "dering": of(h.dering, coefficients=f, of="glossy", exponent=np.array(8.0), shared=False),
        "evaluate": of(h.evaluate, vectors=vectors, degree=2, axis=-1),
        "evaluate_with_gradient": of(h.evaluate_with_gradient, vectors=vectors, degree=2, axis=-1),
        "gaunt": of(h.gaunt, degree=1),
        "index": of(h.index, l=2, m=-1),
        "legendre": of(h.legendre, cos_theta=np.zeros(4), degree=2, host=True, finite="cos_theta"),
        "num_coefficients": of(h.num_coefficients, degree=2),
        "orders": of(h.orders, degree=2),
        "phong": of(h.phong, exponent=floats(), degree=2, normalized=True, finite="exponent"),
        "product": of(h.product, f=f, g=f[0], degree=2),
        "product_matrix": of(h.product_matrix, f=f, degree=2),
        "rotate": of(h.rotate, coefficients=f, rotation=np.eye(3), finite="rotation"),
        "rotate_z": of(h.rotate_z, coefficients=f, angle=floats()),
        "rotation_matrix": of(h.rotation_matrix, rotation=np.eye(3), degree=2, finite="rotation"),
        "softening": of(h.softening, strength=np.array(0.5), degree=2),
        "synthesize": of(h.synthesize, coefficients=floats(5, 2, K), vectors=vectors),
        "triple_integral": of(h.triple_integral, f=f, g=f, h=f),
        "window": of(h.window, kind="hann", degree=2),
    }
