"""`jaxsh.harmonics` at full size."""

from jaxsh import harmonics

from .shared import DEGREE, K, V, floats, of

WITHOUT = {}


def calls():
    h = harmonics
    vectors, rows, light = floats(V, 3), floats(V, K), floats(3, K)
    search = "a search for the strength of the window: each round starts from the one before"
    return {
        "convert": of(lambda c: h.convert(c, "jaxsh", "e3nn-norm"), rows),
        "convolve": of(h.convolve, rows, floats(DEGREE + 1)),
        "damping": of(lambda s: h.damping(s, DEGREE), floats(V)),
        "dering": of(lambda c: h.dering(c, of="light", shared=True), light, trips=64, why=search),
        "disc": of(lambda s: h.disc(s, DEGREE), floats(V)),
        "evaluate": of(lambda v: h.evaluate(v, DEGREE), vectors),
        "evaluate_with_gradient": of(lambda v: h.evaluate_with_gradient(v, DEGREE), vectors),
        "phong": of(lambda k: h.phong(k, DEGREE, normalized=True), floats(V)),
        "product": of(lambda f, g: h.product(f, g, DEGREE), rows, rows),
        "product_matrix": of(lambda f: h.product_matrix(f, DEGREE), light),
        "rotate": of(h.rotate, rows, floats(3, 3)),
        "rotate_z": of(h.rotate_z, rows, floats(V)),
        "rotation_matrix": of(lambda r: h.rotation_matrix(r, DEGREE), floats(100, 3, 3)),
        "softening": of(lambda s: h.softening(s, DEGREE), floats(V)),
        "synthesize": of(h.synthesize, floats(V, 3, 16), vectors),
        "synthesize, of high degree": of(h.synthesize, floats(V, 3, K), vectors),
        "synthesize, shared": of(h.synthesize, floats(3, 16), vectors),
        "synthesize, shared, of high degree": of(h.synthesize, light, vectors),
        "triple_integral": of(h.triple_integral, rows, rows, rows),
    }
