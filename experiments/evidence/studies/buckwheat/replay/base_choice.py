"""Choice of a base and of how its heaps are read, by the paper's own tables. The rule stood before the runs.

A candidate is a base read by one estimator, which gave an angle for every one of the 31 runs. Its misfit to
some tables is the root mean square difference from the published angles of their runs, the noise of both
taken out (`Agreement.rmse_without_noise`: ours by our replicates, the published by the composite centre).
Candidates of equal misfit, such as 0, are ranked by the root mean square with the noise in it, then by their
order in `BASES` and `ESTIMATORS`.

1. First phase: one heap a run (replicate 1) under all ten bases. The four bases whose best candidates have
   the least misfits to all three tables go on.
2. Second phase: three heaps a run under those four.
3. Each table is left out once: the candidate of least misfit to the other two is tested on it.
4. The base and the estimator are the candidate of least misfit to all three tables.

Nothing is fitted and no angle is shifted.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import pandas as pd

from experiments.evidence.studies.buckwheat.replay.base_heaps import BASES, ESTIMATORS, base_table
from experiments.evidence.studies.buckwheat.replay.replay import Replay
from experiments.evidence.studies.buckwheat.replay.runs import DESIGNS
from experiments.io.errors import InputError

GO_ON = 4
"""Bases that go on to the second phase."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """One base, read by one estimator."""

    base: str
    estimator: str
    replay: Replay

    def misfit(self, tables: Iterable[str] = DESIGNS) -> tuple[float, float]:
        """Return the root mean square difference over some tables [deg], without and with the noise."""
        found = self.replay.agreement(tables)
        return found.rmse_without_noise.value, found.rmse.value


@dataclass(frozen=True, eq=False)
class BaseChoice:
    """Candidates of which one is chosen."""

    candidates: Sequence[Candidate]

    @classmethod
    def of(cls, heaps: pd.DataFrame) -> BaseChoice:
        """Take the candidates among heaps of several bases, a row each, with the column ``base``."""
        made = (
            Candidate(str(base), name, Replay(own.assign(angle=own[name])))
            for base, own in heaps.groupby("base", sort=False)
            for name in ESTIMATORS
        )
        return cls([each for each in made if each.replay.runs["n"].all()])

    def best(self, tables: Iterable[str] = DESIGNS) -> Candidate:
        """Choose the candidate of least misfit to some tables."""
        return min(self.candidates, key=lambda each: each.misfit(tables))

    @cached_property
    def best_of_bases(self) -> list[Candidate]:
        """The best candidate of each base, the best base first."""
        bases = dict.fromkeys(each.base for each in self.candidates)
        found = [BaseChoice([c for c in self.candidates if c.base == base]).best() for base in bases]
        return sorted(found, key=Candidate.misfit)

    @cached_property
    def left_out(self) -> dict[str, Candidate]:
        """Choice of the other two tables, by the one that is left out."""
        return {out: self.best([each for each in DESIGNS if each != out]) for out in DESIGNS}


def read_heaps(folder: Path) -> pd.DataFrame:
    """Read the heaps of all bases, with the column ``base``; InputError where a base was not simulated."""
    if lacking := [name for name in BASES if not base_table(folder, name).is_file()]:
        raise InputError(str(folder), "must have the heaps of all bases", f"none of {', '.join(lacking)}")
    return pd.concat([pd.read_csv(base_table(folder, name)).assign(base=name) for name in BASES])


def first_phase(heaps: pd.DataFrame) -> BaseChoice:
    """Choose among all bases by one heap a run."""
    return BaseChoice.of(heaps[heaps["replicate"] == 1])


def second_phase(heaps: pd.DataFrame) -> BaseChoice:
    """Choose among the bases that went on, by all of their heaps."""
    names = [each.base for each in first_phase(heaps).best_of_bases[:GO_ON]]
    return BaseChoice.of(heaps[heaps["base"].isin(names)])
