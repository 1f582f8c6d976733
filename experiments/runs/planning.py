"""A choice of the next tests in a folder: surfaces of all candidates, and the tests worth doing."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path

import numpy as np
import pandas as pd

from doe import Design, Factor, central_composite
from experiments.calibrate.cases import plan_cases
from experiments.calibrate.plan.choice import TestPlan, make_plan
from experiments.calibrate.plan.knowledge import Size
from experiments.calibrate.plan.present import Present, fit_responses, known_here, present_of
from experiments.cases.forecast.work import work_of
from experiments.io.errors import StudyError
from experiments.io.toml_files import read_toml
from experiments.report.material_card import CARD
from experiments.report.writer import write_plan
from experiments.runs.choices import Prepared, measured_study, prepare
from experiments.runs.request import RunRequest
from experiments.runs.run_folder import Run, open_run
from experiments.studyfile import Study, load_card
from experiments.studyfile.campaign import Response, near_readings, scenes_of
from experiments.studyfile.candidate_section import Candidate

CENTER, MOST_FACTORS = 5, 5
"""Replicates at the centre of the design, for the noise, and factors of one of at most 31 cases."""


ROUNDED = 1e-3
"""Relative difference that values of a card may have by its four digits."""


@dataclass(frozen=True)
class PreparedPlan:
    """A choice of tests that can begin."""

    run: Prepared
    present: Present | None
    """Knowledge of a finished campaign; None: the surfaces of the study's targets are simulated too."""
    design: Design
    responses: tuple[Response, ...]
    """Numbers whose surfaces are simulated, all over the one design."""

    @property
    def tables(self) -> dict[str, pd.DataFrame]:
        """Cases of each scene, by the title of their batch."""
        return {
            f"test {scene}": plan_cases(
                self.run.study,
                "surface",
                self.design.natural,
                1,
                [r for r in self.responses if r.scene == scene],
            )
            for scene in scenes_of(self.responses)
        }


def prepare_plan(study: Study | str | Path, request: RunRequest, after: Path | None = None) -> PreparedPlan:
    """Read a study, and the finished campaign (its folder or card) that a plan is made after.

    Raise InputError when the study has no candidates or too many factors, or the campaign has no card.
    """
    run = prepare(study, request, _with_targets, what="plan")
    targets, present, known, factors = _targets(run.study), None, set[tuple[str, str]](), _factors(run.study)
    if after is not None:
        card = after / CARD if after.is_dir() else after
        present, targets = present_of(read_toml(card)[1], card), ()
        _require_grain_of(card, run.study)
        known, factors = set(present.known), present.box(run.study.limits)
    if not 1 <= len(factors) <= MOST_FACTORS:
        hint = "Set [campaign.selection] keep, or name a finished campaign: --after FOLDER."
        raise StudyError(f"{run.study.file}: factor", f"a plan needs 1 to {MOST_FACTORS}", len(factors), hint)
    read = (one.response for each in run.study.candidates if each.scene for one in each.readings)
    wanted = {(one.scene, one.observable): one for one in (*read, *targets)}
    responses = tuple(one for key, one in wanted.items() if key not in known)
    return PreparedPlan(run, present, central_composite(factors, "face", CENTER), responses)


def _require_grain_of(card: Path, study: Study) -> None:
    """Refuse the card of a campaign with another grain, or with factors that the study lacks."""
    chosen = {name: facts["chosen"] for name, facts in read_toml(card)[1].get("factor", {}).items()}
    theirs, own = (
        (
            one.sphere_count,
            one.smallest_sphere,
            one.material.density * one.size_mean**3 * one.mean(attrgetter("volume")),
        )
        for one in (load_card(card).case({}, 0).grains, study.case(chosen, 0).grains)
    )
    if not np.allclose(own, theirs, rtol=ROUNDED, atol=0.0):
        problem = "is of a grain with another shape, size or density than the study's"
        raise StudyError(str(card), problem, hint="Name a campaign of this grain, or plan without --after.")


def run_plan(prepared: PreparedPlan) -> TestPlan:
    """Simulate the surfaces of all candidates, choose the tests, and write the page."""
    with open_run("plan", prepared.run) as run:
        cases = [run.run_cases(table, title) for title, table in prepared.tables.items()]
        plan = _plan(prepared, pd.concat([pd.DataFrame(), *cases], ignore_index=True), run)
        with run.publishing() as drafts:
            write_plan(plan, run.study, drafts, run.provenance)
    return plan


def _plan(prepared: PreparedPlan, cases: pd.DataFrame, run: Run) -> TestPlan:
    study, design, present = run.study, prepared.design, prepared.present
    surfaces, unjudged = fit_responses(design, cases, prepared.responses, study.campaign.surface)
    if present is None:
        known = known_here(surfaces, _targets(study), study.direct, design)
        present = Present.of(design.factors, known)
    times: Counter[str] = Counter()
    for row in run.wall_times:
        times[row["stage"]] += row["seconds"]
    sizes = {
        each.name: tuple(_sizes(study, each, times[f"test {each.scene}"] or np.nan))
        for each in study.candidates
    }
    return make_plan(present, surfaces, unjudged, study.candidates, sizes, study.campaign.optimum)


def _with_targets(study: Study) -> Study:
    """Refuse a study without candidates; take its targets, if it has some, from their measurements."""
    if not study.candidates:
        raise StudyError(str(study.file), "needs a [[candidate]]: a test that could be done")
    return measured_study(study) if study.target_section or study.response_sections else study


def _targets(study: Study) -> tuple[Response, ...]:
    """Return the measured responses that have a column of their own."""
    fitted = study.target.fitted if study.target_section or study.response_sections else ()
    return tuple(one for one in fitted if one.measured and not one.weights)


def _factors(study: Study) -> tuple[Factor, ...]:
    """Return the factors that are kept, or all, as near to their direct readings as errors allow."""
    names = study.campaign.selection.keep or study.labels
    return near_readings([one for one in study.factors if one.name in names], study.direct)


def _sizes(study: Study, candidate: Candidate, seconds: float) -> Iterable[Size]:
    """Yield the sizes of a candidate's test, that of the scene as written first."""
    if not candidate.scene:
        yield Size(seconds=0.0)
        return
    first = None
    for words, scene in (("", study.scenes[candidate.scene]), *candidate.sizes):
        try:
            work = work_of(study.model_copy(update={"scene": scene}).build_case(0))
        except ValueError as error:
            raise StudyError(f"{study.file}: candidate {candidate.name}", f"size {words}: {error}") from None
        first = first or work
        grown, longer = (
            work.grains / first.grains,
            work.steps * work.time_step / (first.steps * first.time_step),
        )
        longest, total = max(grown, longer), work.spheres * work.steps
        yield Size(words, longest, work.grains, total, seconds * grown * longer)
