"""Safe reading of a run's files, which may come from anyone: no links, a limited size."""

from __future__ import annotations

import csv
import json
import math
import stat
from collections.abc import Iterator
from pathlib import Path, PurePosixPath
from typing import Any

from experiments.io.errors import InputError

LARGEST = 50_000_000
"""Bytes of the largest file that is read whole."""

LONGEST = 2_000
"""Lines of a log that are read, its last ones."""


def inside(folder: Path, name: str) -> Path:
    """Return the path of a regular file below a folder."""
    parts = PurePosixPath(name).parts
    if not parts or name.startswith("/") or "\\" in name or "\0" in name or ".." in parts:
        raise InputError(str(folder), "must name a file below the folder", name)
    path = folder
    for part in parts:
        path = path / part
        try:
            facts = path.lstat()
        except (OSError, ValueError):
            raise InputError(str(folder), "must name a file below the folder", name) from None
        if stat.S_ISLNK(facts.st_mode):
            raise InputError(str(folder), "links are not followed", name)
    if not stat.S_ISREG(facts.st_mode):
        raise InputError(str(folder), "must name a regular file", name)
    return path


def matching(folder: Path, pattern: str) -> list[Path]:
    """List what matches a pattern in a folder, the newest first."""
    try:
        return sorted(folder.glob(pattern), key=changed, reverse=True)
    except OSError:
        return []


def changed(path: Path) -> float:
    """Time of the last change [s]; 0 of what has gone."""
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0


def read_json(folder: Path, name: str) -> dict[str, Any]:
    """Read a JSON object; return {} if it is missing or damaged."""
    try:
        found = json.loads(_read(folder, name))
    except (OSError, ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def read_lines(folder: Path, name: str, most: int = LONGEST) -> Iterator[dict[str, Any]]:
    """Read the last JSON objects of a file, one per line; skip damaged lines."""
    try:
        lines = _read(folder, name).splitlines()[-most:]
    except (OSError, ValueError):
        return
    for line in lines:
        try:
            found = json.loads(line)
        except (ValueError, RecursionError):
            continue
        if isinstance(found, dict):
            yield found


def read_table(folder: Path, name: str, most: int = LONGEST) -> list[dict[str, str | int | float]]:
    """Read the last rows of a table without empty cells; return [] if it is missing or damaged."""
    try:
        rows = list(csv.DictReader(_read(folder, name).splitlines(), restval=""))[-most:]
    except (OSError, ValueError, csv.Error):
        return []
    found = ({key: _value(text) for key, text in row.items() if key is not None} for row in rows)
    return [{key: value for key, value in row.items() if value is not None} for row in found]


def _value(text: str) -> str | int | float | None:
    """Return the number in a cell, or its text; None for an empty cell."""
    for kind in (int, float):
        try:
            number: int | float = kind(text)
        except ValueError:
            continue
        return number if math.isfinite(number) else None
    return text or None


def _read(folder: Path, name: str) -> str:
    path = inside(folder, name)
    with path.open("rb") as file:
        return file.read(LARGEST).decode("utf-8", errors="replace")
