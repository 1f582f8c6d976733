"""Trials of the decision rules on a bank alone, in seconds: the truth is an emulator.

    python -m experiments.trials.emulated --scale bench --banks 8

They tune and guard the rules without a simulation. From the emulator of the shipped bank, bent by what no
polynomial follows, new banks are drawn, and an analysis knows no more than one of these: so their noise, and
what their emulators miss, show. The heaps are shifted as the rules say that cameras and time steps do.
Whether the bent emulator is like the engine, only the blind trials show.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from typing import Annotated

import numpy as np
import pandas as pd
import typer

from experiments.discover.analysis import analyse
from experiments.discover.discovery import Discovery, Verdict
from experiments.discover.emulated import EmulatedSimulator, emulated_heaps, redrawn_bank
from experiments.discover.emulator import Emulator, fit_emulator
from experiments.discover.search import Search, drive
from experiments.discover.settings import Settings
from experiments.measurement.observables import NAMES, PHOTOGRAPHED
from experiments.studyfile import load_study
from experiments.trials.declaration import declared_effects, with_names
from experiments.trials.drawing import STRONG, Effect
from experiments.trials.generate import STUDY, bank_beside

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


@dataclass(frozen=True, eq=False)
class World:
    """An emulated world, and what its bank lets one know of it.

    Attributes
    ----------
    truth : EmulatedSimulator
        Makes the heaps and the fresh runs.
    known : Emulator
        Fitted to a bank that was drawn from the truth; the analysis has no other.
    effects : tuple of Effect
        Of the library, as that emulator declares them.
    settings : Settings
        Which let the resolvable ones be named.
    """

    truth: EmulatedSimulator
    known: Emulator
    effects: tuple[Effect, ...]
    settings: Settings

    @classmethod
    def of(cls, truth: EmulatedSimulator, settings: Settings, seed: int) -> World:
        """Draw a bank and declare what it shows."""
        known = fit_emulator(redrawn_bank(truth, settings, seed))
        effects = declared_effects(known, settings, REPLICATES)
        return cls(truth, known, effects, with_names(settings, effects))


def run_trial(world: World, observables: tuple[str, ...], truth: Truth) -> dict[str, object]:
    """Analyse one trial, of which some observables are measured; a row of the table of `emulated_trials`."""
    settings = world.settings
    measured = emulated_heaps(
        world.truth, truth.theta, dict(truth.sizes), REPLICATES, truth.seed, settings.systematic
    ).only(observables)
    known = world.known.without(*truth.library_lacks)
    found = drive(analyse(measured, known, settings, truth.seed), world.truth)
    hidden = tuple(sorted(name for name, _ in truth.sizes))
    covered, z = None, None
    if truth.kind == "one":
        covered, z = _size_found(found, world.known, *truth.sizes[0])
    return {
        "kind": truth.kind,
        "hidden": " + ".join(hidden),
        "verdict": found.verdict.value,
        "named": " + ".join(sorted(found.named)),
        "right": _is_right(truth, found, hidden),
        "wrong": found.verdict == Verdict.NAMED
        and not set(found.named) <= set(hidden) - set(truth.library_lacks),
        "covered": covered,
        "z": z,
        "cases": found.effort.fresh_cases,
    }


def _size_found(
    found: Discovery, known: Emulator, hidden: str, size: float
) -> tuple[bool | None, float | None]:
    """Whether the interval of a named mechanism covers its size, and the error over its standard error."""
    if found.verdict != Verdict.NAMED or found.named != (hidden,):
        return None, None
    (one,) = (candidate for candidate in found.candidates if candidate.mechanisms == (hidden,))
    got, effect = one.sizes[0], one.sizes[0].value - known.space.mechanism(hidden).null
    return got.low <= size <= got.high, (got.value - size) / abs(effect) * one.size_over_se[0]


def _is_right(truth: Truth, found: Discovery, hidden: tuple[str, ...]) -> bool:
    if truth.kind == "withheld":
        return found.verdict == Verdict.UNKNOWN
    if truth.kind == "none":
        return found.verdict == Verdict.NONE
    return found.verdict == Verdict.NAMED and tuple(sorted(found.named)) == hidden


def emulated_trials(
    truth: EmulatedSimulator,
    settings: Settings,
    count: int,
    banks: int = 1,
    observables: tuple[str, ...] = NAMES,
    seed: int = 0,
    workers: int | None = None,
) -> pd.DataFrame:
    """Run trials side by side.

    Parameters
    ----------
    truth : EmulatedSimulator
    settings : Settings
        Of the banks that are drawn from it, and of the analyses.
    count : int
        Trials of each mechanism with every bank.
    banks : int
    observables : tuple of str
        What is measured.
    seed : int
        Of the banks and of the trials.
    workers : int, optional
        Processes; None: one a core.

    Returns
    -------
    pandas.DataFrame
        A row a trial: what was hidden, the verdict, what was named, whether that is right, or names something
        that was not there; of a single effect that was named whether the interval of its size covers the
        truth, and by how many standard errors the size is off; fresh cases.
    """
    rows: list[dict[str, object]] = []
    with ProcessPoolExecutor(workers) as pool:
        for number in range(banks):
            world = World.of(truth, settings, seed + number)
            truths = draw_truths(world.known, world.effects, count, 1000 * (seed + number))
            rows += pool.map(partial(run_trial, world, observables), truths)
    return pd.DataFrame(rows)


def summary(table: pd.DataFrame) -> pd.DataFrame:
    """Verdicts by what was hidden, with the shares that were right, wrong and covered."""
    grouped = table.groupby(["kind", "hidden"], sort=False)
    verdicts = pd.crosstab([table["kind"], table["hidden"]], table["verdict"])
    shares = grouped[["right", "wrong", "cases"]].mean()
    covered = grouped["covered"].apply(lambda column: column.dropna().astype(float).mean())
    return shares.join(covered).join(verdicts)


def main(
    scale: Annotated[str, typer.Option(help="Scale of the trial study; left out: as written.")] = "",
    photographs: Annotated[bool, typer.Option("--photographs", help="With photographs only.")] = False,
    count: Annotated[int, typer.Option(help="Trials of each mechanism with every bank.")] = 1,
    banks: Annotated[int, typer.Option(help="Banks that are drawn.")] = 4,
    bend: Annotated[float, typer.Option(help="What no polynomial follows, in deviations of one run.")] = 0.3,
    seed: Annotated[int, typer.Option()] = 0,
    workers: Annotated[int | None, typer.Option(help="Processes; default: one a core.")] = None,
) -> None:
    """Try the decision rules on banks drawn from the emulator of the trial study."""
    search = Search.of(load_study(STUDY, scale or None))
    truth = EmulatedSimulator(fit_emulator(search.read_bank(bank_beside(scale))), bend)
    seen = PHOTOGRAPHED if photographs else NAMES
    table = emulated_trials(truth, search.settings, count, banks, seen, seed, workers)
    print(summary(table).round(2).to_string())
    print(table.groupby("kind")[["right", "wrong"]].mean().round(3).to_string())
    z, covered = table["z"].dropna().astype(float), table["covered"].dropna().astype(float)
    print(f"sizes: {covered.mean():.0%} of {len(covered)} covered; z {z.mean():.2f} +- {z.std():.2f}")


if __name__ == "__main__":
    typer.run(main)
