"""A boundary that XLA does not fuse across."""

import jax
import jax.numpy as jnp


def fenced(function, *arguments):
    """`function(*arguments)`, computed once and kept, where XLA would fuse it into each consumer.

    And so compute it anew for every row of that. On the CPU a conditional is a boundary that it
    keeps, where it drops `lax.optimization_barrier`. The branch is never taken, but must look as
    if it might: no number is above zero and no number.
    """
    function = jax.jit(function)  # traced once for all the uses below

    def conditional(*arguments):
        value = jax.tree.leaves(arguments)[0].ravel()[:1]
        never = jnp.any(jnp.isnan(value) & (value > 0))
        shapes = jax.eval_shape(function, *arguments)

        def zeros(*_):
            return jax.tree.map(lambda s: jnp.zeros(s.shape, s.dtype), shapes)

        return jax.lax.cond(never, zeros, function, *arguments)

    return jax.lax.platform_dependent(*arguments, cpu=conditional, default=function)
