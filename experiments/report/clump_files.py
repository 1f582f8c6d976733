"""Files of the grain that a document names, copied next to it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from experiments.io.files import copy_file, existing
from experiments.studyfile.card import files_of


def gather_clumps(sections: Mapping[str, Any], source: Path, folder: Path, prefix: str = "") -> None:
    """Copy the files of the grain that sections name relative to `source`, and name the copies there.

    A copy has the name of its file; where files of several folders share one, all but the first are numbered.
    """
    taken: dict[str, bytes] = {}
    for table, key in files_of(sections):
        file = existing(source / table[key])
        name, number, content = f"{prefix}{file.name}", 1, file.read_bytes()
        while taken.setdefault(name.casefold(), content) != content:
            number += 1
            name = f"{prefix}{file.stem}-{number}{file.suffix}"
        copy_file(file, folder / name)
        table[key] = name
