"""The table of outcomes: what was changed in its file is never read as a value."""

import random
import sqlite3
from pathlib import Path

import numpy as np
import pytest

from experiments.cases.store.outcome_table import OutcomeTable
from experiments.io.errors import StoreError

OUTCOMES = {
    f"{number:064x}": (np.array([number, np.nan, 0.1 * number]), "" if number % 3 else "no heap")
    for number in range(40)
}
FLIPS = 400


@pytest.fixture
def table(tmp_path: Path) -> OutcomeTable:
    table = OutcomeTable(tmp_path / "outcomes.sqlite")
    table.save(OUTCOMES)
    return table


def test_what_was_saved_last_is_loaded(table: OutcomeTable) -> None:
    # More than one query asks for.
    rows = {f"{i}": (np.array([i, np.nan]), "clogged" if i % 2 else "") for i in range(1200)}
    table.save(rows | {"3": (np.zeros(2), "clogged")})
    table.save({"3": rows["3"]})
    found = OutcomeTable(table.path).load([*OUTCOMES, "absent", *rows])
    assert found.keys() == {*OUTCOMES, *rows}
    for key, (values, reason) in (OUTCOMES | rows).items():
        np.testing.assert_array_equal(found[key][0], values)
        assert found[key][1] == reason


def test_no_flipped_bit_is_read_as_another_value(table: OutcomeTable) -> None:
    whole, rng = table.path.read_bytes(), random.Random(7)
    lost = 0
    for _ in range(FLIPS):
        damaged = bytearray(whole)
        damaged[rng.randrange(len(whole))] ^= 1 << rng.randrange(8)
        table.path.write_bytes(damaged)
        try:
            found = table.load(list(OUTCOMES))
        except StoreError:
            lost += 1
            continue
        lost += len(found) < len(OUTCOMES)
        for key, (values, reason) in found.items():
            np.testing.assert_array_equal(values, OUTCOMES[key][0])
            assert reason == OUTCOMES[key][1]
    # most of the file is rows
    assert lost > FLIPS / 4


def test_a_damaged_row_is_saved_anew(table: OutcomeTable, caplog: pytest.LogCaptureFixture) -> None:
    key = next(iter(OUTCOMES))
    with sqlite3.connect(table.path) as file:
        file.execute("UPDATE outcome SET reason = 'forged' WHERE key = ?", [key])
    assert key not in table.load(list(OUTCOMES))
    assert "1 damaged rows" in caplog.text
    table.save({key: OUTCOMES[key]})
    assert list(table.load([key])) == [key]


@pytest.mark.parametrize("content", [b"no database", b"SQLite format 3\0" + bytes(100)])
def test_another_file_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "outcomes.sqlite"
    path.write_bytes(content)
    for use in (lambda: OutcomeTable(path).load(["a"]), lambda: OutcomeTable(path).save(OUTCOMES)):
        with pytest.raises(StoreError, match="is not a table of outcomes"):
            use()


def test_a_table_without_digests_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "outcomes.sqlite"
    with sqlite3.connect(path) as file:
        file.execute("CREATE TABLE outcome (key TEXT PRIMARY KEY, numbers BLOB, reason TEXT NOT NULL)")
    with pytest.raises(StoreError, match="its columns are key, numbers, reason"):
        OutcomeTable(path).load(["a"])


def test_a_damaged_name_in_a_message_of_sqlite_is_no_raw_error(table: OutcomeTable) -> None:
    content = table.path.read_bytes()
    table.path.write_bytes(content.replace(b"PRIMARY KEY", b"PRIM\x80RY KEY"))
    with pytest.raises(StoreError):
        table.load(list(OUTCOMES))
