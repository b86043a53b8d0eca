"""The blocks of a store in order, on all devices: the next are read while some are used."""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from queue import SimpleQueue
from typing import TypeVar

import jax
import numpy as np

from ._store import BlockStore

_Result = TypeVar("_Result")


def stream(
    store: BlockStore,
    arrays: Sequence[str],
    use: Callable[..., tuple[slice, _Result]],
    *,
    keep: bool,
) -> Iterator[tuple[slice, _Result]]:
    """Give what a function makes of each block's arrays, in order.

    Of each device's blocks one is used while the next is read: no third is in memory. Unless
    results `keep` what they are made of, its memory is used again.
    """
    devices = jax.local_devices()
    count, ahead = store.num_blocks, len(devices)
    rooms: SimpleQueue[list[np.ndarray | None]] = SimpleQueue()
    for _ in range(2 * ahead):
        rooms.put([None if keep else store.room(name) for name in arrays])

    def read(block: int) -> tuple[list[np.ndarray | None], list[np.ndarray]]:
        room = rooms.get()
        parts = [
            _local(name, store.rows(block), store.read(name, block, part))
            for name, part in zip(arrays, room, strict=True)
        ]
        return room, parts

    with ThreadPoolExecutor(ahead) as pool:
        reading = deque(pool.submit(read, block) for block in range(min(ahead, count)))
        used: deque[tuple[list[np.ndarray | None], tuple[slice, _Result]]] = deque()

        def done() -> tuple[slice, _Result]:
            room, result = used.popleft()
            jax.block_until_ready(result)
            rooms.put(room)
            return result

        try:
            for block in range(count):
                room, host = reading.popleft().result()
                if len(used) == ahead:
                    yield done()
                if block + ahead < count:
                    reading.append(pool.submit(read, block + ahead))
                here = jax.device_put(host, devices[block % ahead])
                used.append((room, use(store.rows(block), *here)))
                del host, here
            while used:
                yield done()
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _local(name: str, rows: slice, values: np.ndarray) -> np.ndarray:
    if name == "neighbors":
        own = np.arange(len(values), dtype=values.dtype)[:, None]
        values = values - values.dtype.type(rows.start)
        return np.where((values >= 0) & (values < len(values)), values, own)
    return values.astype(jax.dtypes.canonicalize_dtype(values.dtype), copy=False)
