"""Fuzzing of every reader: `python -m experiments.benchmarks.fuzz.run out/fuzz --inputs 100000`.

Every input is determined by the seed, the reader and its number, so that a failure can be had again:
`--reader NAME --first NUMBER --inputs 1`.
"""

from __future__ import annotations

import json
import multiprocessing
import time
from pathlib import Path
from typing import Annotated, Any

import pandas as pd
import typer

from experiments.benchmarks.fuzz.readers import READERS
from experiments.benchmarks.fuzz.worker import (
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
from experiments.benchmarks.results import write_results
from experiments.report.kit.machine import machine

PATIENCE = 60.0
"""Wall time without a next input after which a process counts as hanging [s]."""

RULE = (
    f"A file may take {SECONDS:g} s of the processor and {MEGABYTES:g} MB. A failure is any end but a value "
    "or an error of bad input; of a file with checksums, a value that was not written too."
)
"""Rule that the record states."""

CHUNK = 10_000
"""Inputs of one process."""


def fuzz(name: str, seed: int, first: int, inputs: int, failures: Path) -> dict[str, Any]:
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


def main(
    out: Annotated[Path, typer.Argument(help="Folder of the results.")],
    inputs: Annotated[int, typer.Option(min=1, help="Mutated files for each reader.")] = 100_000,
    reader: Annotated[list[str] | None, typer.Option(help="Only this reader; may be given again.")] = None,
    seed: Annotated[int, typer.Option(help="Seed of the mutations.")] = 1,
    first: Annotated[int, typer.Option(min=0, help="Number of the first input.")] = 0,
) -> None:
    """Give mutated files to every reader, and write what happened: fuzz.md, readers.csv, failures.jsonl."""
    failures = out / "failures.jsonl"
    out.mkdir(parents=True, exist_ok=True)
    failures.unlink(missing_ok=True)
    rows = []
    for name in reader or READERS:
        rows.append(fuzz(name, seed, first, inputs, failures))
        print(rows[-1], flush=True)
        head = f"# Mutated files\n\n{machine('cpu')}. {RULE}"
        write_results(out, "fuzz", [("readers", head, pd.DataFrame(rows))])
    raise typer.Exit(int(any(row["failures"] for row in rows)))


if __name__ == "__main__":
    typer.run(main)
