"""Where an experiment's meshes and environments come from."""

import os
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING

from .errors import UserError, unknown

if TYPE_CHECKING:
    import numpy as np
    from jax import Array

    from jaxsh.geometry import Mesh

VARIABLE = "JAXSH_DATA"
_EMBEDDED = {"meshes": ["knot"], "envmaps": ["studio"]}
_SUFFIX = {"meshes": ".ply", "envmaps": ".exr"}


class Data:
    """Meshes and environments by name, and published numbers where they are at hand.

    They come from a folder with ``meshes/*.ply`` and ``envmaps/*.exr`` (lat-long, this package's
    orientation), and may hold ``reference/*.npz``. Without a folder an embedded default serves,
    made at run time: the mesh "knot", a trefoil that shadows itself, and the environment "studio",
    a soft room with a small bright lamp.
    """

    def __init__(self, folder: Path | None = None):
        self.folder = folder
        if folder is None:
            return
        if not folder.is_dir():
            raise UserError(f"there is no data folder {str(folder)!r}")
        if not (self.meshes() or self.environments()):
            raise UserError(
                f"the data folder {str(folder)!r} has neither meshes/*.ply nor envmaps/*.exr"
            )

    @classmethod
    def find(cls, option: Path | None) -> "Data":
        """The folder of ``--data``, else of JAXSH_DATA, else the embedded default."""
        variable = os.environ.get(VARIABLE)
        return cls(option or (Path(variable) if variable else None))

    @property
    def source(self) -> str:
        return "the embedded data" if self.folder is None else str(self.folder)

    def meshes(self) -> list[str]:
        """The names that `mesh` takes."""
        return self._names("meshes")

    def environments(self) -> list[str]:
        """The names that `environment` takes."""
        return self._names("envmaps")

    def mesh(self, name: str) -> "Mesh":
        from jaxsh import geometry

        path = self._path("meshes", name)
        if path is None:
            return geometry.knot()
        return _read(geometry.read_mesh, path)

    def environment(self, name: str) -> "Array":
        """A lat-long picture of linear radiance, (height, width, 3)."""
        from jaxsh import imaging

        path = self._path("envmaps", name)
        if path is None:
            return imaging.studio()
        return _read(imaging.read_environment, path)

    def reference(self, name: str) -> "dict[str, np.ndarray] | None":
        """Published numbers to compare with, arrays by name from ``reference/<name>.npz``.

        None where the folder has none: they are not ours to embed.
        """
        path = self.folder and self.folder / "reference" / f"{name}.npz"
        if path is None or not path.exists():
            return None
        return _read(_arrays, path)

    def _names(self, kind: str) -> list[str]:
        if self.folder is None:
            return _EMBEDDED[kind]
        return sorted(path.stem for path in (self.folder / kind).glob(f"*{_SUFFIX[kind]}"))

    def _path(self, kind: str, name: str) -> Path | None:
        """The file of this name; None where the embedded default serves."""
        names = self._names(kind)
        if name not in names:
            noun = {"meshes": "mesh", "envmaps": "environment"}[kind]
            raise unknown(noun, name, names, where=self.source)
        return self.folder and self.folder / kind / f"{name}{_SUFFIX[kind]}"


def _arrays(path: Path) -> "dict[str, np.ndarray]":
    import numpy as np

    try:
        # NumPy leaves a file that it opened itself open where the archive in it is torn.
        with path.open("rb") as file, np.load(file) as stored:
            return dict(stored)
    except (EOFError, TypeError, ValueError, zipfile.BadZipFile) as error:
        raise ValueError(f"{path} holds no arrays: {error}") from error


def _read(read, path: Path):
    try:
        return read(path)
    except (OSError, ValueError) as error:
        # A bad file is the user's to mend; the readers name the file and the problem.
        raise UserError(" ".join(str(error).split())) from error
