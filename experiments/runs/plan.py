"""The plan of a command before it runs: cases, grains, steps, time, memory, disk; nothing is written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from dem_warp import Case
from doe import central_composite
from doe.discrepancy import bank_points
from experiments.calibrate.screening_stage import screening_design
from experiments.calibrate.stages import plan_opening
from experiments.cases import Resources, open_workers
from experiments.cases.forecast.cost import Cost, cost_of, device_bytes
from experiments.cases.store.outcome_table import OutcomeTable
from experiments.cases.workers.batches import rounds_of
from experiments.cases.workers.speed import Speed, measure_speed, store_speed, stored_speed, wave_seconds
from experiments.discover.engine_simulator import EngineSimulator
from experiments.discover.search import Search
from experiments.io.errors import InputError, StudyError
from experiments.report.study_companion import companion_of
from experiments.studyfile import Study
from experiments.studyfile.campaign import TARGET_SCENE, scenes_of

SAMPLE = 64
"""Cases of a wave whose sizes are looked at."""

PROCESS_BYTES = 450e6
"""Memory of a process that simulates or measures, libraries included [bytes]."""

OUTCOME_BYTES = 500
"""Bytes of a row of measured outcomes."""

_Wave: TypeAlias = tuple[str, Sequence[Case], int, int]
"""Name of a wave, some of its cases, how many are expected, and how many there are at the most."""


@dataclass(frozen=True)
class PlannedWave:
    """Cases that run together."""

    name: str
    """Name of the stages."""
    cases: int
    """Cases that are expected."""
    most: int
    """Cases at the most."""
    grains: int
    """Grains of a case, the mean."""
    spheres: int
    """Their spheres."""
    steps: int
    """Steps of a case, the mean."""
    seconds: float
    """Wall time expected [s]."""
    seconds_most: float
    """Wall time of the most cases [s]."""


@dataclass(frozen=True)
class Plan:
    """A command's waves on some workers."""

    study: str
    where: str
    workers: int
    speed: Speed
    waves: tuple[PlannedWave, ...]
    memory: float
    """Memory of this machine, or of each GPU, that is taken at once [bytes]."""
    disk: float
    """Size of the stored cases and pages [bytes]."""
    on_gpu: bool

    @property
    def cases(self) -> int:
        """Cases that are expected."""
        return sum(wave.cases for wave in self.waves)

    @property
    def most(self) -> int:
        """Cases at the most."""
        return sum(wave.most for wave in self.waves)

    @property
    def seconds(self) -> float:
        """Wall time expected [s]."""
        return sum(wave.seconds for wave in self.waves)

    @property
    def seconds_most(self) -> float:
        """Wall time of the most cases [s]."""
        return sum(wave.seconds_most for wave in self.waves)

    def to_dict(self) -> dict[str, Any]:
        """Everything as JSON-able data: seconds and bytes."""
        totals = {"cases": self.cases, "most": self.most, "seconds": self.seconds}
        return asdict(self) | totals | {"seconds_most": self.seconds_most}


def measured_speed(resources: Resources, measure: bool = True) -> Speed:
    """Speed of some workers: as stored, or measured now and stored for the next time.

    Raises
    ------
    InputError
        When it was never measured and must not be: jobs are not submitted for a plan.
    """
    if speed := stored_speed(resources.machine):
        return speed
    if not measure:
        rule = "the speed of these workers must be measured before: dem-warp doctor --measure with the same"
        raise InputError(resources.machine, rule, "never measured")
    return measure_and_store(resources)


def measure_and_store(resources: Resources) -> Speed:
    """Measure the speed of workers, and store it for their user."""
    # those that share a GPU would tell the speed of a part of it
    with open_workers(replace(resources, gpu_workers=1)) as workers:
        speed = measure_speed(workers)
    store_speed(resources.machine, speed)
    return speed


def plan_calibration(
    study: Study, resources: Resources, speed: Speed, *, published_replicates: int = 0, campaign: bool = True
) -> Plan:
    """Plan a calibration; which factors are kept, and how far the climb goes, is taken as usual.

    The runs that were published for the study go before, with so many replicates.
    """
    published = companion_of(study).planned_runs(published_replicates) if published_replicates else {}
    waves: list[_Wave] = []
    for title, table in published.items():
        waves.append((title, _sampled(study, table), len(table), len(table)))
    if campaign:
        waves.extend(_campaign_waves(study))
    stored = 3000.0 + 90.0 * max(cost_of(case).grains for _, some, *_ in waves for case in some)
    return _plan(study, resources, speed, waves, stored)


