"""Measured outcomes of cases, kept in one file: a row a case, keyed by all that determines it."""

from __future__ import annotations

import hashlib
import logging
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from experiments.io.errors import StoreError

_SCHEMA = (
    "CREATE TABLE IF NOT EXISTS outcome "
    "(key TEXT PRIMARY KEY, numbers BLOB NOT NULL, reason TEXT NOT NULL, digest BLOB NOT NULL)"
)
_COLUMNS = ["key", "numbers", "reason", "digest"]
_AT_ONCE = 500
"""Keys that one query asks for; SQLite takes some thousand."""

_PATIENCE = 60.0
"""Time that a process waits for others that write to the file [s]."""

Outcome = tuple[np.ndarray, str]
"""Observables of a case, and why it has none; empty where it has."""

_log = logging.getLogger(__name__)


class OutcomeTable:
    """A table of outcomes in a file.

    Rows are written in transactions: a run that is killed loses none that it has saved, and leaves none half.
    Each has a digest of all of it: one that was changed since counts as absent. The file is made when the
    first row is saved.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)

    def __len__(self) -> int:
        """Number of rows."""
        if not self.path.exists():
            return 0
        with self._opened() as file:
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
        damaged = 0
        with self._opened() as file:
            for start in range(0, len(keys), _AT_ONCE):
                some = keys[start : start + _AT_ONCE]
                marks = ", ".join("?" * len(some))
                for row in file.execute(f"SELECT * FROM outcome WHERE key IN ({marks})", some):
                    outcome = _whole(row)
                    damaged += outcome is None
                    found |= {row[0]: outcome} if outcome else {}
        if damaged:
            _log.warning("%s: %d damaged rows, their cases are simulated again", self.path, damaged)
        return found

    def save(self, outcomes: Mapping[str, Outcome]) -> None:
        """Save outcomes by key, all of them or none; earlier ones of the same keys are replaced.

        Raises
        ------
        StoreError
            When the file is no such table, or cannot be written.
        """
        self.path.parent.mkdir(parents=True, exist_ok=True)
        rows = [(key, np.asarray(row, "<f8").tobytes(), reason) for key, (row, reason) in outcomes.items()]
        with self._opened() as file, file:
            whole = [(*row, _digest(*row)) for row in rows]
            file.executemany("INSERT OR REPLACE INTO outcome VALUES (?, ?, ?, ?)", whole)

    @contextmanager
    def _opened(self) -> Iterator[sqlite3.Connection]:
        """Open the file; whatever SQLite finds wrong with it is a `StoreError`."""
        try:
            if self.path.exists() and not self.path.is_file():
                raise sqlite3.DatabaseError("it is no regular file")
            with closing(sqlite3.connect(self.path, _PATIENCE)) as file:
                # a text that is no UTF-8 is a damaged row, not an error
                file.text_factory = lambda text: text.decode(errors="replace")
                file.execute(_SCHEMA)
                columns = [name for _, name, *_ in file.execute("PRAGMA table_info(outcome)")]
                if columns != _COLUMNS:
                    raise sqlite3.DatabaseError(f"its columns are {', '.join(columns)}")
                yield file
        except sqlite3.OperationalError as error:
            rule = (
                "the table of outcomes must be one that can be read and written: see to room and permissions"
            )
            raise StoreError(str(self.path), rule, str(error)) from error
        except (sqlite3.Error, UnicodeDecodeError) as error:  # of a damaged name in a message
            rule = "must be a table of outcomes that this version wrote: move it away, and they are made anew"
            raise StoreError(str(self.path), rule, str(error)) from error


def _whole(row: Sequence[Any]) -> Outcome | None:
    """Outcome of a row; None where the row is not as it was saved."""
    key, numbers, reason, digest = row
    if tuple(map(type, row)) != (str, bytes, str, bytes) or digest != _digest(key, numbers, reason):
        return None
    return np.frombuffer(numbers, "<f8"), reason


def _digest(key: str, numbers: bytes, reason: str) -> bytes:
    parts = (key.encode(), numbers, reason.encode())
    # the lengths tell where one part ends
    return hashlib.sha256(b"".join(len(part).to_bytes(8) + part for part in parts)).digest()
