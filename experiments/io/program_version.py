"""Version of the program, also of a checkout that nobody has installed."""

from __future__ import annotations

import functools
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import dem_warp

ROOT = Path(__file__).resolve().parents[2]
"""Root of a checkout; of an installation the folder that its packages lie in."""


@functools.cache
def program_version() -> str:
    """Version that a checkout states of itself, or that of the installed package.

    A copy of the tree on another machine has no metadata of a package, and beside a checkout another version
    may be installed.
    """
    try:
        project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    except (OSError, ValueError, KeyError):
        return dem_warp.__version__
    return str(project["version"]) if project.get("name") == "dem-warp" else dem_warp.__version__


def with_version(made_by: Mapping[str, Any]) -> dict[str, Any]:
    """Complete an origin that this program has told of itself (`dem_warp.provenance.provenance`)."""
    return {**made_by, "dem-warp": program_version()}
