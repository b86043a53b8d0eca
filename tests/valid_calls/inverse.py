"""Valid calls of `jaxsh.inverse`."""

import jax.numpy as jnp
import numpy as np

from jaxsh import inverse

from .shared import V, floats, lamp, made, of


def glow(sun, turbidity):
    """A sky of degree 1, brighter towards the sun."""
    return jnp.tile(jnp.concatenate([jnp.ones(1), turbidity * sun]), (3, 1))


def calls():
    i = inverse
    data = {"observed": floats(V, 3), "transfer": made(), "albedo": floats(V, 3)}
    solver = {"weights": floats(V), "tolerance": 1e-5, "max_steps": 3, "throw": True}
    finite = {"finite": "observed albedo weights", "slow": True}
    return {
        "fit_colors": of(i.fit_colors, **data, lights=[lamp()], upper=9.0, **solver, **finite),
        "fit_daylight": of(
            i.fit_daylight,
            observed=floats(V, 3),
            surface=floats(V, 3),
            albedo=floats(V, 3),
            sunlit=floats(V),
            sky=glow,
            turbidity=(2.5, 6.0),
            exposure=1.0,
            mask=np.ones(V, bool),
            starts=2,
            **solver,
            finite="observed albedo weights sunlit",
            slow=True,
        ),
        "fit_light": of(
            i.fit_light,
            observed=floats(V, 3),
            surface=made(),
            albedo=floats(3),
            degree=1,
            mask=np.ones(V, bool),
            weights=floats(V),
            materials=np.zeros(V, int),
            prior=floats(2),
            noise=0.1,
            loss="squares",
            nonnegative="light",
            window="hann",
            tolerance=1e-5,
            max_steps=100,
            throw=True,
            finite="observed albedo weights prior noise",
            free="path materials nonnegative prior",
            slow=True,
        ),
        "fit_polygons": of(i.fit_polygons, **data, start=[lamp()], turn=True, **solver, **finite),
        "fit_sky": of(
            i.fit_sky,
            **data,
            sky=glow,
            turbidity=(2.5, 6.0),
            exposure=1.0,
            starts=2,
            **solver,
            **finite,
        ),
        "light_variances": of(i.light_variances, degree=2),
        "rectangle_of": of(i.rectangle_of, polygon=lamp()),
    }
