"""Version of the program, also in a checkout that is not installed."""

from __future__ import annotations

import functools
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import dem_warp

ROOT = Path(__file__).resolve().parents[2]
"""Root of a checkout; in an installation the folder of the packages."""


@functools.cache
def program_version() -> str:
    """Return the version of the checkout, or that of the installed package.

    A copied tree has no package metadata, and another version may be installed next to a checkout.
    """
    try:
        project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    except (OSError, ValueError, KeyError):
        return dem_warp.__version__
    return str(project["version"]) if project.get("name") == "dem-warp" else dem_warp.__version__


def with_version(made_by: Mapping[str, Any]) -> dict[str, Any]:
    """Add this version to an origin (`dem_warp.provenance.provenance`)."""
    return {**made_by, "dem-warp": program_version()}
