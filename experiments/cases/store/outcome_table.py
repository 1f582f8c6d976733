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
"""Keys of one query; SQLite takes some thousand."""

_PATIENCE = 60.0
"""Time that a process waits for others that write to the file [s]."""

Outcome = tuple[np.ndarray, str]
"""Observables of a case, and the reason if it has none, else an empty text."""

_log = logging.getLogger(__name__)


class OutcomeTable:
    """A table of outcomes in a file, which is made when the first row is saved.

    Rows are written in transactions: a run that is killed loses no saved row and leaves no half row. Each has
    a digest; a row that was changed counts as missing.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)

    @property
    def unfinished(self) -> Path:
        """Folder of the checkpoints of cases that are being simulated."""
        return self.path.with_name("unfinished")

    def __len__(self) -> int:
        """Count the rows."""
        if not self.path.exists():
            return 0
        with self._opened() as file:
            return int(file.execute("SELECT count(*) FROM outcome").fetchone()[0])

    def load(self, keys: Sequence[str]) -> dict[str, Outcome]:
        """Return outcomes by key, for the keys that the table has.

        Raise StoreError when the file is not such a table.
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

        Raise StoreError when the file is not such a table, or cannot be written.
        """
        self.path.parent.mkdir(parents=True, exist_ok=True)
        rows = [(key, np.asarray(row, "<f8").tobytes(), reason) for key, (row, reason) in outcomes.items()]
        with self._opened() as file, file:
            whole = [(*row, _digest(*row)) for row in rows]
            file.executemany("INSERT OR REPLACE INTO outcome VALUES (?, ?, ?, ?)", whole)

    @contextmanager
    def _opened(self) -> Iterator[sqlite3.Connection]:
        """Open the file; turn errors of SQLite into `StoreError`."""
        try:
            if self.path.exists() and not self.path.is_file():
                raise sqlite3.DatabaseError("it is not a regular file")
            with closing(sqlite3.connect(self.path, _PATIENCE)) as file:
                # a text that is not UTF-8 is a damaged row, not an error
                file.text_factory = lambda text: text.decode(errors="replace")
                file.execute(_SCHEMA)
                columns = [name for _, name, *_ in file.execute("PRAGMA table_info(outcome)")]
                if columns != _COLUMNS:
                    raise sqlite3.DatabaseError(f"its columns are {', '.join(columns)}")
                yield file
        except sqlite3.OperationalError as error:
            hint = "Check disk space and permissions."
            raise StoreError(str(self.path), f"cannot be read or written: {error}", hint=hint) from error
        except (sqlite3.Error, UnicodeDecodeError) as error:  # a damaged name in a message
            hint = "Move it away; its cases are simulated again."
            raise StoreError(str(self.path), f"is not a table of outcomes: {error}", hint=hint) from error


def _whole(row: Sequence[Any]) -> Outcome | None:
    """Return the outcome of a row; None if the row has changed since it was saved."""
    key, numbers, reason, digest = row
    if tuple(map(type, row)) != (str, bytes, str, bytes) or digest != _digest(key, numbers, reason):
        return None
    return np.frombuffer(numbers, "<f8"), reason


def _digest(key: str, numbers: bytes, reason: str) -> bytes:
    parts = (key.encode(), numbers, reason.encode())
    # the lengths separate the parts
    return hashlib.sha256(b"".join(len(part).to_bytes(8) + part for part in parts)).digest()
