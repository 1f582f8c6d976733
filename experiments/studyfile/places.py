"""Places in a TOML file: file, line and key of a value, for error messages."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

KeyPath = tuple[str | int, ...]

_HEADER = re.compile(r"\s*(\[\[?)([^\]]+)\]\]?")
_ASSIGNMENT = re.compile(r"""\s*((?:"[^"]*"|'[^']*'|[\w-]+)(?:\s*\.\s*(?:"[^"]*"|'[^']*'|[\w-]+))*)\s*=""")
_KEY_PART = re.compile(r""""([^"]*)"|'([^']*)'|([\w-]+)""")


@dataclass(frozen=True)
class Places:
    """Finds the line of a key of a study, also of one that the chosen scale or condition overrides."""

    file: Path
    """The study file."""
    lines: Mapping[KeyPath, int]
    """Line of each table and key, counted from 1."""
    scale: str | None = None
    """Scale whose table overrides the rest."""
    condition: str | None = None
    """Condition whose table overrides both."""

    @classmethod
    def read(cls, path: Path, text: str, scale: str | None = None) -> Places:
        """Index the keys of a TOML text."""
        return cls(path, _index_lines(text), scale)

    @property
    def folder(self) -> Path:
        """Folder that file names in the study are relative to."""
        return self.file.parent

    def of(self, path: KeyPath) -> str:
        """Name the place of a key: its own line, or that of the nearest table around it."""
        scale: KeyPath = ("scale", self.scale or "")
        condition: KeyPath = ("condition", self.condition or "")
        for over in ((*scale, *condition), condition, scale):
            if (*over, *path) in self.lines:
                return self._name(self.lines[(*over, *path)], (*over, *path))
        for length in range(len(path), 0, -1):
            if path[:length] in self.lines:
                return self._name(self.lines[path[:length]], path)
        return self._name(None, path)

    def numbered(self, key: str, names: Sequence[str]) -> Places:
        """Find what the scale says of the tables of an array by their names by their numbers, too."""
        start = ("scale", self.scale or "", key)
        own = [(path[3:], line) for path, line in self.lines.items() if path[:3] == start and path[3:]]
        ends = [
            ((names.index(str(name)), *rest), line) for (name, *inner), line in own for rest in ((), inner)
        ]
        return replace(self, lines={**self.lines, **{(*start, *end): line for end, line in ends}})

    def _name(self, line: int | None, path: KeyPath) -> str:
        where = str(self.file) if line is None else f"{self.file}:{line}"
        return f"{where}: {dotted(path)}" if path else where


def dotted(path: Sequence[str | int]) -> str:
    """Write a key path as a person would: ``factor[2].low`` for the second table of an array.

    Examples
    --------
    >>> dotted(("factor", 1, "low"))
    'factor[2].low'
    """
    parts = [f"[{part + 1}]" if isinstance(part, int) else f".{part}" for part in path]
    return "".join(parts).removeprefix(".")


def value_at(document: object, path: Sequence[str | int]) -> object:
    """Look up the value at a key path; None when there is none."""
    for part in path:
        try:
            document = document[part]  # type: ignore[index]
        except (KeyError, IndexError, TypeError):
            return None
    return document


def nested(path: Sequence[str], value: object) -> dict[str, Any]:
    """Put a value at a key path of a new document."""
    first, *rest = path
    return {first: nested(rest, value) if rest else value}


def drop(table: dict[str, Any], path: Sequence[str]) -> None:
    """Take the value at a key path out of a document, where there is one."""
    *outer, last = path
    for key in outer:
        table = table.get(key, {})
    table.pop(last, None)


def _index_lines(text: str) -> dict[KeyPath, int]:
    lines: dict[KeyPath, int] = {}
    table: KeyPath = ()
    array_sizes: dict[KeyPath, int] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        if header := _HEADER.match(line):
            table = _split_key(header[2])
            if header[1] == "[[":
                array_sizes[table] = array_sizes.get(table, 0) + 1
                table = (*table, array_sizes[table] - 1)
            lines.setdefault(table, number)
        elif assignment := _ASSIGNMENT.match(line):
            lines.setdefault((*table, *_split_key(assignment[1])), number)
    return lines


def _split_key(text: str) -> KeyPath:
    return tuple(double or single or bare for double, single, bare in _KEY_PART.findall(text))
