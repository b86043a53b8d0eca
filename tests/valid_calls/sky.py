"""Valid calls of `jaxsh.sky`."""

import functools

import jax.numpy as jnp
import numpy as np

from jaxsh import sky

from .shared import floats, of


def glow(view, sun, haze):
    return haze * (1 + view @ sun)[:, None]


def model(view, sun):
    return (1 + view @ sun)[:, None]


@functools.cache
def plain_fit():
    axes = sky.Axis("θ", 0.0, 1.5), sky.Axis("haze", 1.0, 2.0)
    return sky.SkyFit(jnp.asarray(floats(1, 3, 3, 2)), jnp.eye(1), axes, False)


def calls():
    k = sky
    view, sun, haze = floats(4, 3), floats(4, 3), 3 + floats(4)
    light, fit = floats(3, 4), k.preetham_table("small", 1)
    both = {"sun": sun, "turbidity": haze}
    checked = {"space": "srgb", "check": "raise"}
    options = {
        "zenith": 1.5,
        "parity": True,
        "prefactor": None,
        "weight": None,
        "lawson": 0,
        "samples": [6, 6],
        "project": k.project,
        "solver": "qr",
        "max_steps": 9,
        "throw": True,
    }
    return {
        "SkyFit.__call__": of(
            lambda sun, turbidity: fit(sun, turbidity), **both, finite="sun turbidity"
        ),
        "SkyFit.truncated": of(fit.truncated, degree=1),
        "c_header": of(k.c_header, fit=plain_fit(), prefix="my_sky", free="prefix", host=True),
        "cie_radiance": of(
            k.cie_radiance,
            view=view,
            sun=sun,
            zenith_luminance=haze,
            kind=12,
            check="raise",
            finite="view sun zenith_luminance",
        ),
        "fit": of(
            k.fit,
            model=glow,
            parameters={"haze": (1.0, 2.0)},
            degree=1,
            terms=[3, 2],
            log=["haze"],
            mix=np.eye(1),
            **options,
            devices=None,
            slow=True,
            finite="mix",
        ),
        "fit_error": of(k.fit_error, approximate=light, exact=light, smallest=floats(3)),
        "habel2008_evaluate": of(
            k.habel2008_evaluate,
            table=floats(4, 3, 2, 3),
            theta=floats(4),
            turbidity=haze,
            host=True,
        ),
        "habel2008_fit": of(
            k.habel2008_fit,
            terms=(4, 3),
            turbidity=(2.5, 6.0),
            degree=1,
            constants="paper",
            slow=True,
        ),
        "habel2008_monomials": of(k.habel2008_monomials, fit=plain_fit(), host=True),
        "horizontal_irradiance": of(
            k.horizontal_irradiance, coefficients=light, finite="coefficients"
        ),
        "hosek_radiance": of(
            k.hosek_radiance,
            view=view,
            **both,
            albedo=floats(4),
            check="raise",
            finite="view sun turbidity albedo",
        ),
        "least_squares": of(
            k.least_squares,
            design=floats(5, 2),
            targets=floats(3, 5),
            scales=floats(3, 5),
            solver="qr",
            max_steps=9,
            slow=True,
            finite="design targets scales",
        ),
        "preetham_constants": of(k.preetham_constants, name="paper"),
        "preetham_fit": of(
            k.preetham_fit, terms=(4, 3), turbidity=(3.0, 4.0), degree=1, lawson=0, slow=True
        ),
        "preetham_harmonics": of(
            k.preetham_harmonics,
            **both,
            degree=1,
            window="habel",
            table="small",
            finite="sun turbidity",
        ),
        "preetham_radiance": of(
            k.preetham_radiance,
            view=view,
            **both,
            constants="paper",
            **checked,
            finite="view sun turbidity",
        ),
        "preetham_table": of(k.preetham_table, table="small", degree=1),
        "project": of(k.project, model=model, sun=sun, degree=1, symmetric=True, finite="sun"),
        "project_preetham": of(
            k.project_preetham,
            **both,
            degree=1,
            constants="paper",
            **checked,
            finite="sun turbidity",
        ),
        "smallest_luminance": of(
            k.smallest_luminance, **both, reading="luminance", degree=1, finite="sun turbidity"
        ),
        "sun_direction": of(
            k.sun_direction,
            time=1e9 * floats(4),
            latitude=floats(4),
            longitude=floats(4),
            refraction=True,
            host=True,
            finite="time latitude longitude",
        ),
        "sun_harmonics": of(
            k.sun_harmonics, **both, degree=1, radius=0.005, **checked, finite="sun turbidity"
        ),
        "sun_radiance": of(k.sun_radiance, **both, **checked, finite="sun turbidity"),
        "with_ground": of(k.with_ground, light=light, albedo=floats(3), finite="light albedo"),
        "xyz_to_srgb": of(k.xyz_to_srgb),
    }
