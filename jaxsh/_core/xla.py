"""Control over what XLA fuses and in what pieces it computes."""

import functools
import itertools
import math
from typing import Any

import jax
import jax.numpy as jnp

# Bytes that one call on an accelerator may take for what it computes on the way. Reverse mode
# takes several times that.
_ROOM = 2**30


def on_mesh(*arguments) -> bool:
    """True where an array lives on a mesh of several devices, and inside `shard_map`."""
    leaves = (leaf for leaf in jax.tree.leaves(arguments) if isinstance(leaf, jax.Array))
    return any(math.prod(jax.typeof(leaf).sharding.mesh.axis_sizes) > 1 for leaf in leaves)


def rows_are_split(array) -> bool:
    """True where explicit axes of a mesh share out the leading axis; automatic ones do not tell."""
    return jax.typeof(array).sharding.spec[:1] not in ((), (None,))


def cpu_alone() -> bool:
    """True where JAX has no accelerator: what is slow to trace for one need then not be traced.

    `tests/accelerators.py` says no to it, and so sees what an accelerator would get.
    """
    return jax.default_backend() == "cpu"


def materialize(function, *arguments):
    """`function(*arguments)`, computed once and stored, where XLA would fuse it into each consumer.

    Fused, it would be computed anew for every row of the consumer. On the CPU a conditional is a
    boundary that XLA keeps, where it drops `lax.optimization_barrier`. The other branch is never
    taken: `isnan(x) & (x > 0)` is always false, but XLA cannot prove it, unless x, of the first
    array, is a constant. On accelerators the function is called as it is; so it is on a mesh of
    devices, since a conditional would gather what is sharded.
    """
    function = jax.jit(function)  # traced once for all the uses below
    if on_mesh(arguments):
        return function(*arguments)

    def conditional(*arguments):
        value = jax.tree.leaves(arguments)[0].ravel()[:1]
        never = jnp.any(jnp.isnan(value) & (value > 0))
        shapes = jax.eval_shape(function, *arguments)

        def zeros(*_):
            return jax.tree.map(lambda s: jnp.zeros(s.shape, s.dtype), shapes)

        return jax.lax.cond(never, zeros, function, *arguments)

    if cpu_alone():  # one way to trace: within each other, two ways would be 2^n of them
        return conditional(*arguments)
    return jax.lax.platform_dependent(*arguments, cpu=conditional, default=function)


def as_one(function, *arguments):
    """`function(*arguments)`, on the CPU a branch of its own in the program.

    XLA gives the kernels of a program or of a branch to the threads of its pool if there are more
    than eight. Where they are short that costs more time than it saves: in branches of few kernels
    each they run in turn.
    """
    return materialize(function, *arguments) if cpu_alone() else function(*arguments)


def rounded_once(function, *arguments):
    """`function(*arguments)`, the same bits for all that use it.

    For a place whose whole part is an index and whose rest is a weight. Fused into each use, it may
    be rounded differently in each: on the border of a cell the index is then one cell's and the
    weight another's.
    """
    return jax.lax.optimization_barrier(materialize(function, *arguments))


def in_turn(function, tree, *, most: int | None = None, lapack: bool = False) -> Any:
    """`function` of each row of a tree of arrays: one after the other on one CPU, else all at once.

    For rows that are large themselves, where a batch would only leave the cache. `most` is the
    number of rows that an accelerator takes at once, as far as its memory goes.

    With `lapack`, for a function that factors matrices and rows that no devices share out, also on
    several CPU devices one comes after the other: jaxlib gives LAPACK's batches to the threads that
    the devices' programs run on, and waits there. Two devices that do so at once wait forever
    (jaxlib 0.10.2, two cores).
    """
    rows = len(jax.tree.leaves(tree)[0])

    def loop(tree):
        return jax.lax.map(function, tree)

    def batched(tree):
        if most is None or rows <= most:
            return jax.vmap(function)(tree)
        return jax.lax.map(jax.checkpoint(function), tree, batch_size=most)

    if on_mesh(tree) and not lapack:
        return jax.vmap(function)(tree)
    return jax.lax.platform_dependent(tree, cpu=loop, default=batched)


