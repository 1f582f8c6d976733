"""Coverage of the 90 % intervals of sizes, over many emulated twins with one effect each.

    python -m experiments.evidence.trials.intervals out/intervals --twins 1000
    python -m experiments.evidence.trials.intervals out/intervals --out experiments/evidence/trials/record/intervals

The worlds are those of `experiments.evidence.trials.emulated`. The library of each analysis has the hidden mechanism
alone: the others take no part in the interval of the one that is named, and cost four fifths of the time.
Twins are kept as they end; called again, it goes on. The second writes the record of those that are there.
"""

from __future__ import annotations

import csv
import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer
from scipy import stats

from doe import Factor
from doe.discrepancy import fit_emulator
from experiments.commands.console import clear_errors
from experiments.discover.search import Search
from experiments.evidence.trials.drawing import Plan, draw
from experiments.evidence.trials.emulated import REPLICATES, Trial, World, run_trial
from experiments.evidence.trials.emulated_simulator import EmulatedSimulator
from experiments.evidence.trials.folder import NOTES, PAGE
from experiments.evidence.trials.generate import STUDY, bank_beside
from experiments.evidence.trials.score import share
from experiments.io.errors import InputError
from experiments.io.files import copy_file
from experiments.report.kit.markdown import markdown_table, write_page
from experiments.studyfile import load_study
from experiments.studyfile.observables import NAMES

TWINS = "twins.csv"
NOMINAL = 0.9
"""Coverage that the intervals state."""

INTRODUCTION = """# Coverage of the 90 % intervals of sizes

Emulated twins: heaps of a world with one effect above 1.5 detectable sizes, analysed with a bank of their
own. *Held* are intervals, of effects that were named, with the true size in them; in brackets 95 % (Clopper
and Pearson). *z* is the error of the size over the standard error that a normal interval so wide would have.
"""


@dataclass(frozen=True)
class Twin:
    """One twin: its effect, and the interval that the analysis gave."""

    scale: str
    bank: int
    trial: str
    mechanism: str
    multiple: float
    """True size in detectable ones."""
    true_size: float
    verdict: str
    size: float
    low: float
    high: float
    """In natural units; NaN where nothing was named."""
    seconds: float
    """Of a core."""


def trials_of(world: World, count: int, seed: int) -> tuple[Trial, ...]:
    """Draw at least so many trials, as many of each resolvable mechanism, and keep the first so many."""
    each = math.ceil(count / max(sum(one.resolvable for one in world.library), 1))
    plan = Plan(
        nulls=0, strong=each, weak=0, unresolved=0, withheld=0, strangers=0, pairs=0, replicates=REPLICATES
    )
    space = world.known.space
    factors = [Factor(*one) for one in zip(space.factors, space.lower, space.upper, strict=True)]
    return draw(plan, factors, world.library, (), np.random.default_rng(seed), str)[:count]


def twin_of(world: World, observables: Sequence[str], scale: str, bank: int, trial: Trial) -> Twin:
    """Analyse one trial with a library of its own mechanism alone."""
    label, _ = trial
    (name, true_size), started = label.sizes[0], time.process_time()
    alone = world.known.without(*(other for other in world.known.space.names if other != name))
    found = run_trial(replace(world, known=alone), observables, trial)
    ends = (found.size, found.size_low, found.size_high)
    seconds = time.process_time() - started
    return Twin(scale, bank, label.trial, name, label.multiples[0], true_size, found.verdict, *ends, seconds)


def coverage(table: pd.DataFrame) -> pd.DataFrame:
    """Count intervals that hold the truth, by mechanism and in all, as text.

    Parameters
    ----------
    table : DataFrame
        Rows of `Twin`.
    """
    parts = [(str(name), rows) for name, rows in table.groupby("mechanism")]
    return pd.DataFrame([_counted(name, rows) for name, rows in [*parts, ("all", table)]])


