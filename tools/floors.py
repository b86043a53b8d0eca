"""Print the lowest versions that pyproject.toml allows, as a constraints file for pip.

    python tools/floors.py > floors.txt

Of the numerical stack only; what draws, reads files or tests is left at its newest.
"""

import re
import tomllib
from pathlib import Path

STACK = {"jax", "equinox", "jaxtyping", "lineax", "numpy", "optimistix", "scipy"}


def floors(requirements: list[str]) -> list[str]:
    """`name==version` for each requirement of the stack, and jaxlib beside jax."""
    found = [re.match(r"([\w-]+)>=([\w.]+)", line) for line in requirements]
    pins = [f"{one[1]}=={one[2]}" for one in found if one and one[1] in STACK]
    return pins + [pin.replace("jax==", "jaxlib==") for pin in pins if pin.startswith("jax==")]


if __name__ == "__main__":
    path = Path(__file__).parents[1] / "pyproject.toml"
    project = tomllib.loads(path.read_text(encoding="utf-8"))["project"]
    print("\n".join(floors(project["dependencies"])))
