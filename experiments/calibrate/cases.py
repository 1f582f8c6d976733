"""Tables of cases: what a stage wants simulated, and what came back."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from experiments.calibrate.results import STAGES, Outcome

if TYPE_CHECKING:
    from doe import Factor

Runner = Callable[[pd.DataFrame], pd.DataFrame]
"""Simulates all rows of a table at once and returns them in order, ``status`` and ``angle`` [deg] added."""


class StageEnd(Exception):  # noqa: N818  (an ending that is foreseen, not an error)
    """A campaign ends here, for a reason that its report states.

    Parameters
    ----------
    outcome, reason
        How the campaign ended and, as a sentence, why and what to change.
    """

    def __init__(self, outcome: Outcome, reason: str) -> None:
        super().__init__(reason)
        self.outcome = outcome
        self.reason = reason


def case_seed(root: int, stage: str, run: int, replicate: int) -> int:
    """Derive the seed of one case; it depends on nothing but these four.

    So a further run or replicate leaves every other case as it was. 31 bits: any generator takes it.
    """
    unsigned_run = (
        2 * run if run >= 0 else -2 * run - 1
    )  # a climb that is extended downward counts below zero
    sequence = np.random.SeedSequence(root, spawn_key=(STAGES.index(stage), unsigned_run, replicate))
    return int(sequence.generate_state(1, np.uint32)[0] >> 1)


def middle(factors: Sequence[Factor], settings: Mapping[str, float] | None = None) -> dict[str, float]:
    """Return a value for every factor: the setting, or the middle of its range."""
    given = settings or {}
    return {factor.name: float(given.get(factor.name, factor.center)) for factor in factors}


def plan_cases(
    factors: Sequence[Factor],
    stage: str,
    points: pd.DataFrame,
    replicates: int | Mapping[int, int],
    seed: int,
) -> pd.DataFrame:
    """Lay out the cases of a stage, one row each.

    Parameters
    ----------
    factors
        All factors of the study.
    stage
        One of ``STAGES``.
    points
        One row a run, its label in the index; columns: the factors that the stage varies, natural units.
    replicates
        Cases of each run, or of each run by its label.
    seed
        Root of the seeds.

    Returns
    -------
    DataFrame
        Columns: stage, run, replicate, every factor (natural unit), seed.
    """
    rows = []
    for run, point in zip(points.index.tolist(), points.to_dict("records"), strict=True):
        count = replicates if isinstance(replicates, int) else replicates[run]
        settings = middle(factors, {str(name): value for name, value in point.items()})
        for replicate in range(1, count + 1):
            label = {"stage": stage, "run": run, "replicate": replicate}
            rows.append(label | settings | {"seed": case_seed(seed, stage, run, replicate)})
    return pd.DataFrame(rows)


def simulate(runner: Runner, *plans: pd.DataFrame) -> list[pd.DataFrame]:
    """Simulate several plans in one batch; return the finished table of each."""
    finished = runner(pd.concat(plans, ignore_index=True))
    ends = np.cumsum([len(plan) for plan in plans])
    return [
        finished.iloc[end - len(plan) : end].reset_index(drop=True)
        for plan, end in zip(plans, ends, strict=True)
    ]


def measured(cases: pd.DataFrame) -> pd.DataFrame:
    """Return the cases that gave an angle."""
    return cases[(cases["status"] == "finished") & cases["angle"].notna()]


def angles_of(cases: pd.DataFrame, stage: str, least: int = 2) -> np.ndarray:
    """Return the angles [deg] of replicated cases.

    Raises
    ------
    StageEnd
        When fewer than ``least`` cases gave one.
    """
    angles = measured(cases)["angle"].to_numpy(dtype=np.float64)
    if len(angles) < least:
        raise too_many_failed(cases, stage, f"needs at least {least} measured cases")
    return angles


def response_table(cases: pd.DataFrame, runs: Sequence[int]) -> np.ndarray:
    """Return angles [deg] by run and replicate, shape (runs, replicates); NaN where there is none."""
    angles = measured(cases).pivot_table(index="run", columns="replicate", values="angle")
    columns = range(1, int(cases["replicate"].max()) + 1)
    return angles.reindex(index=list(runs), columns=columns).to_numpy(dtype=np.float64)


def failure_summary(cases: pd.DataFrame) -> str:
    """Say how many cases failed, and of what; empty when none did."""
    failed = cases.drop(measured(cases).index)
    if failed.empty:
        return ""
    # A finished case without an angle had no heap to measure.
    kinds = failed["status"].replace("finished", "no measurable heap").value_counts()
    listed = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
    return f"{len(failed)} of {len(cases)} cases failed ({listed})"


def too_many_failed(cases: pd.DataFrame, stage: str, need: str) -> StageEnd:
    """Return the end of a campaign whose stage cannot be analysed."""
    failures = failure_summary(cases) or "no case failed"
    reason = (
        f"The stage {stage.replace('_', ' ')} {need}; {failures}. See the reasons in the table of cases, "
        "then widen the time limit or narrow the factors' ranges."
    )
    return StageEnd(Outcome.TOO_MANY_FAILED_RUNS, reason)
