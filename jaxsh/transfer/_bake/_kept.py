"""The store of a bake: made once, filled block by block, refused where it is of another bake."""

import functools
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ... import geometry
from ..._core.words import reason
from ...geometry import Mesh, Surface
from ...harmonics import num_coefficients
from .._store import BlockStore, DamagedError
from .._store_make import block_rows, make, sweep
from .._surfaces import points_and_normals
from ._device import Jobs, jobs_of, scene_for
from ._job import USUAL, BakeArguments, Prepared, Step

_PASSES, _OCCLUDER = "passes", "occluder"


class BakeStore(BlockStore):
    """Keeps the passes of a bake; the last of them is the transfer.

    Beside the transfer it holds what the rows of any block are computed from, so that a process
    that opens the path needs nothing else.
    """

    @staticmethod
    def of(
        path: Path,
        surface: Surface,
        mesh: Mesh | None,
        arguments: BakeArguments,
        prepared: Prepared,
        reflector: Prepared | None,
        identity: dict[str, Any],
    ) -> "BakeStore":
        """Make the store of a bake, or mend the one that is there, but for its passes.

        `identity` is that of the arguments. Raises what `refuse` does.
        """
        positions, normals = points_and_normals(surface)
        arrays = {
            "positions": np.asarray(positions),
            "normals": np.asarray(np.zeros_like(positions) if normals is None else normals),
            "unit_normals": prepared.normals,
            "origins": prepared.origins,
            "albedo": np.atleast_1d(arguments.albedo).astype(np.float64),
        }
        if isinstance(surface, Mesh):
            arrays["faces"] = np.asarray(surface.faces)
        if arguments.apart and mesh is not None:
            arrays |= _of_occluder(mesh, reflector)
        steps, width = arguments.steps, num_coefficients(arguments.degree)
        later, apart = {}, [name for name in arrays if name.startswith(f"{_OCCLUDER}/")]
        for number, step in enumerate(steps):
            name, made = _name(number, len(steps)), prepared
            if step.reflector and reflector is not None:
                made = reflector
                apart.append(name)
            later[name] = (len(made.normals), width), made.normals.dtype
        # In blocks of their own, as there may be far more or fewer of them than points.
        apart = dict.fromkeys(apart, 0 if mesh is None else block_rows(len(mesh.vertices)))
        if not _stands(path):
            arrays["neighbors"] = np.asarray(neighbors_of(surface))
            about = {"degree": arguments.degree, "arguments": identity}
            if arguments.surface != "vertices":  # what older versions do not read
                about |= {"surface": arguments.surface, "cosine": arguments.cosine}
            if make(path, arrays, later, block_rows(len(prepared.normals)), about, apart):
                return BakeStore(path)
        refuse(path, identity)
        store = BakeStore(path)
        complete = {name: (array.shape, array.dtype) for name, array in arrays.items()}
        store.add(complete | {"coefficients": later["coefficients"]}, apart)
        store.put(**arrays)
        if store.missing("neighbors", check=True):
            store.put(neighbors=np.asarray(neighbors_of(surface)))
        if store.finished:
            store.tidy("coefficients")  # where it was stopped at that
            store.drop(_PASSES)
            sweep(path)
        else:
            store.add(later, apart)
        return store

    @functools.cached_property
    def arguments(self) -> BakeArguments:
        """Read the arguments of the bake."""
        albedo = self.whole("albedo")
        return BakeArguments.restored(
            self.attributes["arguments"], albedo if len(albedo) > 1 else albedo.reshape(())
        )

    @functools.cached_property
    def steps(self) -> list[Step]:
        """List the passes of the bake."""
        return self.arguments.steps

    def jobs(self, *, threads: int | None = None) -> Jobs:
        """Build the jobs from what is stored, by `threads`; the mesh alone stops rays."""
        arguments, scene, reflector = self.arguments, None, None
        if arguments.shadows:
            scene = scene_for(self.mesh(), arguments.device, threads)
            if not arguments.device:
                # Embree builds its tree while neither the mesh nor what follows is in memory.
                scene.occluded(np.zeros(3), np.ones(3))
        prepared = Prepared(self.whole("unit_normals"), self.whole("origins"))
        if arguments.bounces and arguments.apart:
            held = (self.whole(f"{_OCCLUDER}/{name}") for name in ("normals", "origins"))
            reflector = Prepared(*held)
        mesh = self.mesh() if arguments.bounces else None
        return jobs_of(mesh, arguments, scene, prepared, reflector)

    def mesh(self) -> Mesh:
        """Read the mesh that stops rays, and that light bounces off."""
        names = "positions", "faces", "normals"
        if self.arguments.apart:
            names = (f"{_OCCLUDER}/{name}" for name in ("vertices", "faces", "normals"))
        vertices, faces, normals = map(self.whole, names)
        with jax.enable_x64(True):  # as stored, whatever this process computes in
            return Mesh(jnp.asarray(vertices), jnp.asarray(faces), jnp.asarray(normals))

    def read_pass(self, number: int, block: int) -> Float[np.ndarray, "rows k"]:
        """Read one block of a pass; raises `DamagedError` where it is not right."""
        return self.read(self._pass(number), block)

    def whole_pass(self, number: int) -> Float[np.ndarray, "v k"]:
        """Read a pass; raises `DamagedError` for the first block that is not right."""
        return self.whole(self._pass(number))

    def write_pass(self, number: int, block: int, values: Float[np.ndarray, "rows k"]) -> None:
        """Write one block of a pass: its file is there whole, or not at all."""
        self.write(self._pass(number), block, values)

    def blocks_of_pass(self, number: int) -> int:
        """Count the blocks of a pass."""
        return self.blocks(self._pass(number))

    def rows_of_pass(self, number: int, block: int) -> slice:
        """Tell which rows of a pass a block holds."""
        return self.rows(block, self._pass(number))

    def fill(self, number: int, rows: Float[np.ndarray, "v k"]) -> list[slice]:
        """Fill in what is there of a pass, and list the runs of rows that are not."""
        name, missing = self._pass(number), []
        room = self.room(name)
        for block in range(self.blocks(name)):
            part = self.rows(block, name)
            try:
                rows[part] = self.read(name, block, room)
            except DamagedError:
                if missing and missing[-1].stop == part.start:
                    part = slice(missing.pop().start, part.stop)
                missing.append(part)
        return missing

    def ended_by(self, number: int, part: slice) -> range:
        """Tell the blocks of a pass whose last row is in a part."""
        whole, size = self.blocks_of_pass(number), self.rows_of_pass(number, 0)
        end = part.stop // max(size.stop, 1)
        last = self.rows_of_pass(number, whole - 1).stop == part.stop
        return range(part.start // max(size.stop, 1), whole if last else end)

    @property
    def finished(self) -> bool:
        """Tell whether `finish` was called, and each block of the transfer is still right."""
        return "warning" in self.attributes and not self.missing(check=True)

    def finish(self, warning: str) -> None:
        """Keep what the user is to be told, and let go of what only the bake needed."""
        self.settle("coefficients", warning=warning)
        sweep(self.path)
        self.drop(_PASSES)

    def _pass(self, number: int) -> str:
        return _name(number, len(self.steps))


def refuse(path: Path, identity: dict[str, Any]) -> None:
    """Raise `ValueError`, that says what differs, where another bake or another thing is stored."""
    if not _stands(path):
        return
    found = BlockStore(path).attributes.get("arguments")
    found = found if isinstance(found, dict) else {}
    if name := differing(found, identity):
        said = reason(str((USUAL | found).get(name)))
        raise ValueError(
            f"{path}: the store of another bake: its {name} is {said}, and {identity[name]} here; "
            "it is left as it is"
        )


def differing(found: dict[str, Any], identity: dict[str, Any]) -> str | None:
    """Name the first argument in which a store is another bake's; None where it is this one's."""
    found = USUAL | found
    names = ("surface", "cosine", *identity)  # what says most, first
    return next((name for name in names if found.get(name) != identity[name]), None)


def neighbors_of(surface: Surface) -> Int[Array | np.ndarray, "v n"]:
    """Give the table of neighbors: points and texels have none, and stand for themselves."""
    if isinstance(surface, Mesh):
        return geometry.neighbors(surface)
    return jnp.arange(surface.num_points, dtype=jnp.int32)[:, None]


def _of_occluder(mesh: Mesh, reflector: Prepared | None) -> dict[str, np.ndarray]:
    """Give what is stored of the mesh in the way of points that are not its vertices."""
    arrays = {"vertices": mesh.vertices, "faces": mesh.faces, "normals": mesh.normals}
    if reflector is not None:
        arrays |= reflector._asdict()  # whose normals are of unit length
    return {f"{_OCCLUDER}/{name}": np.asarray(array) for name, array in arrays.items()}


def _stands(path: Path) -> bool:
    """Tell whether anything is at a path; an empty folder does not count."""
    return path.exists() and not (path.is_dir() and not any(path.iterdir()))


def _name(number: int, passes: int) -> str:
    return "coefficients" if number == passes - 1 else f"{_PASSES}/{number}"
