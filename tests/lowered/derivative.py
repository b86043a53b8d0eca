"""A call together with its derivative in reverse mode, which starts at all floats of the result."""

import jax
import jax.numpy as jnp


def with_gradient(call):
    """The function of a call, giving its result and, where it has one, the gradient as well."""

    def both(*arguments):
        leaves, tree = jax.tree.flatten(arguments)
        floats = [leaf for leaf in leaves if is_float(leaf)]

        def size(floats):
            new = iter(floats)
            given = [next(new) if is_float(leaf) else leaf for leaf in leaves]
            result = call.function(*jax.tree.unflatten(tree, given))
            return sum(jnp.sum(leaf**3) for leaf in jax.tree.leaves(result) if is_float(leaf))

        return call.function(*arguments), jax.grad(size)(floats)

    return both if call.reverse else call.function


def is_float(leaf) -> bool:
    return hasattr(leaf, "dtype") and jnp.issubdtype(leaf.dtype, jnp.floating)
