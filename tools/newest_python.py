"""Print the newest Python on this machine, for the newest JAX: it leaves old Pythons behind.

    python tools/newest_python.py

Looks along PATH and among the versions that pyenv keeps; this Python where there is no newer one.
"""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

NEWEST = 14  # 3.14, the newest that pyproject.toml names


def candidates() -> Iterator[str]:
    """Commands that may be a Python, in no order."""
    for minor in range(sys.version_info.minor + 1, NEWEST + 1):
        if found := shutil.which(f"python3.{minor}"):
            yield found
    root = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    yield from map(str, root.glob("versions/3.*/bin/python3"))


def version(command: str) -> tuple[int, int] | None:
    """(major, minor) of a Python that runs and can make environments; None of any other."""
    code = "import ensurepip, ssl, sys; print(*sys.version_info[:2])"
    run = subprocess.run([command, "-c", code], capture_output=True, text=True)
    found = re.fullmatch(r"(\d+) (\d+)\s*", run.stdout)
    return (int(found[1]), int(found[2])) if found else None


def newest() -> str:
    """The newest of all, up to the newest that the project names."""
    known = {command: version(command) for command in [sys.executable, *candidates()]}
    fit = {command: v for command, v in known.items() if v is not None and v <= (3, NEWEST)}
    return max(fit, key=lambda command: fit[command])  # the first of equals: this one


if __name__ == "__main__":
    print(newest())
