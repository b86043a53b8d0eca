"""Results of every fit: a value, how it was found, and how sure it is."""

from typing import Any, Generic, TypeVar

import equinox as eqx
import optimistix as optx
from jaxtyping import Array, Bool, Float, Int

Value = TypeVar("Value")


class Statistics(eqx.Module):
    """Report of the solver on its way to the value.

    `residual` is ‖observed − shaded‖ / ‖observed‖, weights included; `steps` are those of the
    start that won. `agreeing` counts the starts that ended in the same place, of `starts` in
    all: where only a few did, the problem has other valleys. `at_bound` tells that a bound stops
    the value: the data want one beyond.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import inverse, midrange, sphere, transfer
    >>> normals = sphere.fibonacci(20).directions
    >>> ball = transfer.unshadowed(0.5 * normals, normals, 1)
    >>> corners = [[-1.0, -1.0, 2.0], [-1.0, 1.0, 2.0], [1.0, 1.0, 2.0], [1.0, -1.0, 2.0]]
    >>> lamp = midrange.Polygon(jnp.asarray(corners), jnp.asarray([3.0, 2.0, 1.0]))
    >>> light = midrange.polygon_harmonics(lamp, ball.positions, 1)
    >>> observed = transfer.shade_diffuse(light, ball, 0.5)
    >>> found = inverse.fit_colors(observed, ball, 0.5, [lamp])
    >>> found.statistics.starts, bool(found.statistics.residual < 1e-5)
    (1, True)
    """

    steps: Int[Array, ""]
    residual: Float[Array, ""]
    agreeing: Int[Array, ""]
    starts: int = eqx.field(static=True)
    at_bound: Bool[Array, ""]


class Confidence(eqx.Module, Generic[Value]):
    """Covariance and deviations of a recovered value: s² D (JᵀJ)⁻¹ Dᵀ.

    J is the Jacobian of the weighted residuals at the value, so JᵀJ the Hessian of Gauss and
    Newton; s² = ‖residuals‖² / (number of data − number of parameters); D carries the parameters
    to the value. `covariance` (n, n) is over the n numbers of the value, in the order of its
    leaves, and singular where these are tied to each other, as x, y and z of a direction are.
    `deviation` holds the roots of its diagonal in the value's own form.

    It takes errors for independent, of equal size (weights aside) and zero on average. A model
    that is itself wrong errs all in one way, and by more than this tells. Infinite for the numbers
    that the data do not determine.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import inverse, midrange, sphere, transfer
    >>> normals = sphere.fibonacci(20).directions
    >>> ball = transfer.unshadowed(0.5 * normals, normals, 1)
    >>> corners = [[-1.0, -1.0, 2.0], [-1.0, 1.0, 2.0], [1.0, 1.0, 2.0], [1.0, -1.0, 2.0]]
    >>> lamp = midrange.Polygon(jnp.asarray(corners), jnp.asarray([3.0, 2.0, 1.0]))
    >>> light = midrange.polygon_harmonics(lamp, ball.positions, 1)
    >>> observed = transfer.shade_diffuse(light, ball, 0.5)
    >>> found = inverse.fit_colors(observed, ball, 0.5, [lamp])
    >>> found.confidence.covariance.shape, found.confidence.deviation.shape
    ((3, 3), (1, 3))
    """

    covariance: Float[Array, "n n"]
    deviation: Value


class Recovered(eqx.Module, Generic[Value]):
    """Value recovered from data, with result code, statistics and confidence.

    `result` is an `optimistix.RESULTS`; `message` puts it in words. Made by `fit_sky`,
    `fit_daylight`, `fit_polygons` and `fit_colors`.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh import inverse, midrange, sphere, transfer
    >>> normals = sphere.fibonacci(20).directions
    >>> ball = transfer.unshadowed(0.5 * normals, normals, 1)
    >>> corners = [[-1.0, -1.0, 2.0], [-1.0, 1.0, 2.0], [1.0, 1.0, 2.0], [1.0, -1.0, 2.0]]
    >>> lamp = midrange.Polygon(jnp.asarray(corners), jnp.asarray([3.0, 2.0, 1.0]))
    >>> light = midrange.polygon_harmonics(lamp, ball.positions, 1)
    >>> observed = transfer.shade_diffuse(light, ball, 0.5)
    >>> found = inverse.fit_colors(observed, ball, 0.5, [lamp])
    >>> found.converged, found.message, found.value.shape
    (True, 'successful', (1, 3))
    """

    value: Value
    result: Any
    statistics: Statistics
    confidence: Confidence[Value]

    @property
    def converged(self) -> bool:
        """True where the solver says so. Outside of `jit` and `vmap`."""
        return bool(self.result == optx.RESULTS.successful)

    @property
    def message(self) -> str:
        """The result code in words."""
        return optx.RESULTS[self.result] or "successful"
