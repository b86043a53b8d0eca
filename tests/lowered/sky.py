"""`jaxsh.sky` at full size: a thousand suns, which many views of each make as large."""

import jax.numpy as jnp

from jaxsh import sky

from .shared import DEGREE, K, V, floats, of, shapes

SUNS = 1000
STUDY = "runs on the host's values, not inside `jit`"
WITHOUT = {
    "fit": STUDY,
    "habel2008_fit": STUDY,
    "hosek_radiance": "reads tables of another package, which tests do without",
    "least_squares": STUDY,
    "preetham_fit": STUDY,
}


def glow(view, sun, haze):
    """A sky brighter towards the sun."""
    return jnp.exp(haze * (view @ sun))[:, None]


def calls():
    k = sky
    view, views = floats(V, 3), floats(V)
    sun, haze = floats(SUNS, 3), floats(SUNS)
    rows = floats(SUNS, 3, K)
    small = shapes(k.preetham_table("small", 6))
    preetham = {"constants": "paper", "check": "allow"}
    return {
        "SkyFit.__call__": of(lambda fit, sun, haze: fit(sun, haze), small, sun, haze),
        "SkyFit.truncated": of(lambda fit: fit.truncated(2), small),
        "cie_radiance": of(
            lambda view, sun, zenith: k.cie_radiance(view, sun, zenith, kind=12, check="allow"),
            view,
            floats(3),
            views,
        ),
        "fit_error": of(k.fit_error, rows, rows, floats(3)),
        "horizontal_irradiance": of(k.horizontal_irradiance, rows),
        "preetham_harmonics": of(lambda sun, haze: k.preetham_harmonics(sun, haze), sun, haze),
        "preetham_radiance": of(
            lambda view, sun, haze: k.preetham_radiance(view, sun, haze, **preetham),
            view,
            floats(3),
            views,
        ),
        "project": of(lambda sun, haze: k.project(glow, sun, haze, degree=DEGREE), sun, haze),
        "project_preetham": of(
            lambda sun, haze: k.project_preetham(sun, haze, DEGREE, **preetham), sun, haze
        ),
        "smallest_luminance": of(
            lambda sun, haze: k.smallest_luminance(sun, haze, degree=DEGREE), sun, haze
        ),
        "sun_harmonics": of(
            lambda sun, haze: k.sun_harmonics(sun, haze, DEGREE, check="allow"), sun, haze
        ),
        "sun_radiance": of(lambda sun, haze: k.sun_radiance(sun, haze, check="allow"), sun, haze),
        "with_ground": of(k.with_ground, rows, floats(3)),
    }
