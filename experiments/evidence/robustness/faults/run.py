"""Faults by doing them: kills at random moments, full disks, two campaigns in one folder.

It needs Linux, and the right to mount a file system of its own:
`unshare --map-root-user --mount python -m experiments.evidence.robustness.faults.run out/faults`.
"""

from __future__ import annotations

import importlib
import os
import random
import shutil
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from experiments.evidence.robustness.faults.attempt import Attempt, calibrate, content
from experiments.evidence.robustness.faults.disk import FullDisk, full_disk, mounted
from experiments.evidence.robustness.faults.kills import Kill, killed_campaign
from experiments.evidence.robustness.faults.together import Together, two_campaigns

WORDS = (
    "No finished case may be lost or written again, every end must be one that a person can read, and the "
    "final folder (cases, tables, card, results) must be to the bit that of a run without faults."
)
"""Rule that the record states."""


CASES = 250
"""Room that the cases of the campaign take [kB]."""


def load_libraries() -> None:
    """Import what a campaign does, so that its forks need not; the simulator itself is not begun."""
    for name in ("distributed", "experiments.api", "experiments.cli", "experiments.report.writer"):
        importlib.import_module(name)


def undisturbed(work: Path) -> tuple[dict[str, str], float, int]:
    """Content of a campaign without faults, its duration [s], and its size [kB].

    Raises
    ------
    RuntimeError
        When it does not end well, or two of them differ.
    """
    found = []
    for number in range(2):
        folder = work / f"whole-{number}"
        ending = Attempt(calibrate(folder, 1), folder.with_suffix(".txt")).ending()
        if ending.code != 0:
            raise RuntimeError(f"a campaign without faults ends with {ending.code}: {ending.said}")
        found.append((content(folder), ending.seconds))
        size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) // 1000
        shutil.rmtree(folder)
    if found[0][0] != found[1][0]:
        raise RuntimeError("two campaigns without faults differ")
    return found[0][0], found[1][1], size


def rows_of(
    work: Path, kills: int, disks: int, pairs: int, until: float, seed: int, note: Callable[[str, Any], None]
) -> None:
    """Do the faults, and note each."""
    expected, seconds, size = undisturbed(work)
    rng, done = random.Random(seed), 0
    for number in range(pairs):
        if time.monotonic() < until:
            note("together", two_campaigns(work / f"together-{number}", expected, seconds, rng))
    mounted(work / "disk")
    for number in range(disks):
        if time.monotonic() < until:
            # every other one is cut short in its cases; the report takes most of the room
            room = size if number % 2 else CASES
            small = 4 + int(room * (number + rng.random()) / disks)
            note("disks", full_disk(work / "disk", small, expected))
    while done < kills and time.monotonic() < until:
        for kill in killed_campaign(work / f"killed-{done}", expected, seconds, rng):
            note("kills", kill)
            done += 1


def summary(rows: dict[str, list[Any]]) -> list[dict[str, Any]]:
    """One row a kind of fault."""
    kills: list[Kill] = rows["kills"]
    disks: list[FullDisk] = [disk for disk in rows["disks"] if disk.code]
    pairs: list[Together] = rows["together"]
    kinds: dict[str, list[Any]] = {
        f"{kind} killed": [k for k in kills if k.kind == kind] for kind in ("parent", "worker")
    }
    kinds |= {"disk full": disks, "two campaigns in one folder": pairs}
    return [
        {"fault": name, "done": len(done), "rules broken": sum(bool(each.fault) for each in done)}
        for name, done in kinds.items()
    ]


def main(
    out: Annotated[Path, typer.Argument(help="Folder of the results.")],
    kills: Annotated[int, typer.Option(min=0, help="Kills at random moments.")] = 300,
    disks: Annotated[int, typer.Option(min=0, help="Runs on disks of random sizes.")] = 60,
    pairs: Annotated[int, typer.Option(min=0, help="Pairs of campaigns in one folder.")] = 20,
    minutes: Annotated[float, typer.Option(help="Time after which nothing more is begun.")] = 60.0,
    seed: Annotated[int, typer.Option(help="Seed of the moments.")] = 1,
) -> None:
    """Do faults to a small campaign, and write what came of them: faults.md, and a table of each kind."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    load_libraries()
    import pandas as pd

    from experiments.evidence.machine import machine
    from experiments.evidence.performance.results import write_results

    work = out / "work"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    rows: dict[str, list[Any]] = {"together": [], "disks": [], "kills": []}

    def note(kind: str, row: Any) -> None:
        rows[kind].append(row)
        print(kind, len(rows[kind]), row, flush=True)
        pd.DataFrame([asdict(each) for each in rows[kind]]).to_csv(out / f"{kind}.csv", index=False)

    rows_of(work, kills, disks, pairs, time.monotonic() + 60.0 * minutes, seed, note)
    head = f"# Faults\n\n{machine('cpu')}, shared with other work. {WORDS}"
    table = summary(rows)
    write_results(out, "faults", [("faults", head, pd.DataFrame(table))])
    raise typer.Exit(int(any(row["rules broken"] for row in table)))


if __name__ == "__main__":
    typer.run(main)
