"""What code an experiment's numbers come from: so that results know when they are stale."""

import ast
import functools
import hashlib
from collections.abc import Iterator
from pathlib import Path

import experiments

ROOT = Path(experiments.__file__).parent.parent
_OURS = ("jaxsh", "experiments")
# What runs experiments and writes or shows results changes no number; what they read does.
_RUNNER = "experiments/runner/"
_COUNTS = (f"{_RUNNER}context.py", f"{_RUNNER}data.py")
_LEFT_OUT = ("experiments/__init__.py", "jaxsh/__init__.py", _RUNNER)
_INIT = "__init__.py"


def digests(module: Path) -> dict[str, str]:
    """A digest of each file of ours that `module` builds on, directly or not, by its path.

    Comments, docstrings and layout do not count. Imports are read, not run: files that an import
    names within a function count too, and arrays kept beside a module. Of a package counts what is
    used of it.
    """
    found: dict[str, str] = {}
    waiting = [module.resolve()]
    while waiting:
        path = waiting.pop()
        name = _name(path)
        if name in found or (name.startswith(_LEFT_OUT) and name not in _COUNTS):
            continue
        found[name], imports = _read(path, path.stat().st_mtime_ns)
        waiting += imports
        for arrays in path.parent.glob("*.npz"):
            found[_name(arrays)] = _short(arrays.read_bytes())
    return dict(sorted(found.items()))


def changed(before: dict[str, str], module: Path) -> list[str]:
    """The files that are not as they were, came or went."""
    now = digests(module)
    return sorted(name for name in before.keys() | now.keys() if before.get(name) != now.get(name))


def _name(path: Path) -> str:
    return path.relative_to(ROOT).as_posix() if path.is_relative_to(ROOT) else path.as_posix()


@functools.cache
def _read(path: Path, _: int) -> tuple[str, list[Path]]:
    """The digest of a module and the files of ours that it imports; its time keys the cache."""
    tree = ast.parse(path.read_bytes())
    imports = list(_imports(path, tree))
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            node.body = [one for one in node.body if not _is_text(one)] or [ast.Pass()]
    return _short(ast.unparse(tree).encode()), imports


def _is_text(node: ast.stmt) -> bool:
    """A docstring, or the help below a config's field."""
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )


def _imports(path: Path, tree: ast.Module) -> Iterator[Path]:
    """The files that define what the module imports, through packages that only pass it on."""
    packages: dict[str, Path] = {}  # by their names in the module
    for node in ast.walk(tree):
        if not isinstance(node, ast.ImportFrom):
            continue
        start = path.parents[node.level - 1] if node.level else ROOT
        words = node.module.split(".") if node.module else []
        for one in node.names:
            inner = _file(start, [*words, one.name])
            if inner is None:
                base = _file(start, words)
                yield from _defining(base, one.name) if base else ()
            elif inner.name == _INIT:
                packages[one.asname or one.name] = inner
            else:
                yield inner
    yield from _used(tree, packages)


def _used(tree: ast.Module, packages: dict[str, Path]) -> Iterator[Path]:
    """The files behind ``package.name``; all of a package that is used in another way."""
    within = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            within.add(id(node.value))
            if node.value.id in packages:
                yield from _defining(packages[node.value.id], node.attr)
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and node.id in packages and id(node) not in within:
            yield from _all(packages[node.id])


def _defining(module: Path, name: str) -> Iterator[Path]:
    """The file that defines the name that is found in the module."""
    if module.name != _INIT:
        yield module
    elif name in (passed := _passed_on(module)):
        yield from _defining(*passed[name])
    else:
        yield from _all(module)


def _all(package: Path) -> Iterator[Path]:
    yield package
    for module, name in _passed_on(package).values():
        yield from _defining(module, name)


@functools.cache
def _passed_on(package: Path) -> dict[str, tuple[Path, str]]:
    """Names that a package has from its modules: the module, and the name there."""
    names = {}
    for node in ast.walk(ast.parse(package.read_bytes())):
        if isinstance(node, ast.ImportFrom) and node.level == 1:
            words = node.module.split(".") if node.module else []
            for one in node.names:
                module = _file(package.parent, words) if words else None
                if module:
                    names[one.asname or one.name] = module, one.name
    return names


def _file(start: Path, words: list[str]) -> Path | None:
    """The file of the module of this dotted name, where it is ours."""
    if start == ROOT and (not words or words[0] not in _OURS):
        return None
    folder = start.joinpath(*words)
    found = [folder / _INIT, *([folder.with_name(f"{folder.name}.py")] if words else [])]
    return next((path.resolve() for path in found if path.exists()), None)


def _short(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:12]
