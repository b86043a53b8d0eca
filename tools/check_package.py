"""Check what a wheel and an sdist hold, after `python -m build`.

python tools/check_package.py dist
"""

import re
import sys
import tarfile
import zipfile
from pathlib import Path

WHEEL_NEEDS = {
    *("jaxsh/__init__.py", "jaxsh/py.typed", "jaxsh/sky/preetham.npz"),
    *("jaxsh/viewer/js/page.html", "jaxsh/viewer/js/style.css", "jaxsh/viewer/js/renderer.js"),
}
# The source builds the documentation and runs its own tests.
SOURCE_NEEDS = {
    *("CITATION.cff", "CONTRIBUTING.md", "CHANGELOG.md", "LICENSE", "Makefile", "mkdocs.yml"),
    *("README.md", "conftest.py", "docs/index.md", "docs/images/first_light.png"),
    *("experiments/__main__.py", "tests/conftest.py", "tools/floors.py", ".ci/run"),
    *("notebooks/01_harmonics.ipynb", "benchmarks/__main__.py"),
}


def problems(folder: Path) -> list[str]:
    """Sentences that say what is missing or too much."""
    (wheel,), (source,) = folder.glob("*.whl"), folder.glob("*.tar.gz")
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        (metadata,) = [name for name in names if name.endswith(".dist-info/METADATA")]
        description = archive.read(metadata).decode()
    with tarfile.open(source) as archive:
        files = {name.partition("/")[2] for name in archive.getnames()}
    others = {name for name in names if not re.match(r"jaxsh(/|-[^/]*\.dist-info/)", name)}
    scripts = {name for name in names if re.search(r"/(make_|test)[^/]*\.py$", name)}
    links = re.findall(r"\]\((?!https?:)[^)]*\)", description)
    return [
        *(f"the wheel lacks {name}" for name in sorted(WHEEL_NEEDS - names)),
        *(f"the wheel should not hold {name}" for name in sorted(others | scripts)),
        *(f"the description's link leads nowhere on a package index: {link}" for link in links),
        *(f"the sdist lacks {name}" for name in sorted(SOURCE_NEEDS - files)),
    ]


if __name__ == "__main__":
    found = problems(Path(sys.argv[1]))
    print("\n".join(found) or "wheel and sdist are whole")
    sys.exit(bool(found))
