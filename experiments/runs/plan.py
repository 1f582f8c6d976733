"""The plan of a command before it runs: cases, grains, steps, time, memory and disk."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from dem_warp import Case
from doe import central_composite
from doe.discrepancy import bank_points
from experiments.calibrate.fidelity_stage import further_runs
from experiments.calibrate.screening_stage import screening_design
from experiments.calibrate.stages import plan_ahead, plan_opening
from experiments.cases import Resources
from experiments.cases.forecast.speed import UNKNOWN, forecast, source_of
from experiments.cases.forecast.work import rest_of, work_of
from experiments.cases.store.outcome_table import OutcomeTable
from experiments.discover.engine_simulator import EngineSimulator
from experiments.discover.fresh_cases import cases_for
from experiments.discover.search import Search
from experiments.io.errors import StudyError
from experiments.runs.choices import Prepared, with_pictures
from experiments.runs.search import SearchData, known_bank, read_data
from experiments.studyfile import Study, cheaper_study
from experiments.studyfile.campaign import TARGET_SCENE, scenes_of

SAMPLE = 64
"""Cases of a batch whose sizes are predicted."""

OUTCOME_BYTES, CASE_BYTES, GRAIN_BYTES, PAGE_BYTES = 500, 3e3, 90, 5e6
"""Disk of a measured outcome, of a stored case and each grain, and of all pages."""

_Stage: TypeAlias = tuple[str, Sequence[Case], int, int]
"""Name of a batch, some of its cases, how many are expected, and the most there can be."""


@dataclass(frozen=True)
class PlannedBatch:
    """Cases that run together; grains, spheres and steps are means over them."""

    name: str
    cases: int
    most: int
    grains: int
    spheres: int
    steps: int
    seconds: float | None
    """Expected wall time [s]; None where it is unknown."""
    noted: tuple[int, ...]
    """Numbers of the noted batches that the time comes from."""
    phases: Mapping[str, int] = field(default_factory=dict)
    """Steps of each phase where the cases have the same ones, means over them."""


@dataclass(frozen=True)
class Plan:
    """A command's batches on some workers, and then its rest; memory (of each GPU) and disk in bytes."""

    study: str
    where: str
    batches: tuple[PlannedBatch, ...]
    memory: float
    disk: float
    on_gpu: bool
    doubts: tuple[str, ...] = ()
    """Unlikely values of the study."""
    shares: Mapping[str, float] = field(default_factory=dict)
    """Share of each scene in the work of one setting of a campaign."""

    @property
    def totals(self) -> dict[str, Any]:
        """Expected cases, the most cases, the expected wall time [s] or None, and where it comes from."""
        seconds = [batch.seconds for batch in self.batches]
        known = None if None in seconds[:-1] or not any(seconds) else sum(each or 0.0 for each in seconds)
        cases, most = (sum(getattr(batch, name) for batch in self.batches) for name in ("cases", "most"))
        source = source_of({number for batch in self.batches[:-1] for number in batch.noted})
        if known is None:
            source = UNKNOWN
        elif seconds[-1] is None:
            source += ", without start and report"
        return {"cases": cases, "most": most, "seconds": known, "source": source}

    def to_dict(self) -> dict[str, Any]:
        """Return everything as JSON-able data: seconds and bytes."""
        return asdict(self) | self.totals


def plan_calibration(prepared: Prepared) -> Plan:
    """Plan a calibration; pictures of its target are measured."""
    study = with_pictures(prepared).study
    stages = _campaign_stages(study)
    grains = max(work_of(case).grains for _, some, *_ in stages for case in some)
    plan = _plan("calibrate", prepared, stages, CASE_BYTES + GRAIN_BYTES * grains)
    cases = {scene: work_of(study.case({}, 1, scene)) for scene in scenes_of(study.target.responses)}
    work = {scene: one.spheres * one.steps for scene, one in cases.items()}
    return replace(plan, shares={scene: one / sum(work.values()) for scene, one in work.items()})


def _campaign_stages(study: Study) -> list[_Stage]:
    """Return the stages, with the usual number of kept factors and steps of the climb."""
    settings, target, cheaper = study.campaign, study.target, cheaper_study(study)
    ahead = plan_ahead(study)
    opening = pd.concat([plan_opening(study, screening_design(study.factors, settings.screening)), *ahead])
    scenes = scenes_of(target.fitted)
    own, middle = ([one.case({}, 1, scene) for scene in scenes] for one in (study, cheaper))
    steps = settings.climb.steps * settings.climb_replicates
    kept = len(settings.selection.keep or ()) or min(settings.selection.at_most, len(study.factors))
    surface = _surface_cases(study, kept) * len(scenes)
    leading = study.case({}, 1, target.leading.scene)
    most = steps * (1 + settings.climb.extensions)
    fresh = settings.verification.replicates * len(scenes_of(target.responses))
    moving = further_runs(settings.fidelity, steps, kept) * len(scenes) if settings.fidelity else 0
    at_own = [("runs at this scale", own, moving, moving)] if moving else []
    first = "target, noise floor, screening" + (", surface" if ahead else "")
    stages: list[_Stage] = [(first, _sampled(cheaper, opening), len(opening), len(opening))]
    if ahead and not at_own:
        some = [leading] * steps + own * settings.verification.replicates
        return [*stages, ("climb, verification", some, steps + fresh, most + fresh)]
    stages.append(("climb", [leading], steps, most))
    if not ahead:
        stages.append(("surface", middle, surface, surface))
    return [*stages, *at_own, ("verification", own, fresh, fresh)]


