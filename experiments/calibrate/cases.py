"""Tables of cases: what a stage wants simulated, and what came back."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from experiments.calibrate.results import STAGES, Outcome, failed
from experiments.io.errors import shortened
from experiments.studyfile.campaign import TARGET_SCENE, Response, scenes_of

if TYPE_CHECKING:
    from doe import Factor
    from experiments.studyfile import Study

LONGEST_REASON = 300
"""Characters of a case's reason that the end of a campaign shows."""

Runner = Callable[[pd.DataFrame], pd.DataFrame]
"""Simulates all rows of a table at once and returns them in order, ``status`` and observables added."""


class StageEnd(Exception):  # noqa: N818  (an ending that is foreseen, not an error)
    """End of a campaign, its reason a sentence for the report: why, and what to change."""

    def __init__(self, outcome: Outcome, reason: str) -> None:
        super().__init__(reason)
        self.outcome = outcome
        self.reason = reason


def case_seed(root: int, stage: str, run: int, replicate: int, scene: str = TARGET_SCENE) -> int:
    """Derive the seed of one case; it depends on nothing but these five.

    So a further run, replicate or scene leaves every other case as it was. 31 bits: any generator takes it.
    """
    # A climb that is extended downward counts below zero.
    unsigned_run = 2 * run if run >= 0 else -2 * run - 1
    other_scene = () if scene == TARGET_SCENE else tuple(scene.encode())
    key = (STAGES.index(stage), unsigned_run, replicate, *other_scene)
    return int(np.random.SeedSequence(root, spawn_key=key).generate_state(1, np.uint32)[0] >> 1)


def middle(factors: Sequence[Factor], settings: Mapping[str, float] | None = None) -> dict[str, float]:
    """Return a value for every factor: the setting, or the middle of its range."""
    given = settings or {}
    return {factor.name: float(given.get(factor.name, factor.center)) for factor in factors}


def plan_cases(
    study: Study,
    stage: str,
    points: pd.DataFrame,
    replicates: int | Mapping[int, int],
    responses: Iterable[Response],
) -> pd.DataFrame:
    """Lay out the cases of a stage, one row each, in every scene that measures one of the responses.

    Parameters
    ----------
    points
        One row a run, its label in the index; columns: the factors that the stage varies, natural units.
    replicates
        Cases of each run, or of each run by its label.

    Returns
    -------
    DataFrame
        Columns: stage, scene, run, replicate, every factor (natural unit), seed.
    """
    seeds, rows = study.campaign.seeds, []
    root = seeds.target if stage == "target" else seeds.campaign
    labelled = zip(points.index.tolist(), points.to_dict("records"), strict=True)
    for scene, (run, point) in itertools.product(scenes_of(responses), labelled):
        count = replicates if isinstance(replicates, int) else replicates[run]
        settings = middle(study.factors, {str(name): value for name, value in point.items()})
        for replicate in range(1, count + 1):
            label = {"stage": stage, "scene": scene, "run": run, "replicate": replicate}
            rows.append(label | settings | {"seed": case_seed(root, stage, run, replicate, scene)})
    return pd.DataFrame(rows)


def with_combinations(cases: pd.DataFrame, responses: Iterable[Response]) -> pd.DataFrame:
    """Add the columns of responses that are weighted sums of observables."""
    combined = {
        response.observable: sum(
            weight * cases.get(name, pd.Series(np.nan, cases.index)) for name, weight in response.weights
        )
        for response in responses
        if response.weights
    }
    return cases.assign(**combined)


def measured(cases: pd.DataFrame, response: Response) -> pd.DataFrame:
    """Return the cases that gave a response."""
    if response.observable not in cases.columns:  # where every case failed before it could be measured
        return cases.iloc[:0].assign(**{response.observable: np.nan})
    found = (cases["scene"] == response.scene) & (cases["status"] == "finished")
    return cases[found & cases[response.observable].notna()].reset_index(drop=True)


def values_of(cases: pd.DataFrame, stage: str, response: Response, least: int = 2) -> np.ndarray:
    """Return a response of replicated cases; StageEnd where fewer than ``least`` gave it."""
    values = measured(cases, response)[response.observable].to_numpy(dtype=np.float64)
    if len(values) < least:
        raise too_many_failed(cases, stage, f"needs at least {least} measured cases", response)
    return values


def response_table(cases: pd.DataFrame, response: Response, runs: Sequence[int]) -> np.ndarray:
    """Return a response by run and replicate, shape (runs, replicates); NaN where there is no value."""
    values = measured(cases, response).pivot_table(response.observable, "run", "replicate")
    columns = range(1, int(cases["replicate"].max()) + 1)
    return values.reindex(index=list(runs), columns=columns).to_numpy(dtype=np.float64)


def failure_summary(cases: pd.DataFrame, *responses: Response) -> str:
    """Say how many cases of the responses' scenes failed or lack one, and of what; empty when none did."""
    cases = cases[cases["scene"].isin(scenes_of(responses))]
    lost = failed(cases, responses)
    if lost.empty:
        return ""
    names = ", ".join(response.name for response in responses)
    # A finished case without its response had nothing to measure, no heap for one.
    kinds = lost["status"].replace("finished", f"without {names}").value_counts()
    counts = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
    return f"{len(lost)} of {len(cases)} cases failed ({counts})"


def _commonest_reason(cases: pd.DataFrame, response: Response) -> tuple[str, int]:
    """Reason that most cases without a response have, and their number; numbers in a reason are set aside."""
    cases = cases[cases["scene"] == response.scene]
    lost = failed(cases, [response])
    reasons = lost["reason"][lost["reason"].fillna("") != ""] if "reason" in lost else pd.Series(dtype=str)
    if reasons.empty:
        return "", 0
    kinds = reasons.str.replace(r"\d[\d.,]*", "#", regex=True)
    [kind, *_] = kinds.mode()
    same = reasons[kinds == kind]
    return str(same.iloc[0]), len(same)


def too_many_failed(cases: pd.DataFrame, stage: str, need: str, response: Response) -> StageEnd:
    """Return the end of a campaign whose stage cannot be analysed."""
    failures = failure_summary(cases, response) or "no case failed"
    reason = f"The stage {stage.replace('_', ' ')} {need} for {response.name}; {failures}."
    shared, count = _commonest_reason(cases, response)
    if shared:
        reason += f" The reason of {count} of them: {shortened(shared, LONGEST_REASON).rstrip('.')}."
    if not shared or "time limit" in shared:
        reason += (
            " See the reasons in the case table, then widen the time limit or narrow the factors' ranges."
        )
    else:
        # where every case fails alike, other ranges do not help
        way = "" if count == (cases["scene"] == response.scene).sum() else ", or narrow the factors' ranges"
        reason += f" Fix this{way}; the case table lists every reason."
    return StageEnd(Outcome.TOO_MANY_FAILED_RUNS, reason)
