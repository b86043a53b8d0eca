"""Where the public names of jaxsh stand."""

from pathlib import Path

import jaxsh

_FOLDER = Path(jaxsh.__file__).parent

# Public modules, and what stands at the top of the package by itself.
MODULES = [name for name in jaxsh.__all__ if (_FOLDER / name).is_dir()]
TOP = [name for name in jaxsh.__all__ if name not in MODULES]
# The folders that hold public names, in their `__all__`.
PACKAGES = [*MODULES, "_check"]
