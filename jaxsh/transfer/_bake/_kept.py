"""The store of a bake: made once, filled block by block, refused where it is of another bake."""

from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ... import geometry
from ..._core.words import reason
from ...geometry import Mesh, RayScene
from ...harmonics import num_coefficients
from .._store import BlockStore, DamagedError
from .._store_make import block_rows, make, sweep
from ._device import job_of, scene_for
from ._job import BakeArguments, Job, Prepared

_PASSES = "passes"


class BakeStore(BlockStore):
    """Keeps the passes of a bake; the last of them is the transfer.

    Beside the transfer it holds what the rows of any block are computed from, so that a process
    that opens the path needs nothing else.
    """

    @staticmethod
    def of(
        path: Path,
        mesh: Mesh,
        arguments: BakeArguments,
        prepared: Prepared,
        identity: dict[str, Any],
    ) -> "BakeStore":
        """Make the store of a bake, or mend the one that is there, but for its passes.

        `identity` is that of the arguments. Raises what `refuse` does.
        """
        arrays = {
            "positions": np.asarray(mesh.vertices),
            "normals": np.asarray(mesh.normals),
            "faces": np.asarray(mesh.faces),
            "unit_normals": prepared.normals,
            "origins": prepared.origins,
            "albedo": np.atleast_1d(arguments.albedo).astype(np.float64),
        }
        names = [_name(number, arguments.passes) for number in range(arguments.passes)]
        shape = len(prepared.normals), num_coefficients(arguments.degree)
        later = dict.fromkeys(names, (shape, prepared.normals.dtype))
        if not _stands(path):
            arrays["neighbors"] = np.asarray(geometry.neighbors(mesh))
            about = {"degree": arguments.degree, "arguments": identity}
            if make(path, arrays, later, block_rows(shape[0]), about):
                return BakeStore(path)
        refuse(path, identity)
        store = BakeStore(path)
        complete = {name: (array.shape, array.dtype) for name, array in arrays.items()}
        store.add(complete | {"coefficients": later["coefficients"]})
        store.put(**arrays)
        if store.missing("neighbors", check=True):
            store.put(neighbors=np.asarray(geometry.neighbors(mesh)))
        if store.finished:
            store.tidy("coefficients")  # where it was stopped at that
            store.drop(_PASSES)
            sweep(path)
        else:
            store.add(later)
        return store

    @property
    def passes(self) -> int:
        """Count the passes of the bake over the vertices."""
        return 1 + self.attributes["arguments"]["bounces"]

    def job(self, scene: RayScene | None = None, *, threads: int | None = None) -> Job:
        """Build the job from what is stored; by default the mesh is the scene, by `threads`."""
        albedo = self.whole("albedo")
        arguments = BakeArguments.restored(
            self.attributes["arguments"], albedo if len(albedo) > 1 else albedo.reshape(())
        )
        if scene is None and arguments.shadows:
            scene = scene_for(self.mesh(), arguments.device, threads)
            if not arguments.device:
                # Embree builds its tree while neither the mesh nor what follows is in memory.
                scene.occluded(np.zeros(3), np.ones(3))
        prepared = Prepared(self.whole("unit_normals"), self.whole("origins"))
        return job_of(self.mesh() if arguments.bounces else None, arguments, scene, prepared)

    def mesh(self) -> Mesh:
        """Read the mesh."""
        vertices, faces, normals = map(self.whole, ("positions", "faces", "normals"))
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

    def fill(self, number: int, rows: Float[np.ndarray, "v k"]) -> list[slice]:
        """Fill in what is there of a pass, and list the runs of rows that are not."""
        name, missing = self._pass(number), []
        room = self.room(name)
        for block in range(self.num_blocks):
            part = self.rows(block)
            try:
                rows[part] = self.read(name, block, room)
            except DamagedError:
                if missing and missing[-1].stop == part.start:
                    part = slice(missing.pop().start, part.stop)
                missing.append(part)
        return missing

    def ended_by(self, part: slice) -> range:
        """Tell the blocks whose last row is in a part."""
        stop = self.num_blocks if part.stop == self.num_points else part.stop // self.block_rows
        return range(part.start // self.block_rows, stop)

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
        return _name(number, self.passes)


def refuse(path: Path, identity: dict[str, Any]) -> None:
    """Raise `ValueError`, that says what differs, where another bake or another thing is stored."""
    if not _stands(path):
        return
    found = BlockStore(path).attributes.get("arguments")
    found = found if isinstance(found, dict) else {}
    for name, value in identity.items():
        if found.get(name) != value:
            raise ValueError(
                f"{path}: the store of another bake: its {name} is {reason(str(found.get(name)))}, "
                f"and {value} here; it is left as it is"
            )


def _stands(path: Path) -> bool:
    """Tell whether anything is at a path; an empty folder does not count."""
    return path.exists() and not (path.is_dir() and not any(path.iterdir()))


def _name(number: int, passes: int) -> str:
    return "coefficients" if number == passes - 1 else f"{_PASSES}/{number}"
