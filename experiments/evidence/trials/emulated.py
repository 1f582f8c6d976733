"""Trials of the decision rules on a bank alone, in seconds: the truth is an emulator.

    python -m experiments.evidence.trials.emulated --scale bench --banks 8

They tune and guard the rules without a simulation. From the emulator of the shipped bank, bent by what no
polynomial follows, new banks are drawn, and an analysis knows no more than one of these: so their noise, and
what their emulators miss, show. Truths are drawn and judged as the sealed ones are; the heaps are shifted as
the rules say that cameras and time steps do. Only the blind trials show if the bent emulator is like the
engine.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer

from doe import Factor
from doe.discrepancy import Emulator, Settings, analyse, drive, fit_emulator
from experiments.discover.search import Search
from experiments.evidence.trials.declaration import declared_effects, with_names
from experiments.evidence.trials.drawing import Declared, Plan, draw
from experiments.evidence.trials.emulated_simulator import EmulatedSimulator, emulated_heaps, redrawn_bank
from experiments.evidence.trials.findings import EVERYTHING, PHOTOGRAPHS, VIEWS, Finding, findings_table
from experiments.evidence.trials.generate import STUDY, bank_beside
from experiments.evidence.trials.score import aims, confusion, scored
from experiments.evidence.trials.truth import Label, Sealed
from experiments.studyfile import load_study

REPLICATES = 8
"""Heaps a condition, as in the sealed trials."""

Trial = tuple[Label, Sealed]


@dataclass(frozen=True, eq=False)
class World:
    """An emulated world, and what its bank lets one know of it."""

    truth: EmulatedSimulator
    """Makes the heaps and the fresh runs."""
    known: Emulator
    """Fitted to a bank that was drawn from the truth; the analysis has no other."""
    library: tuple[Declared, ...]
    """Mechanisms as that emulator declares them."""
    settings: Settings
    """Rules that let the resolvable ones be named."""

    @classmethod
    def of(cls, truth: EmulatedSimulator, settings: Settings, seed: int) -> World:
        """Draw a bank and declare what it shows."""
        known = fit_emulator(redrawn_bank(truth, settings, seed))
        library = declared_effects(known, settings, REPLICATES)
        return cls(truth, known, library, with_names(settings, library))


def draw_trials(world: World, count: int, seed: int) -> tuple[Trial, ...]:
    """Draw so many trials of each resolvable mechanism, known and withheld; of none and of two as well."""
    space, resolvable = world.known.space, sum(one.resolvable for one in world.library)
    plan = Plan(
        nulls=4 * count,
        strong=count,
        weak=0,
        unresolved=0,
        withheld=count,
        strangers=0,
        pairs=count * resolvable // 4 if resolvable > 1 else 0,
        replicates=REPLICATES,
    )
    factors = [Factor(*each) for each in zip(space.factors, space.lower, space.upper, strict=True)]
    return draw(plan, factors, world.library, (), np.random.default_rng(seed), str)


def run_trial(world: World, observables: Sequence[str], trial: Trial) -> Finding:
    """Analyse one trial, of which some observables are measured."""
    (label, sealed), settings = trial, world.settings
    truth = (world.truth, label.theta, dict(label.sizes))
    measured = emulated_heaps(*truth, REPLICATES, label.seed, settings.systematic).only(observables)
    known = world.known.without(*sealed.withheld)
    found = drive(analyse(measured, known, settings, label.seed), world.truth)
    return Finding.of(label.trial, EVERYTHING, found)


def judged(findings: Iterable[Finding], trials: Iterable[Trial]) -> pd.DataFrame:
    """Set findings of one world against its truths, as `scored` does."""
    labels, sealed = zip(*trials, strict=True)
    return scored(findings_table(findings), {label.trial: label for label in labels}, sealed)


def size_errors(table: pd.DataFrame) -> pd.Series:
    """Errors of the sizes of mechanisms that were rightly named alone, in their standard errors."""
    named = table[table["right"] & (table["kind"] == "single")]
    return 2.0 * 1.645 * (named["size"] - named["true_size"]) / (named["size_high"] - named["size_low"])


def main(
    scale: Annotated[str, typer.Option(help="Scale of the trial study; left out: as written.")] = "",
    bank: Annotated[Path | None, typer.Option(help="Bank of the trial study; left out: its own.")] = None,
    photographs: Annotated[bool, typer.Option("--photographs", help="With photographs only.")] = False,
    count: Annotated[int, typer.Option(help="Trials of each mechanism with every bank.")] = 1,
    banks: Annotated[int, typer.Option(help="Banks that are drawn.")] = 4,
    bend: Annotated[float, typer.Option(help="What no polynomial follows, in deviations of one run.")] = 0.3,
    seed: Annotated[int, typer.Option()] = 0,
    workers: Annotated[int | None, typer.Option(help="Processes; default: one a core.")] = None,
) -> None:
    """Try the decision rules on banks drawn from the emulator of the trial study."""
    search = Search.of(load_study(STUDY, scale or None))
    truth = EmulatedSimulator(fit_emulator(search.read_bank(bank or bank_beside(scale))), bend)
    seen, tables = VIEWS[PHOTOGRAPHS if photographs else EVERYTHING], []
    with ProcessPoolExecutor(workers) as pool:
        for number in range(seed, seed + banks):
            world = World.of(truth, search.settings, number)
            trials = draw_trials(world, count, 1000 * number)
            tables.append(judged(pool.map(partial(run_trial, world, seen), trials), trials))
    table = pd.concat(tables, ignore_index=True)
    print(confusion(table).to_string())
    print(pd.DataFrame(aims(table, ())).to_string(index=False))
    z = size_errors(table)
    cases = f"{table['fresh_cases'].mean():.0f} fresh cases an analysis"
    print(f"sizes: z {z.mean():.2f} +- {z.std():.2f}; {cases}")


if __name__ == "__main__":
    typer.run(main)
