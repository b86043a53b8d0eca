"""What code an experiment's numbers come from: so that results know when they are stale."""

import ast
import functools
import hashlib
from collections.abc import Iterator
from pathlib import Path

import experiments

ROOT = Path(experiments.__file__).parent.parent
_OURS = ("jaxsh", "experiments")
# The command line, and what only writes results down or shows them, changes no number.
_LEFT_OUT = ("experiments/__init__.py", "experiments/runner/", "jaxsh/__init__.py")


def digests(module: Path) -> dict[str, str]:
    """A digest of each file of ours that `module` imports, directly or not, by its path.

    Comments, docstrings and layout do not count. Imports are read, not run: files that an import
    names within a function count too, and arrays kept beside a module.
    """
    found: dict[str, str] = {}
    waiting = [module.resolve()]
    while waiting:
        path = waiting.pop()
        name = _name(path)
        if name in found or name.startswith(_LEFT_OUT):
            continue
        digest, imports = _read(path, path.stat().st_mtime_ns)
        found[name] = digest
        waiting += imports
        for arrays in path.parent.glob("*.npz") if path.name == "__init__.py" else ():
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
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for one in node.names:
                yield from _files(ROOT, one.name.split("."))
        elif isinstance(node, ast.ImportFrom):
            start = path.parents[node.level - 1] if node.level else ROOT
            words = node.module.split(".") if node.module else []
            for one in node.names:
                yield from _files(start, [*words, one.name])


def _files(start: Path, words: list[str]) -> Iterator[Path]:
    """The modules along a dotted name; a last word that is no module is a name within one."""
    if start == ROOT and words[0] not in _OURS:
        return
    folder = start
    for word in words:
        module = folder / f"{word}.py"
        folder = folder / word
        if module.exists():
            yield module.resolve()
            return
        if not (folder / "__init__.py").exists():
            return
        yield (folder / "__init__.py").resolve()


def _short(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:12]
