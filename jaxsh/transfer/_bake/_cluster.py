"""A bake on a cluster: Dask's workers fill a store, block by block."""

import contextlib
import itertools
import os
import uuid
import warnings
from collections.abc import Generator, Iterator
from typing import Any

import numpy as np
from jaxtyping import ArrayLike, Float, Int

from ..._core.checks import as_path, check_flag, check_type
from ..._core.host import cores
from ..._core.words import reason
from ...geometry import Mesh, Surface
from .._stored import StoredTransfer, open
from .._surfaces import points_and_normals
from ._blind import why_blind
from ._device import scene_for
from ._faults import checked, faults
from ._job import Prepared
from ._kept import BakeStore, refuse
from ._origins import origins
from ._passes import progress_bar
from ._receivers import unit_normals, units_of
from ._worker import Task, let_go

# Blocks in the scheduler's hands at once: enough for thousands of workers, and for a bake of any
# size little of its memory.
_AHEAD = 4096
# Of a cluster of our own: any free port for its page, so that others keep theirs.
_PLAIN: Any = {"dashboard_address": ":0"}


def bake_on(
    client: Any,
    surface: Surface,
    degree: int,
    *,
    store: str | os.PathLike[str],
    directions: int = 2048,
    shadows: bool = True,
    bounces: int = 0,
    albedo: Float[ArrayLike, "*v"] = 0.5,
    ray_bias: float | None = None,
    offset: float | None = None,
    scene: Mesh | None = None,
    device: bool = False,
    seed: int = 0,
    chunk: int = 256,
    progress: bool = True,
) -> StoredTransfer:
    """Bake into a store on the workers of a Dask cluster, many machines if need be.

    A task is a block of points, whose coefficients a worker writes to the store by itself; the
    scheduler sees a bit a point at most. A worker reads what it needs from the store and builds
    the tree of the mesh once. So a worker may die and others come at any time: what it was at is
    done again. After any end of this call, the same call goes on with what is missing or
    damaged, and so does `bake(..., store=...)`, to the same bits (on processors of one kind).

    **Arguments**

    - `client`: a `distributed.Client`, the address of a scheduler, or None for workers of its own
      on this machine: one process with a thread a core.
    - `store`: a folder that this process and all workers see under one path.
    - `device`: casts rays by JAX on each worker's default device, and not by Embree.
    - `scene`: the mesh that stops rays, where that is not the surface's own.
    - `chunk`: points at a time on each thread of a worker, rounded up to a multiple of 64.
    - `progress`: shows a bar when standard error is a terminal and the bake takes over a second.
    - all others: as for `bake`. One mesh alone stops rays: no scene of rays reaches the workers.

    **Returns** the `StoredTransfer` that `transfer.open` gives. Nothing of the size of its
    coefficients is ever in the memory of this process. A worker process holds the mesh's tree, up
    to 0.25 KB a vertex (experiment `scale`), and for bounces the coefficients before them: give a
    machine one process of many threads rather than many of one.

    Workers need this version of jaxsh. Where there are none, the call waits for some. A block
    fails for good where four workers died of it, as of too little memory. One `UserWarning` counts
    points without light, as in `bake`.

    Raises `ImportError` without the package `distributed` (the extra `scale`), `ConnectionError`
    where the scheduler cannot be reached or goes away, `RuntimeError` for a block that workers
    die of, `OSError` where a worker cannot write, and `ValueError` and `TypeError` as `bake` does.

    **Example**

    >>> import tempfile
    >>> from distributed import Client
    >>> from jaxsh import geometry, transfer
    >>> folder = tempfile.TemporaryDirectory()
    >>> client = Client(processes=False, dashboard_address=":0")
    >>> mesh = geometry.knot(300)
    >>> with folder as path, client:
    ...     stored = transfer.bake_on(client, mesh, 2, directions=64, store=f"{path}/knot")
    >>> stored.num_points, stored.degree
    (300, 2)
    """
    path = as_path(store, "store").absolute()
    if scene is not None:
        check_type("scene", scene, Mesh)
    arguments, mesh, _ = checked(
        surface,
        degree,
        directions=directions,
        shadows=shadows,
        bounces=bounces,
        albedo=albedo,
        ray_bias=ray_bias,
        offset=offset,
        seed=seed,
        chunk=chunk,
        scene=scene,
        device=check_flag("device", device),
    )
    identity = arguments.identity(surface)
    refuse(path, identity)
    path.parent.mkdir(parents=True, exist_ok=True)  # or fails before all work
    normals = units_of(surface)
    with _connected(client) as connected:
        start, reflector = None, None
        if shadows:
            caster = scene_for(mesh, arguments.device)
            start = origins(surface, normals, caster, ray_bias, offset, mesh=mesh)
            if arguments.bounces and arguments.apart:
                assert mesh is not None
                units = unit_normals(mesh)
                off = origins(mesh, units, caster, ray_bias, offset)
                reflector = Prepared(units, off.positions)
            del caster  # the workers have theirs

        def why(blind: Int[np.ndarray, " n"]) -> list[str]:
            assert start is not None  # without shadows no point is blind
            caster = scene_for(mesh, arguments.device)
            return why_blind(surface, mesh, caster, blind, normals, start)

        positions = np.asarray(points_and_normals(surface)[0]) if start is None else start.positions
        prepared = Prepared(normals, positions)
        kept = BakeStore.of(path, surface, mesh, arguments, prepared, reflector, identity)
        if not kept.finished:
            blind = _fill(connected, kept, identity, chunk, progress)
            kept.finish(faults(surface, normals, blind, why))
    if said := kept.attributes["warning"]:
        warnings.warn(said, UserWarning, stacklevel=2)
    return open(path)


