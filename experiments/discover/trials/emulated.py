"""Trials of the decision rules on a bank alone, in seconds: the truth is drawn from the emulator.

    python -m experiments.discover.trials.emulated bank.npz --count 8

They tune and guard the rules without a simulation. The heaps are shifted as the rules say that cameras and
time steps shift them. What they cannot show is whether the emulator is right; the blind trials do that.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer

from experiments.discover.analysis import analyse
from experiments.discover.discovery import Discovery, Verdict
from experiments.discover.emulated import EmulatedSimulator, emulated_heaps
from experiments.discover.emulator import Emulator, read_emulator
from experiments.discover.search import drive
from experiments.discover.settings import Settings
from experiments.discover.trials.declaration import declared_effects, with_names
from experiments.discover.trials.drawing import STRONG, Effect

REPLICATES = 8
"""Heaps a condition, as in the sealed trials."""
STRONGEST = 6.0
"""Largest size drawn, in gamma80, where the range has so much."""


@dataclass(frozen=True)
class Truth:
    """What a trial hides.

    Attributes
    ----------
    kind : str
        ``none``, ``one``, ``two`` or ``withheld`` (one that the library lacks).
    sizes : tuple of (str, float)
    theta : tuple of float
    seed : int
    library_lacks : tuple of str
        What is withheld: the mechanism, and those that look like it.
    """

    kind: str
    sizes: tuple[tuple[str, float], ...]
    theta: tuple[float, ...]
    seed: int
    library_lacks: tuple[str, ...] = ()


def draw_truths(emulator: Emulator, effects: tuple[Effect, ...], count: int, seed: int) -> Iterator[Truth]:
    """Draw so many trials of each resolvable mechanism, known and withheld; of none and of two as well.

    Parameters
    ----------
    emulator : Emulator
    effects : tuple of Effect
        The library with its gamma80.
    count, seed : int
    """
    rng = np.random.default_rng(seed)
    visible = [effect for effect in effects if effect.resolvable]
    pairs = list(combinations(visible, 2))
    chosen = rng.permutation(len(pairs))[: count * len(visible) // 4]
    hidden: list[tuple[str, tuple[Effect, ...]]] = [("none", ())] * (4 * count)
    for kind in ("one", "withheld"):
        hidden += [(kind, (effect,)) for effect in visible for _ in range(count)]
    hidden += [("two", pairs[index]) for index in chosen]
    for number, (kind, members) in enumerate(hidden):
        coded = rng.uniform(-0.9, 0.9, len(emulator.space.factors))
        sizes = tuple((effect.name, _size(effect, rng)) for effect in members)
        theta = tuple(float(value) for value in emulator.space.natural_theta(coded))
        lacks = [{effect.name, *effect.kin} for effect in members if kind == "withheld"]
        yield Truth(kind, sizes, theta, seed + number, tuple(sorted(set().union(*lacks))))


def _size(effect: Effect, rng: np.random.Generator) -> float:
    span = abs(effect.maximum - effect.null)
    least = min(STRONG * effect.gamma80, span)
    drawn = np.exp(rng.uniform(np.log(least), np.log(min(STRONGEST * effect.gamma80, span))))
    return float(effect.null + drawn * np.sign(effect.maximum - effect.null))


def run_trial(emulator: Emulator, settings: Settings, truth: Truth) -> dict[str, object]:
    """Analyse one trial; a row of the table of `emulated_trials`."""
    measured = emulated_heaps(
        emulator, truth.theta, dict(truth.sizes), REPLICATES, truth.seed, settings.systematic
    )
    known = emulator.without(*truth.library_lacks)
    found = drive(analyse(measured, known, settings, truth.seed), EmulatedSimulator(emulator))
    hidden = tuple(sorted(name for name, _ in truth.sizes))
    covered = None
    if truth.kind == "one" and found.verdict == Verdict.NAMED and found.named == hidden and found.chosen:
        size = found.chosen.sizes[0]
        covered = size.low <= truth.sizes[0][1] <= size.high
    return {
        "kind": truth.kind,
        "hidden": " + ".join(hidden),
        "verdict": found.verdict.value,
        "named": " + ".join(sorted(found.named)),
        "right": _is_right(truth, found, hidden),
        "wrong": found.verdict == Verdict.NAMED
        and not set(found.named) <= set(hidden) - set(truth.library_lacks),
        "covered": covered,
        "cases": found.effort.fresh_cases,
    }


def _is_right(truth: Truth, found: Discovery, hidden: tuple[str, ...]) -> bool:
    if truth.kind == "withheld":
        return found.verdict == Verdict.UNKNOWN
    if truth.kind == "none":
        return found.verdict == Verdict.NONE
    return found.verdict == Verdict.NAMED and tuple(sorted(found.named)) == hidden


def emulated_trials(
    emulator: Emulator, settings: Settings, count: int, seed: int = 0, workers: int | None = None
) -> pd.DataFrame:
    """Run trials side by side.

    Returns
    -------
    pandas.DataFrame
        A row a trial: what was hidden, the verdict, what was named, whether that is right, or names something
        that was not there, whether the interval of the size covers the truth, fresh cases.
    """
    effects = declared_effects(emulator, settings, REPLICATES)
    fixed = with_names(settings, effects)
    truths = list(draw_truths(emulator, effects, count, seed))
    with ProcessPoolExecutor(workers) as pool:
        rows = list(pool.map(partial(run_trial, emulator, fixed), truths))
    return pd.DataFrame(rows)


def summary(table: pd.DataFrame) -> pd.DataFrame:
    """Verdicts by what was hidden, with the shares that were right, wrong and covered."""
    grouped = table.groupby(["kind", "hidden"], sort=False)
    verdicts = pd.crosstab([table["kind"], table["hidden"]], table["verdict"])
    shares = grouped[["right", "wrong", "cases"]].mean()
    covered = grouped["covered"].apply(lambda column: column.dropna().astype(float).mean())
    return shares.join(covered).join(verdicts)


def main(
    bank: Annotated[Path, typer.Argument(help="Bank of a study.")],
    count: Annotated[int, typer.Option(help="Trials of each mechanism.")] = 4,
    seed: Annotated[int, typer.Option()] = 0,
    workers: Annotated[int | None, typer.Option(help="Processes; default: one a core.")] = None,
) -> None:
    """Try the decision rules on a bank."""
    emulator, settings = read_emulator(bank), Settings()
    for effect in declared_effects(emulator, settings, REPLICATES):
        print(f"{effect.name}: gamma80 {effect.gamma80:.4g} of {abs(effect.maximum - effect.null):.4g}")
    table = emulated_trials(emulator, settings, count, seed, workers)
    print(summary(table).round(2).to_string())
    print(table.groupby("kind")[["right", "wrong"]].mean().round(3).to_string())


if __name__ == "__main__":
    typer.run(main)
