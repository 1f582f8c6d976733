"""A short run of mutated files through every reader; `experiments.evidence.robustness.fuzz.run` is the long one."""

from __future__ import annotations

import json
import random
import time
from pathlib import Path

import pandas as pd
import pytest

from experiments.evidence.performance.results import write_results
from experiments.evidence.robustness.fuzz.mutations import mutated
from experiments.evidence.robustness.fuzz.readers import CORPUS, READERS, Reader, accepted_change
from experiments.evidence.robustness.fuzz.run import added, fuzz, rows_of
from experiments.evidence.robustness.fuzz.worker import (
    AT,
    FIELDS,
    READ,
    REFUSED,
    SECONDS,
    content_of,
    read_inputs,
)
from experiments.io.errors import InputError

INPUTS = 60
"""Of each reader: seconds."""


@pytest.mark.parametrize("name", READERS)
def test_every_seed_is_read(name: str, tmp_path: Path) -> None:
    reader = READERS[name](tmp_path)
    for file, content in reader.seeds.items():
        path = tmp_path / (reader.name or file)
        path.write_bytes(content)
        assert accepted_change(reader, reader.read(path)) == ""


@pytest.mark.parametrize("name", READERS)
def test_no_mutated_file_crashes_a_reader(name: str, tmp_path: Path) -> None:
    note, failures = [0.0] * FIELDS, tmp_path / "failures.jsonl"
    read_inputs(name, 2, range(INPUTS), note, failures)
    assert not failures.exists(), failures.read_text(encoding="utf-8")
    assert note[READ] + note[REFUSED] == INPUTS
    assert note[REFUSED] > 0


def test_an_input_is_the_same_from_the_same_numbers() -> None:
    reader = Reader({"a.txt": b"1 2 3\n", "b.txt": b"x = 1\n"}, Path.read_bytes)
    inputs = [content_of(reader, "clump", 1, number) for number in range(200)]
    assert inputs == [content_of(reader, "clump", 1, number) for number in range(200)]
    assert len(set(inputs)) > 150


def test_mutations_take_any_file() -> None:
    rng = random.Random(3)
    content = b"1"
    for _ in range(2000):
        content = mutated(content, [b"", b"2"], rng)[:200]


def test_a_change_that_checksums_should_find_is_named() -> None:
    reader = Reader({}, Path.read_bytes, checked=True, facts={"a": 1, "b": (2.0, "x")})
    assert accepted_change(reader, {"a": 1}) == ""
    assert accepted_change(reader, {"a": 1, "b": (2.0, "y")}) == "b"
    assert accepted_change(reader, {"c": 1}) == "c"


def test_a_reader_that_raises_is_a_failure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(path: Path) -> object:
        raise ZeroDivisionError("raw")

    monkeypatch.setitem(READERS, "broken", lambda folder: Reader({"a.txt": b"1"}, broken))
    note, failures = [0.0] * FIELDS, tmp_path / "failures.jsonl"
    read_inputs("broken", 1, range(2), note, failures)
    rows = [json.loads(line) for line in failures.read_text(encoding="utf-8").splitlines()]
    assert [row["kind"] for row in rows] == ["ZeroDivisionError"] * 2
    assert note[AT] == 2


def test_a_process_that_dies_is_a_failure_of_its_input(tmp_path: Path) -> None:
    failures = tmp_path / "failures.jsonl"
    # there is no such reader, so that the process ends before its first input
    row = fuzz("absent", 1, 5, 2, failures)
    assert row["failures"] == 2
    lines = failures.read_text(encoding="utf-8").splitlines()
    assert [json.loads(line)["number"] for line in lines] == [5, 6]


def test_a_run_goes_on_where_it_was(tmp_path: Path) -> None:
    earlier = {"reader": "clump", "inputs": 10, "read": 4, "refused": 6, "failures": 1, "slowest s": 0.2}
    more = {"reader": "clump", "inputs": 5, "read": 5, "refused": 0, "failures": 2, "slowest s": 0.1}
    sizes = {"memory MB": 1.0, "wall s": 3, "seed": 1, "first": 0}
    row = added(earlier | sizes, more | sizes)
    assert (row["inputs"], row["read"], row["failures"], row["slowest s"], row["wall s"]) == (
        15,
        9,
        2,
        0.2,
        6,
    )
    write_results(tmp_path, "fuzz", [("readers", "", pd.DataFrame([row]))])
    assert rows_of(tmp_path, 1, 0) == {"clump": row}
    with pytest.raises(InputError, match="one seed"):
        rows_of(tmp_path, 2, 0)


@pytest.mark.parametrize("path", sorted((CORPUS / "found").iterdir()), ids=lambda path: path.stem)
def test_what_once_broke_a_reader_is_refused(path: Path, tmp_path: Path) -> None:
    reader = READERS[path.name.partition(".")[0]](tmp_path)
    copy = tmp_path / f"again{path.suffix}"
    copy.write_bytes(path.read_bytes())
    started = time.process_time()
    with pytest.raises(reader.refusals):
        reader.read(copy)
    assert time.process_time() - started < SECONDS
