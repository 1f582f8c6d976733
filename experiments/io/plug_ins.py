"""Installed packages that add laws, scenes and the like by entry points."""

from __future__ import annotations

import inspect
import re
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from importlib.metadata import entry_points, packages_distributions
from importlib.util import find_spec
from pathlib import Path

from experiments.io.errors import InputError, shortened

GROUPS = tuple(
    f"dem_warp.{kind}" for kind in ("laws", "scenes", "mechanisms", "designs", "engines", "exporters")
)
"""Groups of entry points that dem-warp reads."""


@dataclass(frozen=True)
class PlugIn:
    """A package and its entries."""

    package: str
    version: str
    entries: tuple[str, ...]
    """Entries as ``laws: magnetism``, sorted."""

    def __str__(self) -> str:
        return f"{self.package} {self.version} ({'; '.join(self.entries)})"


@cache
def plug_ins() -> tuple[PlugIn, ...]:
    """Return the installed plug-ins, sorted by package; nothing of them is imported."""
    found: dict[tuple[str, str], set[str]] = {}
    for group in GROUPS:
        for entry in entry_points(group=group):
            made_by = (entry.dist.name, entry.dist.version) if entry.dist else ("unknown", "")
            found.setdefault(made_by, set()).add(f"{group.removeprefix('dem_warp.')}: {entry.name}")
    return tuple(PlugIn(*made_by, tuple(sorted(entries))) for made_by, entries in sorted(found.items()))


def plug_in_versions() -> dict[str, str]:
    """Return the version of each plug-in by its package."""
    return {each.package: each.version for each in plug_ins()}


def made_in(thing: object) -> str:
    """Name the module of a class or function; of another package's also that, its file and line."""
    return outside(thing) or _module(thing)


def outside(thing: object) -> str:
    """Name the module, package, file and line of a class or function of another package; empty otherwise."""
    if thing is None:
        return ""
    module = _module(thing)
    packages = _packages().get(module.partition(".")[0], [])
    if not packages or "dem-warp" in packages:
        return ""
    try:
        line = inspect.getsourcelines(thing)[1]  # type: ignore[arg-type]
        return f"{module} (package {packages[0]}, {inspect.getsourcefile(thing)}, line {line})"  # type: ignore[arg-type]
    except (OSError, TypeError):
        return f"{module} (package {packages[0]})"


_packages = cache(packages_distributions)


def _module(thing: object) -> str:
    return getattr(thing, "__module__", None) or type(thing).__module__


@contextmanager
def calling(thing: object, place: str) -> Iterator[None]:
    """Turn an error in a call of a plug-in into an InputError about a place, with the plug-in's own place.

    ValueError goes through: a plug-in refuses input by it, and so do calls of what ships.
    """
    try:
        yield
    except ValueError:
        raise
    except Exception as error:
        if not (made := outside(thing)):
            raise
        raise InputError(place, f"{made} raised {described(error)}") from error


def skipped_for(entry: str) -> str:
    """Return why an entry of a `PlugIn` cannot be loaded, or that it can."""
    kind, _, name = entry.partition(": ")
    try:
        for found in entry_points(group=f"dem_warp.{kind}", name=name):
            found.load()
    except Exception as error:
        return described(error)
    return "it breaks a rule of its kind"


def described(error: BaseException) -> str:
    """Describe an error in one line, with the package, the file and the line of a plug-in that raised it."""
    text, place = f"{type(error).__name__}: {error}", fault_of(error)
    if not place:
        return text
    last = str(error).strip().rpartition("\n")[2].lstrip(";")  # Warp's begin with the lines above it
    return f"{type(error).__name__}: {shortened(last, 300)}, in {place}"


def fault_of(error: BaseException) -> str:
    """Return the place in a plug-in that an error comes from; empty where none is part of its traceback."""
    text, folders = "".join(traceback.format_exception(error)), _folders()
    for file, line, function, kernel_file in reversed(_PLACE.findall(text)):
        for folder, package in folders.items():
            if Path(file or kernel_file).is_relative_to(folder):
                where = f"{file}, line {line}" if file else f"{kernel_file}, function {function}"
                return f"{where} (package {package})"
    return ""


_PLACE = re.compile(r'File "([^"\n]+)", line (\d+)|parsing function "(\w+)" at (.+):\d+:')
"""Places in tracebacks, of other processes too, and in Warp's errors: its lines begin at the function."""


@cache
def _folders() -> dict[str, str]:
    """Return the package of each folder, or file, that a plug-in's entries are in; nothing is imported."""
    found: dict[str, str] = {}
    for group in GROUPS:
        for entry in entry_points(group=group):
            spec = find_spec(entry.module.partition(".")[0])
            paths = (spec.submodule_search_locations or [str(spec.origin)]) if spec else []
            found |= {str(path): entry.dist.name if entry.dist else "unknown" for path in paths}
    return found
