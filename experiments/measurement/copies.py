"""Copies among repeats: one picture, or one profile, that stands for two heaps shows no scatter."""

from __future__ import annotations

import hashlib
from collections.abc import Hashable, Iterable
from dataclasses import dataclass, field
from pathlib import Path

from experiments.io.errors import InputError

REPEATS = "repeats are of separate heaps, never copies of one another"
"""Rule of whatever is measured several times."""


@dataclass
class Repeats:
    """Contents that were given for heaps so far, and their places."""

    _given: dict[Hashable, tuple[Hashable, str]] = field(default_factory=dict)
    """Heap of each content, and name and place of the content."""
    _digests: dict[Path, bytes] = field(default_factory=dict)
    """Contents of the files that were read."""

    def add_file(self, path: Path, heap: Hashable, told: str, place: str) -> None:
        """Take a file, a picture most often, as `add` takes a content."""
        if path not in self._digests:
            with path.open("rb") as file:
                self._digests[path] = hashlib.file_digest(file, "sha256").digest()
        self.add(self._digests[path], heap, told, place)

    def add(self, content: Hashable, heap: Hashable, told: str, place: str) -> None:
        """Take the content that a place gives of a heap.

        Raises
        ------
        InputError
            When another heap has the same; with both places, the value as it is ``told``.
        """
        first, where = self._given.setdefault(content, (heap, f"{told} ({place})"))
        if first != heap:
            raise InputError(place, f"expected {REPEATS}: this is the same as {where}", told)


def require_separate(pictures: Iterable[Path], place: str) -> None:
    """Refuse pictures, each of another heap, two of which are the same to the byte.

    Raises
    ------
    InputError
        With both.
    """
    repeats = Repeats()
    for number, picture in enumerate(each for each in pictures if each.is_file()):
        repeats.add_file(picture, number, str(picture), place)
