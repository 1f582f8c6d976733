"""Copies among repeats: one picture or profile given for two heaps shows no scatter."""

from __future__ import annotations

import hashlib
from collections.abc import Hashable
from dataclasses import dataclass, field
from pathlib import Path

from experiments.io.errors import InputError


@dataclass
class Duplicates:
    """Contents given for heaps so far; a content given for a second heap is refused."""

    _given: dict[Hashable, tuple[Hashable, str]] = field(default_factory=dict)
    """Heap of each content, and name and place of the content."""
    _digests: dict[Path, bytes] = field(default_factory=dict)
    """Digests of the files that were read."""

    def add_file(self, path: Path, heap: Hashable, name: str, place: str) -> None:
        """Add the content of a file; see `add`."""
        if path not in self._digests:
            with path.open("rb") as file:
                self._digests[path] = hashlib.file_digest(file, "sha256").digest()
        self.add(self._digests[path], heap, name, place)

    def add(self, content: Hashable, heap: Hashable, name: str, place: str) -> None:
        """Add the content of a heap."""
        first, where = self._given.setdefault(content, (heap, f"{name} ({place})"))
        if first != heap:
            raise InputError(place, f"{name} is a copy of {where}", hint="Each repeat needs its own heap.")
