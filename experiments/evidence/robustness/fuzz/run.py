"""Fuzzing of every reader: `python -m experiments.evidence.robustness.fuzz.run out/fuzz --inputs 100000`.

The readers take turns, `--turn` inputs each. A run that was stopped goes on in its folder where it was. Every
input is determined by the seed, the reader and its number, so that a failure can be had again, in another
folder: `--reader NAME --first NUMBER --inputs 1`.
"""

from __future__ import annotations

import json
import multiprocessing
import time
from pathlib import Path
from typing import Annotated, Any

import pandas as pd
import typer

from experiments.evidence.machine import machine
from experiments.evidence.performance.results import write_results
from experiments.evidence.robustness.fuzz.readers import READERS
from experiments.evidence.robustness.fuzz.worker import (
    AT,
    FIELDS,
    MEGABYTES,
    MEMORY,
    READ,
    REFUSED,
    SECONDS,
    SLOWEST,
    work,
)
from experiments.io.errors import InputError

PATIENCE = 600.0
"""Wall time without a next input after which a process counts as hanging [s]: on a machine that others have,
one that may take what they leave needs minutes to start."""

RULE = (
    f"A file may take {SECONDS:g} s of the processor and {MEGABYTES:g} MB. A failure is any end but a value "
    "or an error of bad input; of a file with checksums, a value that was not written too."
)
"""Rule that the record states."""

CHUNK = 10_000
"""Inputs of one process."""

Row = dict[str, Any]
"""Row of the record."""


def fuzz(name: str, seed: int, first: int, inputs: int, failures: Path) -> Row:
    """Give mutated files to a reader; return a row of the record.

    A process that dies or hangs is a failure of the input that it was at; the next one goes on behind it.
    """
    context = multiprocessing.get_context("spawn")
    totals = [0.0] * FIELDS
    started, number, end = time.perf_counter(), first, first + inputs
    while number < end:
        note = context.Array("d", FIELDS)
        note[AT] = number
        numbers = range(number, min(number + CHUNK, end))
        process = context.Process(target=work, args=(name, seed, numbers, note, str(failures)))
        process.start()
        fault = _wait(process, note)
        for place in (READ, REFUSED):
            totals[place] += note[place]
        for place in (SLOWEST, MEMORY):
            totals[place] = max(totals[place], note[place])
        number = int(note[AT])
        if number < numbers.stop:
            row = {"reader": name, "seed": seed, "number": number, "kind": "process", "said": fault}
            with failures.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
            number += 1
    return {
        "reader": name,
        "inputs": inputs,
        "read": int(totals[READ]),
        "refused": int(totals[REFUSED]),
        "failures": len(failures_of(failures, name)),
        "slowest s": totals[SLOWEST],
        "memory MB": totals[MEMORY],
        "wall s": round(time.perf_counter() - started),
    }


def failures_of(path: Path, name: str) -> list[dict[str, Any]]:
    """Failures of a reader that a file lists."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.is_file() else []
    return [row for row in map(json.loads, lines) if row["reader"] == name]


def _wait(process: Any, note: Any) -> str:
    """Wait for a process, and end it where it hangs; say how it ended."""
    at, since = -1.0, time.monotonic()
    while process.is_alive():
        process.join(1.0)
        if note[AT] != at:
            at, since = note[AT], time.monotonic()
        elif time.monotonic() - since > PATIENCE:
            process.kill()
            process.join()
            return f"no end within {PATIENCE:g} s"
    return f"exit code {process.exitcode}"


def added(row: Row | None, more: Row) -> Row:
    """Add the row of further inputs to a reader's."""
    if row is None:
        return more
    sums = {name: row[name] + more[name] for name in ("inputs", "read", "refused", "wall s")}
    most = {name: max(row[name], more[name]) for name in ("slowest s", "memory MB")}
    # the file of the failures holds all of them
    return more | sums | most


def rows_of(out: Path, seed: int, first: int) -> dict[str, Row]:
    """Rows that an earlier run of the same inputs left in a folder, by reader.

    Raises
    ------
    InputError
        When they are of other inputs.
    """
    path = out / "readers.csv"
    if not path.is_file():
        return {}
    rows = pd.read_csv(path).to_dict("records")
    for row in rows:
        if (row["seed"], row["first"]) != (seed, first):
            raise InputError(
                str(out), "expected one folder holds inputs of one seed from one number on", (seed, first)
            )
    return {str(row["reader"]): {str(name): value for name, value in row.items()} for row in rows}


def main(
    out: Annotated[Path, typer.Argument(help="Folder of the results.")],
    inputs: Annotated[int, typer.Option(min=1, help="Mutated files for each reader.")] = 100_000,
    reader: Annotated[list[str] | None, typer.Option(help="Only this reader; may be given again.")] = None,
    seed: Annotated[int, typer.Option(help="Seed of the mutations.")] = 1,
    first: Annotated[int, typer.Option(min=0, help="Number of the first input.")] = 0,
    turn: Annotated[int, typer.Option(min=1, help="Inputs of a reader before the next one's turn.")] = CHUNK,
) -> None:
    """Give mutated files to every reader, and write what happened: fuzz.md, readers.csv, failures.jsonl."""
    failures = out / "failures.jsonl"
    out.mkdir(parents=True, exist_ok=True)
    rows = rows_of(out, seed, first)
    head = f"# Mutated files\n\n{machine('cpu')}. {RULE}"
    while left := [name for name in reader or READERS if name not in rows or rows[name]["inputs"] < inputs]:
        for name in left:
            done = int(rows[name]["inputs"]) if name in rows else 0
            row = fuzz(name, seed, first + done, min(turn, inputs - done), failures)
            rows[name] = added(rows.get(name), row | {"seed": seed, "first": first})
            print(rows[name], flush=True)
            write_results(out, "fuzz", [("readers", head, pd.DataFrame(list(rows.values())))])
    raise typer.Exit(int(any(row["failures"] for row in rows.values())))


if __name__ == "__main__":
    typer.run(main)
