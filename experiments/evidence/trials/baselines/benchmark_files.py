"""The files of the benchmark of model criticism, and their loader.

Their `README.md` describes them. The answers are a file of their own, so that nobody opens them
by chance.
"""

import json
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from doe.discrepancy import Bank, Emulator, Measured, Settings, fit_emulator, load_bank
from experiments.evidence.trials.baselines.protocol import Problem
from experiments.evidence.trials.truth import Label, read_labels
from experiments.evidence.trials.truths import Declared
from experiments.io.errors import InputError

FOLDER = Path(__file__).parent / "benchmark"
"""The released benchmark."""
TRIALS, RULES, ANSWERS = "trials.npz", "rules.json", "answers.json"
LARGEST = 50_000_000
"""Bytes of the largest file of trials that is read."""


@dataclass(frozen=True, eq=False)
class Posed:
    """A trial without its answer."""

    name: str
    bank: int
    """Number of the bank that belongs to it."""
    withheld: tuple[str, ...]
    """Mechanisms of the bank that are not in the library of this trial."""
    measured: Measured
    """Its heaps."""


@dataclass(frozen=True, eq=False)
class Benchmark:
    """Banks, the search's rules for each, and trials."""

    banks: tuple[Bank, ...]
    rules: tuple[Settings, ...]
    """Settings of the search by bank, with what it may name."""
    libraries: tuple[tuple[Declared, ...], ...]
    """Mechanisms by bank, with their detectable sizes."""
    trials: tuple[Posed, ...]

    def __post_init__(self) -> None:
        if not len(self.banks) == len(self.rules) == len(self.libraries) or not self.banks:
            counts = (len(self.banks), len(self.rules), len(self.libraries))
            raise InputError("Benchmark", "needs rules and a library for each of at least one bank", counts)
        if any(not 0 <= trial.bank < len(self.banks) for trial in self.trials):
            numbers = sorted({trial.bank for trial in self.trials})
            raise InputError(
                "Benchmark.trials", f"numbers of banks must be 0 to {len(self.banks) - 1}", numbers
            )

    @cached_property
    def emulators(self) -> tuple[Emulator, ...]:
        """Emulators fitted to the banks."""
        return tuple(fit_emulator(bank) for bank in self.banks)

    def problem(self, trial: Posed) -> Problem:
        """Return a trial as a method sees it."""
        known = self.emulators[trial.bank].without(*trial.withheld)
        seed = zlib.crc32(trial.name.encode())
        return Problem(trial.name, known, trial.measured, self.rules[trial.bank], seed)


def load_benchmark(folder: Path = FOLDER) -> Benchmark:
    """Read the banks, the rules and the trials, without the answers."""
    path = folder / TRIALS
    if not path.is_file() or path.stat().st_size > LARGEST:
        raise InputError(str(path), f"must be a file of at most {LARGEST:,} bytes", "none, or a larger one")
    with np.load(path, allow_pickle=False) as file:
        table = {name: file[name] for name in file.files}
    if lacking := {"trial", "bank", "withheld", "conditions", "observables", "values"} - set(table):
        raise InputError(str(path), "needs the arrays of a benchmark", f"no {', '.join(sorted(lacking))}")
    conditions, observables = (tuple(map(str, table[name])) for name in ("conditions", "observables"))
    trials = []
    for name, bank, withheld, rows in zip(
        table["trial"], table["bank"], table["withheld"], table["values"].astype(float), strict=True
    ):
        measured = Measured(conditions, observables, dict(zip(conditions, rows, strict=True)))
        trials.append(Posed(str(name), int(bank), tuple(str(withheld).split()), measured))
    document = json.loads((folder / RULES).read_text(encoding="utf-8"))
    banks = tuple(load_bank(folder / f"bank-{number}.npz") for number in range(len(document)))
    rules = tuple(_settings(one["settings"]) for one in document)
    libraries = tuple(tuple(_effect(effect) for effect in one["library"]) for one in document)
    return Benchmark(banks, rules, libraries, tuple(trials))


def load_answers(folder: Path = FOLDER) -> Mapping[str, Label]:
    """Read the truths of the trials, by trial."""
    return {label.trial: label for label in read_labels(folder / ANSWERS)}


def _settings(document: dict[str, object]) -> Settings:
    named = document.pop("resolvable")
    settings = Settings(**document)  # type: ignore[arg-type]
    return replace(settings, resolvable=None if named is None else tuple(named))  # type: ignore[arg-type]


def _effect(document: dict[str, object]) -> Declared:
    found, kin = document.pop("detectable"), document.pop("kin")
    detectable = float("inf") if found is None else found
    return Declared(**document, detectable=detectable, kin=tuple(kin))  # type: ignore[arg-type]
