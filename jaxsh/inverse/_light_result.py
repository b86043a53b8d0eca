"""Result of `fit_light`: a light, and what of it the data determined."""

from jaxtyping import Array, Float

from ._result import Recovered


class RecoveredLight(Recovered[Float[Array, "3 k"]]):
    """Light recovered by `fit_light`: a `Recovered` that tells what was seen and what assumed.

    - `determined` (3, K): the share of each coefficient's prior variance that the data took away,
      1 - posterior/prior: near 1 the data decide, near 0 the value is the prior's zero and the
      deviation the prior's own. The constant coefficient has no prior; it counts as 1. Without a
      prior it is 1, or 0 where nothing determines the coefficient and its deviation is infinite.
    - `noise`: the standard deviation of what was observed, at weight 1, as given or as estimated;
      infinite where, without a prior, as many unknowns as pixels leave nothing to estimate it by.
    - `albedo` (M, 3): the colors of the materials where they were unknown, otherwise None.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import inverse, sphere
    >>> light = jnp.asarray([[3.0, 1.0, 0.5, 0.2], [3.0, 0.8, 0.5, 0.1], [3.0, 0.5, 0.5, 0.0]])
    >>> normals = sphere.fibonacci(100).directions
    >>> observed = 0.5 / jnp.pi * sphere.irradiance(light, normals)
    >>> found = inverse.fit_light(observed, normals, 0.5, 1)
    >>> found.determined.shape, bool(found.determined.min() > 0.99)
    ((3, 4), True)
    """

    determined: Float[Array, "3 k"]
    noise: Float[Array, ""]
    albedo: Float[Array, "m 3"] | None
