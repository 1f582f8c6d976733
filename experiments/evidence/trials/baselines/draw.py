"""Draw the benchmark: banks and trials from an emulated world, the same for every method.

    python -m experiments.evidence.trials.baselines.draw

The emulator of the shipped bench bank, bent by what no polynomial follows, is the truth; banks and heaps are
drawn from it. Any first part of the trials is balanced: they come in rounds of each kind, the banks in turn.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from itertools import combinations
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from doe.discrepancy import Bank, Measured, Outcomes, Point, SearchSpace, Settings, fit_emulator
from experiments.discover.search import Search
from experiments.evidence.trials.baselines.benchmark_files import FOLDER, Benchmark, Posed, write_benchmark
from experiments.evidence.trials.baselines.emulated_world import (
    EmulatedSimulator,
    emulated_heaps,
    redrawn_bank,
)
from experiments.evidence.trials.declaration import declared_effects, with_names
from experiments.evidence.trials.generate_trials import STUDY, bank_beside
from experiments.evidence.trials.truth import Kind, Label
from experiments.evidence.trials.truths import STRONG, Declared
from experiments.studyfile import load_study

SCALE = "bench"
BEND = 0.3
"""Standard deviation of the part of the truth that no polynomial follows, in those of one run."""
REPLICATES = 8
"""Heaps a condition."""
MULTIPLES = (2.0, 1.0, 3.0, 1.5, 0.5)
"""Sizes of single mechanisms in detectable ones, as far as their ranges have them; the detectable size is
that which the search declares to find and to tell from every other in four trials of five."""
NULLS, WITHHELD = 4, 2
"""Trials a round in which nothing is hidden, and in which the hidden mechanism is not in the library."""

Hidden = tuple[Kind, tuple[tuple[Declared, float], ...]]
"""Kind of a trial, and its mechanisms with their sizes in detectable ones."""


@cache
def true_world() -> tuple[EmulatedSimulator, Settings]:
    """Return the simulator that stands for reality, and the rules of its study."""
    search = Search.of(load_study(STUDY, SCALE))
    return EmulatedSimulator(fit_emulator(search.read_bank(bank_beside(SCALE))), BEND), search.settings


def fresh_runs(points: Sequence[Point]) -> Outcomes:
    """Observables of points in the true world, as an analysis may ask for them."""
    return true_world()[0](points)


def round_of(library: Sequence[Declared], number: int, rng: np.random.Generator) -> Iterator[Hidden]:
    """Draw one round of trials: kinds, mechanisms and multiples."""
    named = [effect for effect in library if effect.resolvable]
    yield from ((Kind.NULL, ()) for _ in range(NULLS))
    for index, effect in enumerate(named):
        within = [multiple for multiple in MULTIPLES if multiple <= effect.strongest]
        yield Kind.SINGLE, ((effect, within[(number + index) % len(within)]),)
    apart = [(one, other) for one, other in combinations(named, 2) if other.name not in one.kin]
    pair = apart[rng.integers(len(apart))]
    yield Kind.PAIR, tuple((effect, _strong(effect, rng)) for effect in pair)
    for turn in range(WITHHELD):
        effect = named[(WITHHELD * number + turn) % len(named)]
        yield Kind.WITHHELD, ((effect, _strong(effect, rng)),)


def _strong(effect: Declared, rng: np.random.Generator) -> float:
    """Draw a multiple above the limit of what is to be named, uniform in its logarithm."""
    return float(np.exp(rng.uniform(math.log(STRONG), math.log(effect.strongest))))


def trial_of(
    name: str, hidden: Hidden, space: SearchSpace, bank: int, rng: np.random.Generator
) -> tuple[Label, tuple[str, ...]]:
    """Draw the rest of a trial: factors and seed. The name tells the bank alone."""
    kind, effects = hidden
    theta = tuple(float(rng.uniform(low, high)) for low, high in zip(space.lower, space.upper, strict=True))
    drawn = sorted((effect.name, float(effect.size(multiple)), multiple) for effect, multiple in effects)
    sizes, multiples = tuple((n, size) for n, size, _ in drawn), tuple(m for _, _, m in drawn)
    label = Label(name, kind, theta, sizes, multiples, int(rng.integers(2**31)), str(bank))
    withheld = {one for effect, _ in effects for one in (effect.name, *effect.kin)}
    return label, tuple(sorted(withheld)) if kind is Kind.WITHHELD else ()


def draw_benchmark(banks: int, rounds: int, seed: int) -> tuple[Benchmark, list[Label]]:
    """Draw banks, and rounds of trials with each."""
    truth, settings = true_world()
    drawn, rules, libraries = [], [], []
    for number in range(banks):
        bank = _as_written(redrawn_bank(truth, settings, seed + number))
        library = declared_effects(fit_emulator(bank), settings, REPLICATES)
        drawn.append(bank)
        rules.append(with_names(settings, library))
        libraries.append(library)
    rng = np.random.default_rng([seed, 1])
    labels: list[Label] = []
    posed: list[Posed] = []
    for turn in range(rounds):
        for number, library in enumerate(libraries):
            for hidden in round_of(library, turn, rng):
                name = f"trial-{len(labels) + 1:03d}"
                label, withheld = trial_of(name, hidden, truth.emulator.space, number, rng)
                labels.append(label)
                posed.append(Posed(name, number, withheld, _heaps(truth, label, settings)))
    return Benchmark(tuple(drawn), tuple(rules), tuple(libraries), tuple(posed)), labels


def _as_written(bank: Bank) -> Bank:
    """Round the values as the file does, so that what is declared holds for the file."""
    return replace(bank, values=bank.values.astype(np.float32).astype(float))


def _heaps(truth: EmulatedSimulator, label: Label, settings: Settings) -> Measured:
    sizes = dict(label.sizes)
    return emulated_heaps(truth, label.theta, sizes, REPLICATES, label.seed, settings.systematic)


def main(
    out: Annotated[Path, typer.Option(help="Folder of the benchmark.")] = FOLDER,
    banks: Annotated[int, typer.Option(help="Banks.", min=1)] = 2,
    rounds: Annotated[int, typer.Option(help="Rounds of trials with each bank.", min=1)] = 10,
    seed: Annotated[int, typer.Option(help="Seed of everything that is drawn.")] = 20261123,
) -> None:
    """Draw the benchmark and write it."""
    benchmark, labels = draw_benchmark(banks, rounds, seed)
    write_benchmark(out, benchmark, labels)
    print(f"{len(labels)} trials, {banks} banks: {out}")


if __name__ == "__main__":
    typer.run(main)