def varying_as(tree, like):
    """The arrays of a tree, taken to differ between devices inside `shard_map` as those of `like`.

    A loop wants that of the constants that it starts from.
    """
    manual = jax.sharding.AxisType.Manual
    for leaf in jax.tree.leaves(like):
        if manual in jax.typeof(leaf).sharding.mesh.axis_types and leaf.size:
            first = leaf[(0,) * leaf.ndim]
            # Zero, but only the type knows it: the compiler drops what follows.
            zero = jnp.where(first == first, 0, 0)
            tree = jax.tree.map(lambda a, zero=zero: a + zero.astype(a.dtype), tree)
    return tree


def device_cache(maxsize: int):
    """`functools.lru_cache` for constants on a device, apart for each default device and float.

    Computed at once, also while something else is being traced.
    """

    def decorate(function):
        @functools.lru_cache(maxsize=maxsize)
        def keyed(_device, _float, *arguments):
            with jax.ensure_compile_time_eval():
                return function(*arguments)

        @functools.wraps(function)
        def cached(*arguments):
            device = jax.config.jax_default_device  # pyright: ignore[reportAttributeAccessIssue]
            return keyed(device, jnp.result_type(float), *arguments)

        return cached

    return decorate


def rows_on_each(array, axis: int) -> int:
    """Counts the rows along an axis that one device has, where a mesh shares them out."""
    mesh = jax.typeof(array).sharding.mesh
    manual = jax.sharding.AxisType.Manual in mesh.axis_types  # inside `shard_map` the others' left
    devices = 1 if manual else math.prod(mesh.axis_sizes)
    return -(-array.shape[axis] // devices)


def rows_at_once(size: int) -> int:
    """Counts the rows of one call on an accelerator, where each takes `size` bytes."""
    return max(1, _ROOM // max(size, 1))


def equal_blocks(rows: int, most: int) -> int:
    """Sizes blocks: the fewest of equal size and at most `most` rows."""
    return math.ceil(rows / math.ceil(rows / most))


def in_blocks(function, *arrays, size: int, most: int | None = None, out: int = 0):
    """`function(*arrays)`, where rows of the leading axis do not depend on each other.

    On one CPU it runs block by block of `size` rows, whose intermediate values stay in cache, and
    on two or more devices or an accelerator in one call, since a loop would leave them idle. The
    result is the same to rounding. Differentiable: each block is computed anew in reverse mode.

    `most` is the number of rows of one call on an accelerator, where each needs so much memory
    that all together might not fit (`rows_at_once`): more go in the fewest blocks, of equal size.
    `out` is the axis of the rows in the results.
    """
    rows = arrays[0].shape[0]
    if rows <= size or on_mesh(arrays):
        return function(*arrays)
    # The accelerator's way too: what it kept for reverse mode would take memory on the CPU as well.
    anew = jax.checkpoint(function)
    small = functools.partial(block_by_block, anew, size=size, out=out)
    large = anew
    if most is not None and rows > most:
        large = functools.partial(block_by_block, anew, size=equal_blocks(rows, most), out=out)
    return jax.lax.platform_dependent(*arrays, cpu=small, default=large)


def block_by_block(function, *arrays, size: int, out: int = 0):
    """`function(*arrays)` of `size` rows after the other on any device, as `in_blocks` on a CPU.

    The last block is filled up with the last row.
    """
    rows = arrays[0].shape[0]
    if rows <= size:
        return function(*arrays)

    def cut(array):
        padding = [(0, -rows % size)] + [(0, 0)] * (array.ndim - 1)
        return jnp.pad(array, padding, mode="edge").reshape(-1, size, *array.shape[1:])

    def join(blocks):
        moved = jnp.moveaxis(blocks, 0, out)
        joined = (moved.shape[out] * moved.shape[out + 1],)
        shape = moved.shape[:out] + joined + moved.shape[out + 2 :]
        return jax.lax.slice_in_dim(moved.reshape(shape), 0, rows, axis=out)

    done = jax.lax.map(lambda block: function(*block), tuple(cut(array) for array in arrays))
    return jax.tree.map(join, done)


def in_slices(function, *arrays, size: int):
    """`function(*arrays)` as `in_blocks`, for blocks so large that the arrays are not to be copied.

    Each block is sliced out of the arrays, and the last one ends with them: it has rows in common
    with the block before.
    """
    rows = arrays[0].shape[0]
    count, length = math.ceil(rows / size), equal_blocks(rows, size)

    def block(start, *arrays):
        return function(*(jax.lax.dynamic_slice_in_dim(a, start, length) for a in arrays))

    def loop(*arrays):
        starts = jnp.minimum(jnp.arange(count) * length, rows - length)
        anew = jax.checkpoint(lambda start: block(start, *arrays), prevent_cse=False)
        blocks = jax.lax.map(anew, starts)

        def join(blocks):
            ahead = (count - 1) * length
            most = blocks[:-1].reshape(ahead, *blocks.shape[2:])
            return jnp.concatenate([most, blocks[-1, length - (rows - ahead) :]])

        return jax.tree.map(join, blocks)

    if cpu_alone():
        return loop(*arrays)
    return jax.lax.platform_dependent(*arrays, cpu=loop, default=jax.checkpoint(function))


def keep_rows(function, *arguments, like, axis: int, out) -> Any:
    """`function(*arguments)`, with the rows of its results sharded as those of `like` are.

    JAX refuses some operations on arrays with explicit axes, where it cannot tell how their
    results are to be sharded. In here axes are automatic, so that XLA finds the way through.

    - `like`: an array with one row for each row of the results, along its `axis`.
    - `out`: for each result (a pytree prefix of them) the axis of its rows, or None where it has
      none.
    """
    sharding = jax.typeof(like).sharding
    spec = sharding.spec[axis] if axis < len(sharding.spec) else None
    mesh = sharding.mesh
    explicit = jax.sharding.AxisType.Explicit in mesh.axis_types
    if spec is None or not explicit:
        return function(*arguments)

    def shard(axis):
        entries = () if axis is None else (*[None] * axis, spec)
        return jax.sharding.NamedSharding(mesh, jax.sharding.PartitionSpec(*entries))

    out = jax.tree.map(shard, out, is_leaf=lambda axis: axis is None)
    return jax.sharding.auto_axes(function, out_sharding=out)(*arguments)


def keep_batch(function, *arrays, ndims: tuple[int, ...]) -> Any:
    """`function(*arrays)`, whose results lead with the batch that the arrays' leading axes make.

    For arrays with explicit axes, as `keep_rows`, but for any number of batch axes, sharded as
    those of the arguments are. `ndims` are the numbers of axes that do not belong to the batch.
    """
    types = [jax.typeof(array) for array in arrays]
    meshes = [
        t.sharding.mesh
        for t in types
        if jax.sharding.AxisType.Explicit in t.sharding.mesh.axis_types
    ]
    if not meshes:
        return function(*arrays)
    batches = [
        (*t.sharding.spec, *[None] * t.ndim)[: t.ndim - n]
        for t, n in zip(types, ndims, strict=True)
    ]
    # Aligned at their ends, as broadcasting does.
    entries = itertools.zip_longest(*(reversed(batch) for batch in batches))
    spec = [next((e for e in column if e is not None), None) for column in entries][::-1]
    out = jax.sharding.NamedSharding(meshes[0], jax.sharding.PartitionSpec(*spec))
    return jax.sharding.auto_axes(function, out_sharding=out)(*arrays)
