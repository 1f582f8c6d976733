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


def engine_fingerprint(*parts: Any) -> str:
    """Hash of what the engine's code means, and of the version of Warp that compiles it.

    Parameters
    ----------
    parts : types or functions
        Laws, scenes and whatever else takes part. The packages of those from outside are hashed too.

    Notes
    -----
    Comments, docstrings and the form of the text do not count, so that a corrected comment leaves stored
    cases valid; names of files do.
    """
    outside = {part.__module__ for part in parts if _top(part.__module__) != PACKAGE}
    return _fingerprint(tuple(sorted(outside)))


@functools.cache
def _fingerprint(modules: tuple[str, ...]) -> str:
    digest = hashlib.sha256(importlib.metadata.version("warp-lang").encode())
    for module in (PACKAGE, *modules):
        for name, path in _files(module):
            digest.update(f"\n{name}\n{source_meaning(path.read_text(encoding='utf-8'))}".encode())
    return digest.hexdigest()


def _files(module: str) -> Iterator[tuple[str, Path]]:
    """Source files of the package that a module belongs to, with their names; a module alone has its own."""
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
    """Syntax tree of a source as text, without docstrings, comments and line numbers.

    It is the same in every version of Python that knows the source's grammar: what is empty is left out, as
    `ast.dump` does in some of them only.
    """
    return _meaning(ast.parse(text))


def _meaning(part: Any) -> str:
    if isinstance(part, ast.AST):
        inner = ((name, value) for name, value in ast.iter_fields(part) if value is not None and value != [])
        return f"{type(part).__name__}({','.join(f'{name}={_meaning(value)}' for name, value in inner)})"
    if isinstance(part, list):
        return f"[{','.join(_meaning(item) for item in part if not _is_docstring(item))}]"
    return repr(part)


def _is_docstring(part: Any) -> bool:
    """Tell a string that stands as a statement: the docstring of a module, a class, a function or a field."""
    string = isinstance(part, ast.Expr) and isinstance(part.value, ast.Constant)
    return string and isinstance(part.value.value, str)


def provenance(device: Any, precision: str) -> dict[str, Any]:
    """Versions, device and precision that make a result, by name."""
    import warp as wp

    return {
        "dem-warp": __version__,
        "commit": source_commit(),
        "warp": wp.__version__,
        "numpy": np.__version__,
        "device": device.name if device.is_cuda else "CPU",
        "precision": precision,
    }