def _campaign_waves(study: Study) -> list[_Wave]:
    """Waves of a campaign."""
    settings, target = study.campaign, study.target
    design = screening_design(study.factors, settings.screening)
    opening = plan_opening(study, design)
    scenes = scenes_of(target.fitted)
    middle = [_built(study, {}, 1, scene) for scene in scenes]
    leading = [_built(study, {}, 1, target.leading.scene)]
    steps = settings.climb.steps * settings.climb.replicates
    kept = len(settings.selection.keep or ()) or min(settings.selection.at_most, len(study.factors))
    surface = _surface_cases(study, kept) * len(scenes)
    fresh = settings.verification.replicates * len(scenes_of(target.responses))
    return [
        ("target, noise floor, screening", _sampled(study, opening), len(opening), len(opening)),
        ("climb", leading, steps, steps * (1 + settings.climb.extensions)),
        ("surface", middle, surface, surface),
        ("verification", middle, fresh, fresh),
    ]


def plan_search(
    study: Study, resources: Resources, speed: Speed, *, has_bank: bool, fresh: tuple[int, int] | None
) -> Plan:
    """Plan a search: the library waves where there is no bank, and fresh runs where heaps were measured.

    Of these likely so many, and at the most.
    """
    search = Search.of(study)
    simulator = EngineSimulator(study, search.library, OutcomeTable(Path("none.sqlite")))
    points = bank_points(search.space, search.settings)
    chosen = [points[i] for i in np.linspace(0, len(points) - 1, min(SAMPLE, len(points))).astype(int)]
    cases = []
    for point in chosen:
        try:
            cases.append(simulator.case(point))
        except StudyError:
            continue
    waves = [] if has_bank else [("library waves", cases, len(points), len(points))]
    if fresh is not None:
        waves.append(("fresh runs", cases, *fresh))
    return _plan(study, resources, speed, waves, OUTCOME_BYTES)


def plan_heap(study: Study, resources: Resources, speed: Speed, *, case: Case) -> Plan:
    """Plan one case."""
    return _plan(study, resources, speed, [("heap", [case], 1, 1)], 90.0 * cost_of(case).grains)


def _sampled(study: Study, table: pd.DataFrame) -> list[Case]:
    """Cases of a table's rows, of some where there are many."""
    rows = table.sample(min(SAMPLE, len(table)), random_state=0) if len(table) > SAMPLE else table
    names = [factor.name for factor in study.factors]
    return [
        _built(study, {name: row[name] for name in names}, row["seed"], row.get("scene", TARGET_SCENE))
        for row in rows.to_dict("records")
    ]


def _built(study: Study, settings: dict[str, float], seed: int, scene: str = TARGET_SCENE) -> Case:
    return study.case({str(name): float(value) for name, value in settings.items()}, int(seed), scene)


def _surface_cases(study: Study, kept: int) -> int:
    settings = study.campaign.surface
    design = central_composite(study.factors[: max(kept, 1)], settings.alpha, settings.center_points)
    at_center = int((design.coded == 0.0).all(axis=1).sum())
    return (len(design.coded) - at_center) * settings.replicates + at_center


def _costs(cases: Sequence[Case]) -> list[Cost]:
    return [cost_of(case) for case in cases]


def _plan(
    study: Study,
    resources: Resources,
    speed: Speed,
    waves: Sequence[_Wave],
    stored: float,
) -> Plan:
    try:
        return _sized_plan(study, resources, speed, waves, stored)
    except ValueError as error:
        # a run has it as the reason of a case that could not begin
        raise StudyError(str(study.file), str(error), study.scale or "this study") from error


def _sized_plan(
    study: Study,
    resources: Resources,
    speed: Speed,
    waves: Sequence[_Wave],
    stored: float,
) -> Plan:
    on_gpu = resources.on_gpu
    planned = tuple(_wave(*wave, resources, speed) for wave in waves)
    cases = [case for _, some, *_ in waves for case in some]
    memory = 0.0
    if cases:
        largest = max(cases, key=lambda case: cost_of(case).spheres)
        each = device_bytes(largest)
        most = max(wave.most for wave in planned)
        if on_gpu:
            grains = most * max(cost_of(case).grains for case in cases)
            rounds = rounds_of(most, grains, resources.count, sharing=resources.sharing)
            memory = each * resources.sharing * -(-most // (resources.count * rounds))
        else:
            memory = (each + PROCESS_BYTES) * min(resources.count, most) + PROCESS_BYTES
    disk = 5e6 + stored * sum(wave.most for wave in planned)
    return Plan(study.name, str(resources), resources.count, speed, planned, memory, disk, on_gpu)


def _wave(
    name: str, some: Sequence[Case], count: int, most: int, resources: Resources, speed: Speed
) -> PlannedWave:
    costs = _costs(some)

    def seconds(number: int) -> float:
        repeated = [costs[i % len(costs)] for i in range(number)]
        return wave_seconds(repeated, speed, resources.count, resources.on_gpu, resources.sharing)

    mean = {
        key: round(float(np.mean([getattr(cost, key) for cost in costs])))
        for key in ("grains", "spheres", "steps")
    }
    return PlannedWave(name, count, most, **mean, seconds=seconds(count), seconds_most=seconds(most))