def _surface_cases(study: Study, kept: int) -> int:
    settings = study.campaign.surface
    design = central_composite(study.factors[: max(kept, 1)], settings.alpha, settings.center_points)
    at_center = int((design.coded == 0.0).all(axis=1).sum())
    return (len(design.coded) - at_center) * settings.replicates + at_center


def plan_search(prepared: Prepared, given: SearchData) -> Plan:
    """Plan a search: its bank if there is none, and for measured heaps fresh runs, expected and at most."""
    study, search = prepared.study, Search.of(prepared.study)
    bank, measured = known_bank(search, prepared.folder, given.bank), read_data(study, given)
    simulator = EngineSimulator(study, search.library, OutcomeTable(Path("none.sqlite")))
    points, cases = bank_points(search.space, search.settings), []
    for i in np.linspace(0, len(points) - 1, min(SAMPLE, len(points))).astype(int):
        try:
            cases.append(simulator.case(points[i]))
        except StudyError:
            continue
    stages: list[_Stage] = [] if bank else [("bank", cases, len(points), len(points))]
    if measured is not None:
        stages.append(("fresh runs", cases, *cases_for(search, measured, bank, given.seed)))
    return _plan("bank" if measured is None else "discover", prepared, stages, OUTCOME_BYTES)


def plan_heap(prepared: Prepared, case: Case) -> Plan:
    """Plan one case."""
    return _plan("heap", prepared, [("heap", [case], 1, 1)], GRAIN_BYTES * work_of(case).grains)


def plan_tests(prepared: Prepared, tables: Mapping[str, pd.DataFrame]) -> Plan:
    """Plan the cases of candidates, by the titles of their batches."""
    study = prepared.study
    stages = [(name, _sampled(study, table), len(table), len(table)) for name, table in tables.items()]
    grains = max((work_of(case).grains for _, some, *_ in stages for case in some), default=0)
    return _plan("plan", prepared, stages, CASE_BYTES + GRAIN_BYTES * grains)


def _sampled(study: Study, table: pd.DataFrame) -> list[Case]:
    cases = []
    for row in table.sample(min(SAMPLE, len(table)), random_state=0).to_dict("records"):
        values = {factor.name: float(row[factor.name]) for factor in study.factors}
        cases.append(study.case(values, int(row["seed"]), row.get("scene", TARGET_SCENE)))
    return cases


def _plan(command: str, prepared: Prepared, stages: Sequence[_Stage], stored: float) -> Plan:
    study, resources = prepared.study, prepared.resources
    rest = PlannedBatch("start, report", 0, 0, 0, 0, 0, *forecast([rest_of(command)], resources))
    try:
        batches = (*(_batch(*stage, resources) for stage in stages), rest)
        if study.engine and study.engine.by:  # nobody knows how long a person takes
            batches = tuple(replace(batch, seconds=None) for batch in batches)
        cases = [case for _, some, *_ in stages for case in some]
        memory = resources.memory(cases, max((stage[3] for stage in stages), default=0))
    except ValueError as error:  # the reason why a case cannot begin
        raise StudyError(str(study.file), str(error), study.scale or "this study") from error
    disk = PAGE_BYTES + stored * sum(batch.most for batch in batches)
    return Plan(study.name, str(resources), batches, memory, disk, resources.on_gpu, study.doubts())


def _batch(name: str, some: Sequence[Case], count: int, most: int, resources: Resources) -> PlannedBatch:
    works = [work_of(case) for case in some]
    grains, spheres, steps = np.mean([(work.grains, work.spheres, work.steps) for work in works], axis=0)
    repeated = [works[i % len(works)] for i in range(count)]
    time = forecast(repeated, resources) if count else (0.0, ())
    names = {tuple(work.phases) for work in works}
    phases = min(names) if len(names) == 1 else ()
    means = {phase: round(np.mean([work.phases[phase] for work in works])) for phase in phases}
    return PlannedBatch(name, count, most, round(grains), round(spheres), round(steps), *time, means)
