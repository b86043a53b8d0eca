"""The structure that `docs/architecture.md` describes, read from the source."""

import ast
import importlib
import inspect
import tomllib
from collections.abc import Iterator
from pathlib import Path

import faces
import pytest

import jaxsh

ROOT = Path(__file__).parents[1]
SOURCES = sorted((ROOT / "jaxsh").rglob("*.py"))

# A module imports only from floors below its own.
FLOORS = {
    "_core": 0,
    "harmonics": 1,
    "geometry": 1,
    "sphere": 2,
    "imaging": 2,
    "transfer": 3,
    "sky": 3,
    "plot": 3,
    "_check": 3,
    "midrange": 4,
    "adaptive": 4,
    "inverse": 5,
    "viewer": 6,
}
# Private files that another module may import.
DOORS = {
    "geometry._pairs",
    "harmonics._convention",
    "harmonics._conventions",
    "harmonics._polynomials",
    "harmonics._tables",
    "harmonics._turns",
    "sky._sun",
    "transfer._glossy_kernels",
}
# First words of a docstring that hide its verb.
VAGUE = {"of", "what", "that", "those", "as", "which", "whether", "how", "where", "with", "from"}


def imported(path: Path, source: str = "") -> Iterator[tuple[str, list[str]]]:
    """Each `from … import …` and `import …` of a file: an absolute name, and what is taken."""
    package = path.relative_to(ROOT).with_suffix("").parts[:-1]
    for node in ast.walk(ast.parse(source or path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, []
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else ()
            name = ".".join([*base, *([node.module] if node.module else [])])
            yield name, [alias.name for alias in node.names]


def across(path: Path, source: str = "") -> Iterator[tuple[str, str]]:
    """(importing module, dotted path below `jaxsh`) of what a file takes from other modules."""
    own = path.relative_to(ROOT / "jaxsh").parts[0]
    for name, taken in imported(path, source):
        parts = name.split(".")
        if parts[0] != "jaxsh":
            continue
        # `from .. import sphere` names a module in its second half.
        for rest in [parts[1:]] if len(parts) > 1 else [[one] for one in taken]:
            if rest and rest[0] in FLOORS and rest[0] != own:
                yield own, ".".join(rest)


def short(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def test_the_reader_of_imports_reads_all_forms():
    # The tests below say nothing if this finds nothing.
    source = ROOT / "jaxsh" / "sphere" / "_project.py"
    tree = "from ..sky._fit import a; from .. import sky; import jaxsh.sky._fit; from . import _own"
    read = list(imported(source, tree))
    assert read == [
        ("jaxsh.sky._fit", ["a"]),
        ("jaxsh", ["sky"]),
        ("jaxsh.sky._fit", []),
        ("jaxsh.sphere", ["_own"]),
    ]
    targets = [target for _, target in across(source, tree)]
    assert targets == ["sky._fit", "sky", "sky._fit"]


def test_every_module_has_a_floor():
    assert set(FLOORS) == {path.parent.name for path in (ROOT / "jaxsh").glob("*/__init__.py")}
    assert set(FLOORS) - {"_core"} == set(faces.PACKAGES)


def test_versions_agree():
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
    assert jaxsh.__version__ == declared
    assert f"\nversion: {declared}\n" in (ROOT / "CITATION.cff").read_text("utf-8")
    assert f"\n## {declared}" in (ROOT / "CHANGELOG.md").read_text("utf-8")


def test_each_module_has_its_page():
    navigation = (ROOT / "mkdocs.yml").read_text("utf-8")
    for module in [*faces.MODULES, "check"]:
        assert f"::: jaxsh.{module}" in (ROOT / f"docs/api/{module}.md").read_text("utf-8")
        assert f"{module}: api/{module}.md" in navigation


def test_private_files_are_imported_through_doors_only():
    found = set()
    for path in SOURCES[1:]:
        for _, target in across(path):
            module, *rest = target.split(".")
            if module != "_core" and rest and target not in DOORS:
                found.add(f"{short(path)} imports {target}")
    assert found == set()


def test_the_page_names_each_door():
    page = (ROOT / "docs/architecture.md").read_text("utf-8")
    assert {door for door in DOORS if f"`{door.replace('.', '/')}.py`" not in page} == set()


def test_modules_import_only_from_floors_below():
    found = set()
    for path in SOURCES[1:]:
        for own, target in across(path):
            if FLOORS[target.split(".")[0]] >= FLOORS[own]:
                found.add(f"{short(path)} imports {target}")
    assert found == set()


@pytest.mark.parametrize("folder", ["experiments", "benchmarks"])
def test_users_import_public_names_only(folder):
    found = set()
    for path in sorted((ROOT / folder).rglob("*.py")):
        for name, taken in imported(path):
            parts = name.split(".")
            if parts[0] == "jaxsh" and any(part.startswith("_") for part in [*parts, *taken]):
                found.add(f"{short(path)} imports {name}: {', '.join(taken)}")
    assert found == set()


def test_precision_has_one_switch():
    found = set()
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            stated = isinstance(node, ast.keyword) and node.arg == "precision"
            named = isinstance(node, ast.Attribute) and node.attr.endswith("matmul_precision")
            if stated or named:
                found.add(short(path))
    assert found <= {"jaxsh/_core/linalg.py"}


def public() -> Iterator[tuple[str, object]]:
    """Each public function and class, and each public method that one of ours defines."""
    for module in faces.PACKAGES:
        namespace = importlib.import_module(f"jaxsh.{module}")
        for name in namespace.__all__:
            thing = getattr(namespace, name)
            if inspect.isclass(thing) or callable(thing):
                yield f"{module}.{name}", thing


def first_word(doc: str) -> str:
    return doc.split()[0].strip("\"'`,.:;()").lower()


def test_public_docstrings_open_with_what_they_do():
    found = {
        name
        for name, thing in public()
        if not (doc := inspect.getdoc(thing)) or first_word(doc) in VAGUE
    }
    assert found == set()


def test_private_docstrings_do_too():
    found = set()
    for path in SOURCES:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for node in ast.walk(tree):
            kinds = ast.Module, ast.FunctionDef, ast.ClassDef
            doc = ast.get_docstring(node) if isinstance(node, kinds) else None
            if doc and first_word(doc) in VAGUE:
                name = getattr(node, "name", "the file")
                found.add(f"{short(path)}: {name}: {doc.splitlines()[0]}")
    assert found == set()


def test_public_docstrings_hold_an_example_that_runs():
    found = {name for name, thing in public() if ">>> " not in (inspect.getdoc(thing) or "")}
    assert found == set()


def test_files_are_of_a_length_to_read():
    lengths = {short(path): len(path.read_text("utf-8").splitlines()) for path in SOURCES}
    assert {path: lines for path, lines in lengths.items() if lines > 400} == {}
