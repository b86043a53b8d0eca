"""Indices of rows: equal ones, and groups of what is linked."""

import numpy as np


def first_of_equals(rows: np.ndarray) -> np.ndarray:
    """Give for each row of floats the index of the first one with the same bits."""
    bits = np.ascontiguousarray(rows).view(np.uint32)
    # Rows that are equal have one hash, and are found by sorting that alone.
    key = np.zeros(len(bits), np.uint64)
    for column in bits.T:
        key ^= column
        key *= np.uint64(0x9E3779B97F4A7C15)
        key ^= key >> np.uint64(29)
    first = first_of_keys(key)
    # Two rows with one hash: sort all columns.
    if any((column[first] != column).any() for column in bits.T):
        _, at, group = np.unique(bits, axis=0, return_index=True, return_inverse=True)
        first = at[group.reshape(-1)]
    return first.astype(np.int32)


def first_of_keys(keys: np.ndarray) -> np.ndarray:
    """Give for each key the index of the first equal one."""
    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    begins = np.flatnonzero(np.diff(ordered, prepend=~ordered[:1]) != 0)
    first = np.empty(len(keys), np.int64)
    first[order] = np.repeat(order[begins], np.diff(begins, append=len(keys)))
    return first


def groups(one: np.ndarray, two: np.ndarray, *, number: int) -> tuple[int, np.ndarray]:
    """Count the groups that links between `number` things make of them; label each thing."""
    from scipy.sparse import coo_array, csgraph  # JAX itself needs SciPy

    links = coo_array((np.ones(len(one), np.int8), (one, two)), shape=(number, number))
    count, labels = csgraph.connected_components(links, directed=False)
    return int(count), labels
