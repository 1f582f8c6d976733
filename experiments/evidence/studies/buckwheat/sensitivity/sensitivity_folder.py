"""Folder of simulated variants: how all of them were simulated."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from experiments.io.errors import StoreError
from experiments.io.files import write_text

SETTINGS = "settings.json"
"""File that says how all variants of a folder were simulated."""


def open_settings(folder: Path, settings: dict[str, Any]) -> None:
    """Note in a folder how its variants are simulated."""
    path = folder / SETTINGS
    if path.is_file() and (found := json.loads(path.read_text(encoding="utf-8"))) != settings:
        raise StoreError(
            str(path), f"all variants of a folder must have the same settings: {found}", settings
        )
    write_text(path, json.dumps(settings, indent=1) + "\n")
