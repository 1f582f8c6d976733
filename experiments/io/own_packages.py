"""The four packages of dem-warp by their names, which packages of others have too."""

from __future__ import annotations

from importlib.metadata import packages_distributions
from importlib.util import find_spec
from pathlib import Path

from experiments.io.errors import InputError
from experiments.io.program_version import ROOT

OWN = {
    "dem_warp": "Discrete element simulation of clumped grains",
    "doe": "Designs of experiments and their analysis.",
    "imaging": "Pictures and repose angles: heaps",
    "experiments": "Everything that a person runs, from",
}
"""Packages, and how the text of each begins."""


def foreign_packages() -> list[tuple[str, Path]]:
    """Return the names that Python finds another package under, and its file; nothing is imported."""
    specs = {name: find_spec(name) for name in OWN}
    found = {name: Path((spec and spec.origin) or name) for name, spec in specs.items()}
    return [(name, path) for name, path in found.items() if not _is_own(name, path)]


def require_own_packages() -> None:
    """Raise InputError where a package of others has taken the place of one of dem-warp's."""
    for name, path in foreign_packages():
        again = "pip install --force-reinstall --no-deps . in the clone of dem-warp"
        if not path.is_file():
            raise InputError(f"package {name}", f"files are missing in {ROOT / name}", hint=f"Run {again}")
        others = [each for each in packages_distributions().get(name, []) if each != "dem-warp"]
        problem = f"{path} is not dem-warp's" + (f" but of the package {others[0]}" if others else "")
        place = path.parent if path.name == "__init__.py" else path
        remove = f"Uninstall {others[0]}" if others else f"Move or rename {place}"
        raise InputError(f"package {name}", problem, hint=f"{remove}; if it has overwritten files: {again}")


def _is_own(name: str, path: Path) -> bool:
    """Return whether a file is in its place next to the others, and begins with its own text."""
    if path.resolve() != ROOT / name / "__init__.py" or not path.is_file():
        return False
    return path.read_text(encoding="utf-8", errors="replace").startswith(f'"""{OWN[name]}')
