"""Installed packages that add laws, scenes and the like by entry points."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.metadata import entry_points, packages_distributions

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
    """Name the module of a class or function and its package, e.g. ``jar (package grain-magnets)``."""
    module = getattr(thing, "__module__", None) or type(thing).__module__
    packages = packages_distributions().get(module.partition(".")[0], [])
    return module + (f" (package {packages[0]})" if packages else "")
