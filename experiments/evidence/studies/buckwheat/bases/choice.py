"""Choice of the study's base and of how its heaps are read, by leaving tables out.

A candidate is a base and an estimator. The rule, set before the runs: of the tables that may be seen, the
candidate of least root mean square difference from the published angles is taken, our own seed noise out.
What it is worth stands on the tables that were not seen. Nothing is fitted; where one common shift of all
angles is allowed for comparison, it is found on the tables that choose, and kept on the others.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from doe import Agreement
from experiments.evidence.studies.buckwheat.bases.base_heaps import Folder, angle_column
from experiments.evidence.studies.buckwheat.bases.grid import Base, bases, grid
from experiments.evidence.studies.buckwheat.replay.replay import Replay
from experiments.evidence.studies.buckwheat.replay.runs import DESIGNS
from experiments.evidence.studies.buckwheat.sensitivity.sensitivity_folder import SETTINGS

FloatArray = NDArray[np.float64]

DRAWS = 4_000
"""Draws of the bootstrap."""
SEED = 1
"""Of the bootstrap."""

AXES = ("law", "clump", "plate", "estimator")
"""Parts that a candidate is made of."""

SEEN = tuple(seen for size in (2, 1) for seen in combinations(DESIGNS, size))
"""Tables that choose: any two, any one."""


@dataclass(frozen=True)
class Candidate:
    """One base, read by one estimator."""

    base: Base
    estimator: str

    @property
    def name(self) -> str:
        """Name of the base, then that of the estimator."""
        return f"{self.base.name}-{self.estimator}"

    @property
    def options(self) -> dict[str, str]:
        """Name of its option on each of `AXES`."""
        return dict(zip(AXES, [option.name for option in self.base.options] + [self.estimator], strict=True))


@dataclass(frozen=True, eq=False)
class Misfits:
    """Misfits of candidates at runs, as they are or drawn."""

    differences: FloatArray
    """Our angle less the published one [deg], shape (candidates, runs)."""
    variances: FloatArray
    """Variance of each angle of ours by seed [deg2], shape (candidates, runs)."""
    stages: NDArray[np.str_]
    """Table of each run."""

    def of(self, stages: Sequence[str], shift: FloatArray | float = 0.0) -> FloatArray:
        """Mean square over some tables [deg2], own noise out, angles shifted [deg]: each candidate's."""
        seen = self._within(stages)
        shifted = self.differences[:, seen] + np.reshape(shift, (-1, 1))
        return (shifted**2 - self.variances[:, seen]).mean(axis=1)

    def shift(self, stages: Sequence[str]) -> FloatArray:
        """Return each candidate's shift [deg] that brings the mean over some tables to the published one."""
        return -self.differences[:, self._within(stages)].mean(axis=1)

    def _within(self, stages: Sequence[str]) -> NDArray[np.bool_]:
        return np.logical_or.reduce([self._runs_of[stage] for stage in stages])

    @cached_property
    def _runs_of(self) -> dict[str, NDArray[np.bool_]]:
        return {stage: self.stages == stage for stage in DESIGNS}

    def drawn(self, rng: np.random.Generator) -> Misfits:
        """As many runs of each table, drawn with replacement."""
        members = [np.flatnonzero(self.stages == stage) for stage in DESIGNS]
        runs = np.concatenate([rng.choice(at, len(at)) for at in members])
        return Misfits(self.differences[:, runs], self.variances[:, runs], self.stages[runs])

    def unseen(self, written: int) -> dict[str, float]:
        """Mean squares [deg2] over all runs, each table predicted by what the other two choose.

        ``written`` is that of the candidate of this number; ``choice`` and ``shifted`` are those of the
        choices without and with a shift.
        """
        sums = {"written": 0.0, "choice": 0.0, "shifted": 0.0}
        for stage in DESIGNS:
            seen = [other for other in DESIGNS if other != stage]
            count, shift = np.count_nonzero(self.stages == stage), self.shift(seen)
            plain, shifted = self.of([stage]), self.of([stage], shift)
            sums["written"] += count * plain[written]
            sums["choice"] += count * plain[np.argmin(self.of(seen))]
            sums["shifted"] += count * shifted[np.argmin(self.of(seen, shift))]
        return {key: float(value) / len(self.stages) for key, value in sums.items()}


