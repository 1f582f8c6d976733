"""A cheaper scale for the design of a campaign, and what a budget of time leaves for the own scale."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

from experiments.cases.forecast.work import work_of
from experiments.cases.store.folder import is_used
from experiments.io.errors import InputError
from experiments.io.time_left import duration
from experiments.io.units import Quantity
from experiments.runs.plan import plan_calibration
from experiments.studyfile import Study, cheaper_study, study_scales
from experiments.studyfile.campaign import FidelitySettings
from experiments.studyfile.manifest import read_manifest

if TYPE_CHECKING:
    from experiments.runs.choices import Prepared

LEAST_RUNS, MOST_RUNS = 8, 40
"""Runs at the study's own scale that a budget may leave."""

WORTH = 0.25
"""Largest cost of a case at the cheaper scale, of one at the study's own, where no speed is known."""


def with_budget(prepared: Prepared, budget: str) -> Prepared:
    """Choose the cheaper scale and the runs at the study's own one, so that a campaign takes no longer.

    A run that is resumed keeps what was chosen for it. Else it is the dearest scale that leaves the usual
    number of runs, or else the one that leaves most. Where no speed of this machine is known, it is the
    dearest whose cases cost at most a quarter, with the usual number.

    Raise InputError when the budget is no time, or too short for every scale.
    """
    seconds = _time(budget)
    if prepared.request.resume and is_used(prepared.folder):
        kept = read_manifest(prepared.folder)["study"].get("campaign", {}).get("fidelity")
        return prepared if kept is None else replace(prepared, study=prepared.study.with_fidelity(kept))
    usual = FidelitySettings(scale="").runs
    candidates = _cheaper_scales(prepared.study)
    if not candidates:
        raise InputError("--budget", "needs a cheaper [scale.NAME] of the study", prepared.study.scale or "")
    known = {name: _seconds(_with_runs(prepared, name, LEAST_RUNS)) for name in candidates}
    if None in known.values():
        return _with_runs(prepared, _first(candidates, lambda name: candidates[name] <= WORTH), usual)
    counts = range(LEAST_RUNS, MOST_RUNS + 1)
    left = {
        name: bisect_right(
            counts, seconds, key=lambda runs: _seconds(_with_runs(prepared, name, runs)) or 0.0
        )
        for name in candidates
    }
    most = max(left.values())
    if most == 0:
        least = duration(min(each for each in known.values() if each is not None))
        raise InputError("--budget", f"must be at least {least} on these workers, by what they took", budget)
    scale = _first(left, lambda name: left[name] > usual - LEAST_RUNS or left[name] == most)
    return _with_runs(prepared, scale, counts[left[scale] - 1])


def _time(budget: str) -> float:
    try:
        seconds = Quantity.parse(budget).to_base("time")
    except ValueError as error:
        raise InputError(
            "--budget", f"must be a time with its unit, such as 30 min: {error}", budget
        ) from None
    if not (math.isfinite(seconds) and seconds > 0.0):
        raise InputError("--budget", "must be longer than 0 s", budget)
    return seconds


def _first(names: Iterable[str], fits: Callable[[str], bool]) -> str:
    *before, last = names
    return next((name for name in before if fits(name)), last)


def _cheaper_scales(study: Study) -> dict[str, float]:
    """Return the scales whose cases cost less than the study's own, the dearest first, and that share."""

    def size(one: Study) -> float:
        work = work_of(one.case({}, 1))
        return work.spheres * work.steps

    named = study.campaign.fidelity
    scales = [named.scale] if named else [name for name in study_scales(study.file) if name != study.scale]
    costs = {name: size(cheaper_study(study, name)) / size(study) for name in scales}
    return {name: cost for name, cost in sorted(costs.items(), key=lambda item: -item[1]) if cost < 1.0}


def _with_runs(prepared: Prepared, scale: str, runs: int) -> Prepared:
    own = prepared.study.document.get("campaign", {}).get("fidelity", {})
    return replace(prepared, study=prepared.study.with_fidelity({**own, "scale": scale, "runs": runs}))


def _seconds(prepared: Prepared) -> float | None:
    """Return the wall time that is expected of a campaign [s]; None where it is unknown."""
    *batches, rest = (batch.seconds for batch in plan_calibration(prepared).batches)
    known = [each for each in batches if each is not None]
    return sum(known) + (rest or 0.0) if len(known) == len(batches) else None
