"""What every fit gives back."""

from typing import Any, Generic, TypeVar

import equinox as eqx
import optimistix as optx
from jaxtyping import Array, Bool, Float, Int

Value = TypeVar("Value")


class Statistics(eqx.Module):
    """How the solver came to its value.

    `residual` is ‖observed − shaded‖ / ‖observed‖, weights included; `steps` are those of the
    start that won. `agreeing` counts the starts that ended in the same place, of `starts` in
    all: where only a few did, the problem has other valleys. `at_bound` tells that a bound stops
    the value: the data want one beyond.
    """

    steps: Int[Array, ""]
    residual: Float[Array, ""]
    agreeing: Int[Array, ""]
    starts: int = eqx.field(static=True)
    at_bound: Bool[Array, ""]


class Confidence(eqx.Module, Generic[Value]):
    """How surely the data tell the value: s² D (JᵀJ)⁻¹ Dᵀ.

    J is the Jacobian of the weighted residuals at the value, so JᵀJ the Hessian of Gauss and
    Newton; s² = ‖residuals‖² / (number of data − number of parameters); D carries the parameters
    to the value. `covariance` (n, n) is over the n numbers of the value, in the order of its
    leaves, and singular where these are tied to each other, as x, y and z of a direction are.
    `deviation` holds the roots of its diagonal in the value's own form.

    It takes errors for independent, of equal size (weights aside) and zero on average. A model
    that is itself wrong errs all in one way, and by more than this tells. Infinite where the data
    do not determine all parameters.
    """

    covariance: Float[Array, "n n"]
    deviation: Value


class Recovered(eqx.Module, Generic[Value]):
    """A value recovered from data, and what is known of it.

    `result` is an `optimistix.RESULTS`; `message` puts it in words.
    """

    value: Value
    result: Any
    statistics: Statistics
    confidence: Confidence[Value]

    @property
    def converged(self) -> bool:
        """Whether the solver says so. Outside of `jit` and `vmap`."""
        return bool(self.result == optx.RESULTS.successful)

    @property
    def message(self) -> str:
        return optx.RESULTS[self.result] or "successful"