@contextlib.contextmanager
def _connected(client: Any) -> Iterator[Any]:
    """Give a client; what is started here, a cluster or a connection, is ended here."""
    try:
        from distributed import Client, LocalCluster
    except ImportError as error:
        raise ImportError(
            "bake_on needs the package distributed: pip install 'jaxsh[scale]'"
        ) from error
    if client is None:
        with (
            LocalCluster(n_workers=1, threads_per_worker=cores(), **_PLAIN) as cluster,
            Client(cluster) as own,
        ):
            yield own
    elif isinstance(client, str):
        try:
            own = Client(client)
        except (OSError, ValueError) as error:
            raise ConnectionError(f"bake_on: no scheduler at {client}: {reason(error)}") from error
        with own:
            yield own
    elif isinstance(client, Client):
        if client.asynchronous:
            raise TypeError("expected a client that waits, got one with asynchronous=True")
        if client.status in ("closing", "closed"):
            raise ConnectionError("bake_on: the client is closed")
        yield client
    else:
        raise TypeError(
            "expected client as a distributed.Client, an address or None, got "
            f"{type(client).__name__}"
        )


def _fill(
    client: Any, kept: BakeStore, identity: dict[str, Any], chunk: int, progress: bool
) -> Int[np.ndarray, " n"]:
    """Fill all passes of a store; gives the points that have a normal and see nothing."""
    blind = np.zeros(kept.num_points, bool)
    blocks = [kept.blocks_of_pass(number) for number in range(len(kept.steps))]
    total = sum(kept.rows_of_pass(n, count - 1).stop for n, count in enumerate(blocks))
    with progress_bar(total, progress) as bar, _letting_go(client):
        for number, whole in enumerate(blocks):
            task = Task(str(kept.path), identity, number, chunk)
            with contextlib.closing(_answers(client, task, whole)) as answers:
                for block, found in answers:
                    part = kept.rows_of_pass(number, block)
                    count = part.stop - part.start
                    if found is not None:
                        blind[part] = np.unpackbits(np.frombuffer(found, np.uint8), count=count)
                    bar.update(count)
    return np.flatnonzero(blind)


@contextlib.contextmanager
def _letting_go(client: Any) -> Iterator[None]:
    """Have workers free what they keep of a bake, however it ends."""
    reached = True
    try:
        yield
    except ConnectionError:  # to try would wait for the scheduler
        reached = False
        raise
    finally:
        if reached:
            with contextlib.suppress(OSError):
                client.run(let_go, on_error="ignore")


def _answers(client: Any, task: Task, blocks: int) -> Generator[tuple[int, bytes | None]]:
    """Run a task for each block and yield blocks and answers as they come."""
    from concurrent.futures import CancelledError

    from distributed import KilledWorker, as_completed
    from distributed.comm.core import CommClosedError

    waiting, name = iter(range(blocks)), f"bake-{uuid.uuid4().hex}-{task.number}"
    running: dict[Any, int] = {}
    finished = as_completed(loop=client.loop)  # the default client may be another

    def submit(most: int) -> None:
        for block in itertools.islice(waiting, most):
            future = client.submit(task, block, key=f"{name}-{block}", pure=False)
            running[future] = block
            finished.add(future)

    try:
        submit(_AHEAD)
        for future in finished:
            answer = future.result()
            yield running.pop(future), answer
            submit(1)
    except (CommClosedError, CancelledError, TimeoutError) as error:
        running.clear()  # to cancel them would wait for the scheduler
        raise ConnectionError(
            f"bake_on: the scheduler went away, or dropped the tasks ({reason(error)}): what is "
            f"written stays in {task.path}, and the same call goes on from there"
        ) from error
    except KilledWorker as error:
        raise RuntimeError(
            f"bake_on: a block of {task.path} was given up, as each worker that had it died, "
            "perhaps of too little memory; other blocks stay, and the same call goes on from there"
        ) from error
    finally:
        if running:
            client.cancel(list(running))
