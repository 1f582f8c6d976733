"""Origin of results: the engine's own code, libraries, device and precision."""

import ast
import functools
import hashlib
import importlib.metadata
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from dem_warp.version import __version__, source_commit

PACKAGE = "dem_warp"

CHANGE_NO_HEAP = ("dem_warp/provenance.py", "dem_warp/registry.py", "dem_warp/version.py")
"""Imported files that the fingerprint leaves out."""

_parsed = functools.cache(ast.parse)


def engine_fingerprint(*parts: Any) -> str:
    """Return the hash of all code that can change a heap, and of the version of Warp.

    It covers batches, laws, scenes and everything that these import, by file name and syntax tree: comments,
    docstrings and formatting do not count. Of `parts` (laws and scenes in use) outside dem_warp, the whole
    packages are hashed too.
    """
    outside = {part.__module__ for part in parts if _top(part.__module__) != PACKAGE}
    return _fingerprint(tuple(sorted(outside)))


@functools.cache
def _fingerprint(modules: tuple[str, ...]) -> str:
    digest = _own_digest().copy()
    for name, path in (file for module in modules for file in _package_files(module)):
        digest.update(_entry(name, path))
    return digest.hexdigest()


@functools.cache
def _own_digest() -> Any:
    """Digest of Warp's version and the engine's own files."""
    digest = hashlib.sha256(importlib.metadata.version("warp-lang").encode())
    for name, path in sorted(engine_files().items()):
        digest.update(_entry(name, path))
    return digest


def _entry(name: str, path: Path) -> bytes:
    return f"\n{name}\n{source_meaning(path.read_text(encoding='utf-8'))}".encode()


def engine_files() -> dict[str, Path]:
    """Return the source files of dem_warp that can change a heap, by name: an import closure."""
    root = Path(__file__).parent
    files: dict[str, Path] = {}
    waiting = [root / "batch.py", *(root / "laws").glob("*.py"), *(root / "scenes").glob("*.py")]
    while waiting:
        path = waiting.pop()
        name = path.relative_to(root.parent).as_posix()
        if name not in files and name not in CHANGE_NO_HEAP:
            files[name] = path
            waiting += _imported_files(path)
    return files


def _imported_files(path: Path) -> Iterator[Path]:
    """Yield the files of dem_warp that a file imports."""
    for part in _statements(_parsed(path.read_text(encoding="utf-8"))):
        if isinstance(part, ast.ImportFrom) and part.module and _top(part.module) == PACKAGE:
            for module in (part.module, *(f"{part.module}.{alias.name}" for alias in part.names)):
                file = Path(__file__).parents[1].joinpath(*module.split(".")).with_suffix(".py")
                if file.is_file():
                    yield file


def _statements(block: Any) -> Iterator[Any]:
    """Yield the statements of a tree, without their expressions, which are ten times as many."""
    for name in ("body", "orelse", "handlers", "finalbody", "cases"):
        inner = getattr(block, name, ())
        for part in inner if isinstance(inner, list) else ():
            yield part
            yield from _statements(part)


def _package_files(module: str) -> Iterator[tuple[str, Path]]:
    """Yield the source files of a module's package with their names; a module without package has its own."""
    package = sys.modules.get(_top(module))
    folders = [Path(folder) for folder in getattr(package, "__path__", ())]
    for folder in folders:
        for path in sorted(folder.rglob("*.py")):
            yield path.relative_to(folder.parent).as_posix(), path
    file = getattr(sys.modules[module], "__file__", None)
    if not folders and file is not None:
        yield module, Path(file)


def _top(module: str) -> str:
    return module.partition(".")[0]


def source_meaning(text: str) -> str:
    """Return the syntax tree of a source as text, without docstrings, comments and line numbers.

    Unlike `ast.dump` it is the same in every version of Python: empty fields are left out.
    """
    return _meaning(_parsed(text))


def _meaning(part: Any) -> str:
    if isinstance(part, ast.AST):
        inner = [(name, getattr(part, name, None)) for name in part._fields]
        fields = [f"{name}={_meaning(value)}" for name, value in inner if value is not None and value != []]
        return f"{type(part).__name__}({','.join(fields)})"
    if isinstance(part, list):
        return f"[{','.join(_meaning(item) for item in part if not _is_docstring(item))}]"
    return repr(part)


def _is_docstring(part: Any) -> bool:
    """Return True for a string that is a statement, as a docstring of a module, class, function or field."""
    string = isinstance(part, ast.Expr) and isinstance(part.value, ast.Constant)
    return string and isinstance(part.value.value, str)


def provenance(device: Any, precision: str) -> dict[str, Any]:
    """Return the versions, device and precision of a result."""
    import warp as wp

    return {
        "dem-warp": __version__,
        "commit": source_commit(),
        "warp": wp.__version__,
        "numpy": np.__version__,
        "device": device.name if device.is_cuda else "CPU",
        "precision": precision,
    }