def _counted(name: str, rows: pd.DataFrame) -> dict[str, object]:
    named = rows[rows["size"].notna()]
    below, above = named["true_size"] < named["low"], named["true_size"] > named["high"]
    held = share(~(below | above))
    low, high = held.interval
    # where an end of the range cuts an interval off, half of the width tells less
    wide = stats.norm.ppf(0.5 + NOMINAL / 2.0)
    z = wide * (named["size"] - named["true_size"]) / ((named["high"] - named["low"]) / 2.0)
    return {
        "effect": name.replace("_", " "),
        "twins": str(len(rows)),
        "named": str(len(named)),
        "held": f"{100.0 * held.value:.1f} % ({100.0 * low:.0f} to {100.0 * high:.0f})",
        "truth below": str(int(below.sum())),
        "truth above": str(int(above.sum())),
        "z": f"{z.mean():+.2f} ± {z.std():.2f}",
    }


def write_record(out: Path, record: Path) -> Path:
    """Write the page of the twins of a folder, its notes after the introduction."""
    copy_file(out / TWINS, record / TWINS)
    table, notes = read_twins(record), record / NOTES
    parts = []
    for scale, rows in table.groupby("scale", sort=False):
        parts += [f"## Scale: {scale}", markdown_table(coverage(rows))]
    text = notes.read_text(encoding="utf-8") if notes.is_file() else ""
    return write_page(record / PAGE, INTRODUCTION, text, *parts)


def read_twins(folder: Path) -> pd.DataFrame:
    """Read the twins of a folder.

    Raises
    ------
    InputError
        When it has none.
    """
    path = folder / TWINS
    if not path.is_file():
        raise InputError(str(path), "needs twins that were analysed", "none")
    return pd.read_csv(path, dtype={"trial": str, "verdict": str})


def _add(folder: Path, twin: Twin) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / TWINS).open("a", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Twin)], lineterminator="\n")
        if not file.tell():
            writer.writeheader()
        row = {n: f"{v:.6g}" if isinstance(v, float) else v for n, v in asdict(twin).items()}
        writer.writerow(row | {"seconds": f"{twin.seconds:.2f}"})


def _worlds(scale: str, bend: float, banks: int, seed: int) -> Iterator[World]:
    search = Search.of(load_study(STUDY, scale or None))
    truth = EmulatedSimulator(fit_emulator(search.read_bank(bank_beside(scale))), bend)
    return (World.of(truth, search.settings, seed + number) for number in range(banks))


def main(
    folder: Annotated[Path, typer.Argument(help="Folder of the twins.")],
    record: Annotated[Path | None, typer.Option("--out", help="Write the record, and run nothing.")] = None,
    scale: Annotated[str, typer.Option(help="Scale of the trial study; left out: as written.")] = "",
    twins: Annotated[int, typer.Option(help="Twins in all.", min=1)] = 1000,
    banks: Annotated[int, typer.Option(help="Banks that are drawn.", min=1)] = 4,
    bend: Annotated[float, typer.Option(help="What no polynomial follows, in deviations of one run.")] = 0.3,
    seed: Annotated[int, typer.Option(help="Of the first bank; each has the next.")] = 5000,
    seconds: Annotated[float, typer.Option(help="Begin nothing after this time.")] = math.inf,
) -> None:
    """Count how many intervals hold the true size."""
    deadline, title = time.monotonic() + seconds, scale or "as written"
    with clear_errors("Resume with the same command."):
        if record is not None:
            print(write_record(folder, record))
            return
        done = set()
        if (folder / TWINS).is_file():
            done = {tuple(row) for row in read_twins(folder)[["scale", "bank", "trial"]].to_numpy()}
        for bank, world in enumerate(_worlds(scale, bend, banks, seed), start=seed):
            for trial in trials_of(world, twins // banks, bank):
                if time.monotonic() < deadline and (title, bank, trial[0].trial) not in done:
                    _add(folder, twin_of(world, NAMES, title, bank, trial))
        table = read_twins(folder)
        print(coverage(table[table["scale"] == title]).to_string(index=False))


if __name__ == "__main__":
    typer.run(main)