@dataclass(frozen=True, eq=False)
class BaseChoice:
    """The 31 runs of every candidate, the study as written first."""

    candidates: tuple[Candidate, ...]
    replays: tuple[Replay, ...]
    """Of each candidate; every one with an angle for all 31 runs."""
    settings: dict[str, Any]
    """Settings of the simulations: scale, modulus_scale, replicates."""
    spoilt: tuple[str, ...] = ()
    """Candidates that lack the angle of a run."""

    @classmethod
    def read(cls, folder: Path) -> BaseChoice | None:
        """Read what a folder holds; None without the study as written, or without its angles."""
        candidates, replays, spoilt = [], [], []
        for base in bases().values():
            path = Folder(folder).table(base)
            table = pd.read_csv(path) if path.is_file() else pd.DataFrame()
            for estimator in grid().estimator:
                if (column := angle_column(estimator.name)) not in table:
                    continue
                candidate = Candidate(base, estimator.name)
                replay = Replay(table.assign(angle=table[column]))
                if replay.runs["angle"].notna().all():
                    candidates.append(candidate)
                    replays.append(replay)
                else:
                    spoilt.append(candidate.name)
        if written() not in candidates:
            return None
        settings = json.loads((folder / SETTINGS).read_text(encoding="utf-8"))
        return cls(tuple(candidates), tuple(replays), settings, tuple(spoilt))

    @cached_property
    def misfits(self) -> Misfits:
        """Misfits of all candidates, run by run."""
        differences = [replay.runs["difference"].to_numpy() for replay in self.replays]
        variances = [r.runs["stage"].map(r.heap_variance).to_numpy() / r.runs["n"] for r in self.replays]
        stages = self.replays[0].runs["stage"].to_numpy(dtype=str)
        return Misfits(np.array(differences), np.array(variances), stages)

    @cached_property
    def as_written(self) -> int:
        """Number of the study as written, read by the whole flank."""
        return self.candidates.index(written())

    @cached_property
    def chosen(self) -> int:
        """Number of the candidate that all three tables choose."""
        return int(np.argmin(self.misfits.of(DESIGNS)))

    def agreement(self, candidate: int, stages: Sequence[str] = DESIGNS) -> Agreement:
        """Agreement of a candidate with the published angles of some tables."""
        return self.replays[candidate].agreement(stages)

    @cached_property
    def table(self) -> pd.DataFrame:
        """By candidate: options; bias, rmse in all, by table, after one shift [deg]; Spearman likewise."""
        rows: dict[str, dict[str, Any]] = {}
        for number, candidate in enumerate(self.candidates):
            every = self.agreement(number)
            shifted = self.misfits.of(DESIGNS, self.misfits.shift(DESIGNS))[number]
            rows[candidate.name] = {
                **candidate.options,
                "bias": every.bias.value,
                "rmse": _root(self.misfits.of(DESIGNS)[number]),
                **{f"rmse_{stage}": _root(self.misfits.of([stage])[number]) for stage in DESIGNS},
                "rmse_shifted": _root(shifted),
                "spearman": every.spearman.value,
                **{f"spearman_{s}": self.agreement(number, [s]).spearman.value for s in DESIGNS},
            }
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("candidate")

    @cached_property
    def left_out(self) -> pd.DataFrame:
        """By the tables that choose: the candidate, and how it does on those left out; with a shift, too.

        Columns: seen, unseen (tables), then of the choice with and without a shift (``shifted_``): chosen,
        its rmse on the tables seen and unseen [deg], Spearman on the unseen; ``written_`` of the study as
        written.
        """
        return pd.DataFrame([self._left_out(seen) for seen in SEEN])

    @cached_property
    def unseen(self) -> pd.DataFrame:
        """Root mean square [deg] over all runs, each predicted by the choice of the other two tables.

        A row for the study as written, the choice, and the choice with a shift: rmse and the ends of its 95 %
        interval (`drawn`).
        """
        names = {"written": "the study as written", "choice": "chosen by the other two tables"}
        names["shifted"] = "likewise, and shifted by what they lack"
        found, rows = self.misfits.unseen(self.as_written), []
        for key, title in names.items():
            low, high = np.quantile(self.drawn[key], [0.025, 0.975])
            rows.append({"what": title, "rmse": _root(found[key]), "low": _root(low), "high": _root(high)})
        return pd.DataFrame(rows)

    @cached_property
    def drawn(self) -> dict[str, FloatArray]:
        """Bootstrap over runs drawn within each table: by quantity, its values over `DRAWS` draws.

        ``written``, ``choice`` and ``shifted`` are the mean squares [deg2] of `unseen`; ``chosen`` is the
        number of the candidate that all three tables choose.
        """
        rng = np.random.default_rng(SEED)
        rows = []
        for _ in range(DRAWS):
            drawn = self.misfits.drawn(rng)
            rows.append(drawn.unseen(self.as_written) | {"chosen": float(np.argmin(drawn.of(DESIGNS)))})
        return {str(key): column.to_numpy() for key, column in pd.DataFrame(rows).items()}

    @cached_property
    def shares(self) -> pd.DataFrame:
        """By option of each axis: the share of draws whose chosen candidate has it."""
        chosen = pd.DataFrame([self.candidates[int(number)].options for number in self.drawn["chosen"]])
        rows = [
            {"axis": axis, "option": option.name, "title": option.title,
             "share": float((chosen[axis] == option.name).mean())}
            for axis in AXES
            for option in getattr(grid(), axis)
        ]  # fmt: skip
        return pd.DataFrame(rows)

    def _left_out(self, seen: tuple[str, ...]) -> dict[str, Any]:
        unseen = tuple(stage for stage in DESIGNS if stage not in seen)
        plain, shift = np.zeros(len(self.candidates)), self.misfits.shift(seen)
        row: dict[str, Any] = {"seen": seen, "unseen": unseen}
        best = int(np.argmin(self.misfits.of(seen)))
        shifted = int(np.argmin(self.misfits.of(seen, shift)))
        for prefix, number, moved in (
            ("written_", self.as_written, plain),
            ("", best, plain),
            ("shifted_", shifted, shift),
        ):
            row |= {
                f"{prefix}chosen": self.candidates[number].name,
                f"{prefix}shift": float(moved[number]),
                f"{prefix}rmse_seen": _root(self.misfits.of(seen, moved)[number]),
                f"{prefix}rmse_unseen": _root(self.misfits.of(unseen, moved)[number]),
                f"{prefix}spearman_unseen": self.agreement(number, unseen).spearman.value,
            }
        return row


def written() -> Candidate:
    """Return the study as written: the first option of every axis."""
    first = grid()
    return Candidate(Base(first.law[0], first.clump[0], first.plate[0]), first.estimator[0].name)


def _root(square: float) -> float:
    """Square root; 0 where the noise taken out was more than what there was."""
    return float(np.sqrt(max(square, 0.0)))
