"""Measured outcomes of cases, kept in one file: a row a case, keyed by all that determines it."""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path

import numpy as np

from experiments.errors import StoreError

_SCHEMA = "CREATE TABLE IF NOT EXISTS outcome (key TEXT PRIMARY KEY, numbers BLOB, reason TEXT NOT NULL)"
_AT_ONCE = 500
"""Keys that one query asks for; SQLite takes some thousand."""

_PATIENCE = 60.0
"""Time that a process waits for others that write to the file [s]."""

Outcome = tuple[np.ndarray, str]
"""Observables of a case, and why it has none; empty where it has."""


class OutcomeTable:
    """A table of outcomes in a file.

    Rows are written in transactions: a run that is killed loses none that it has saved, and leaves none half.
    The file is made when the first row is saved.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)

    def __len__(self) -> int:
        """Number of rows."""
        if not self.path.exists():
            return 0
        with closing(self._open()) as file:
            return int(file.execute("SELECT count(*) FROM outcome").fetchone()[0])

    def load(self, keys: Sequence[str]) -> dict[str, Outcome]:
        """Outcomes by key, of those keys that are there.

        Raises
        ------
        StoreError
            When the file is no such table.
        """
        if not self.path.exists():
            return {}
        found: dict[str, Outcome] = {}
        with closing(self._open()) as file:
            for start in range(0, len(keys), _AT_ONCE):
                some = keys[start : start + _AT_ONCE]
                marks = ", ".join("?" * len(some))
                rows = file.execute(f"SELECT key, numbers, reason FROM outcome WHERE key IN ({marks})", some)
                found |= {key: (np.frombuffer(numbers, "<f8"), reason) for key, numbers, reason in rows}
        return found

    def save(self, outcomes: Mapping[str, Outcome]) -> None:
        """Save outcomes by key, all of them or none; earlier ones of the same keys are replaced.

        Raises
        ------
        StoreError
            When the file is no such table.
        """
        self.path.parent.mkdir(parents=True, exist_ok=True)
        rows = [(key, np.asarray(row, "<f8").tobytes(), reason) for key, (row, reason) in outcomes.items()]
        with closing(self._open()) as file, file:
            file.executemany("INSERT OR REPLACE INTO outcome VALUES (?, ?, ?)", rows)

    def _open(self) -> sqlite3.Connection:
        try:
            file = sqlite3.connect(self.path, _PATIENCE)
            file.execute(_SCHEMA)
        except sqlite3.DatabaseError as error:
            raise StoreError("must be a table of outcomes", str(error), str(self.path)) from error
        return file
