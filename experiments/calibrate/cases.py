"""Tables of cases: what a stage wants simulated, and what came back."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from experiments.calibrate.results import STAGES, Outcome, failed
from experiments.studyfile.campaign import TARGET_SCENE, Response

if TYPE_CHECKING:
    from doe import Factor

Runner = Callable[[pd.DataFrame], pd.DataFrame]
"""Simulates all rows of a table at once and returns them in order, ``status`` and observables added."""


class StageEnd(Exception):  # noqa: N818  (an ending that is foreseen, not an error)
    """End of a campaign, for a reason that its report states.

    Parameters
    ----------
    outcome, reason
        How the campaign ended and, as a sentence, why and what to change.
    """

    def __init__(self, outcome: Outcome, reason: str) -> None:
        super().__init__(reason)
        self.outcome = outcome
        self.reason = reason


def case_seed(root: int, stage: str, run: int, replicate: int, scene: str = TARGET_SCENE) -> int:
    """Derive the seed of one case; it depends on nothing but these five.

    So a further run, replicate or scene leaves every other case as it was. 31 bits: any generator takes it.
    """
    unsigned_run = (
        2 * run if run >= 0 else -2 * run - 1
    )  # a climb that is extended downward counts below zero
    other_scene = () if scene == TARGET_SCENE else tuple(scene.encode())
    key = (STAGES.index(stage), unsigned_run, replicate, *other_scene)
    sequence = np.random.SeedSequence(root, spawn_key=key)
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
    scenes: Sequence[str] = (TARGET_SCENE,),
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
    scenes
        Names of the scenes that every case is simulated in.

    Returns
    -------
    DataFrame
        Columns: stage, scene, run, replicate, every factor (natural unit), seed.
    """
    rows = []
    labelled = zip(points.index.tolist(), points.to_dict("records"), strict=True)
    for scene, (run, point) in itertools.product(scenes, labelled):
        count = replicates if isinstance(replicates, int) else replicates[run]
        settings = middle(factors, {str(name): value for name, value in point.items()})
        for replicate in range(1, count + 1):
            label = {"stage": stage, "scene": scene, "run": run, "replicate": replicate}
            rows.append(label | settings | {"seed": case_seed(seed, stage, run, replicate, scene)})
    return pd.DataFrame(rows)


def simulate(runner: Runner, *plans: pd.DataFrame) -> list[pd.DataFrame]:
    """Simulate several plans in one batch; return the finished table of each."""
    finished = runner(pd.concat(plans, ignore_index=True))
    ends = np.cumsum([len(plan) for plan in plans])
    return [
        finished.iloc[end - len(plan) : end].reset_index(drop=True)
        for plan, end in zip(plans, ends, strict=True)
    ]


def measured(cases: pd.DataFrame, response: Response) -> pd.DataFrame:
    """Return the cases that gave a response."""
    if response.observable not in cases.columns:  # where every case failed before it could be measured
        return cases.iloc[:0].assign(**{response.observable: np.nan})
    found = (cases["scene"] == response.scene) & (cases["status"] == "finished")
    return cases[found & cases[response.observable].notna()].reset_index(drop=True)


def values_of(cases: pd.DataFrame, stage: str, response: Response, least: int = 2) -> np.ndarray:
    """Return a response of replicated cases.

    Raises
    ------
    StageEnd
        When fewer than ``least`` cases gave it.
    """
    values = measured(cases, response)[response.observable].to_numpy(dtype=np.float64)
    if len(values) < least:
        raise too_many_failed(cases, stage, f"needs at least {least} measured cases", response)
    return values


def response_table(cases: pd.DataFrame, response: Response, runs: Sequence[int]) -> np.ndarray:
    """Return a response by run and replicate, shape (runs, replicates); NaN where there is none."""
    values = measured(cases, response).pivot_table(
        index="run", columns="replicate", values=response.observable
    )
    columns = range(1, int(cases["replicate"].max()) + 1)
    return values.reindex(index=list(runs), columns=columns).to_numpy(dtype=np.float64)


def failure_summary(cases: pd.DataFrame, *responses: Response) -> str:
    """Say how many cases failed or lack a response, and of what; empty when none did."""
    lost = failed(cases, responses)
    if lost.empty:
        return ""
    names = ", ".join(response.name for response in responses)
    # A finished case without its response had nothing to measure, no heap for one.
    kinds = lost["status"].replace("finished", f"without {names}").value_counts()
    counts = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
    return f"{len(lost)} of {len(cases)} cases failed ({counts})"


def too_many_failed(cases: pd.DataFrame, stage: str, need: str, response: Response) -> StageEnd:
    """Return the end of a campaign whose stage cannot be analysed."""
    own = cases[cases["scene"] == response.scene]
    failures = failure_summary(own, response) or "no case failed"
    reason = (
        f"The stage {stage.replace('_', ' ')} {need} for {response.name}; {failures}. See the reasons in the "
        "table of cases, then widen the time limit or narrow the factors' ranges."
    )
    return StageEnd(Outcome.TOO_MANY_FAILED_RUNS, reason)
