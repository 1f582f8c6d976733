"""An engine for tests: cones whose angle follows the friction; it notes the seeds that it simulates."""

import json
import math
import os
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dem_warp import Case, CaseResult
from experiments.cases import execute
from experiments.cases.workers import own
from experiments.measurement.case_observables import Observed
from experiments.report.material_card import write_material_card
from experiments.runs import calibration

SEEDS = "DEM_WARP_TEST_SEEDS"
"""Variable of the environment that names the file of the simulated seeds."""

BASE = 20e-3
"""Radius of the cones [m]."""


def cone_engine(
    cases: Sequence[Case],
    device: str | None = None,
    workers: int | None = None,
    on_result: Any = None,
    on_progress: Any = None,
    checkpoint: Any = None,
) -> list[CaseResult]:
    """Answer each case with a cone of 15 degrees, and 30 more for a friction of 1."""
    results = []
    for index, case in enumerate(cases):
        with Path(os.environ[SEEDS]).open("a", encoding="utf-8") as file:
            file.write(f"{case.seed}\n")
        angle = 15.0 + 30.0 * case.grain_grain.static_friction + 0.3 * math.sin(12.9898 * case.seed)
        results.append(cone_of(math.tan(math.radians(angle)), observables={"truth": angle}))
        on_result(index, results[-1])
    return results


def observe(_: object, result: CaseResult, leaves_a_heap: bool) -> Observed:
    """Take the angle that a stand-in engine reports as the truth."""
    heap = {"angle": result.observables["truth"]} if leaves_a_heap else {}
    return Observed(result.observables | heap, SimpleNamespace(se=0.1) if heap else None)


def stand_in(patch: pytest.MonkeyPatch, simulate: Any) -> None:
    """Let another function simulate, and draw no heaps."""
    patch.setattr(own, "simulate", simulate)
    patch.setattr(execute, "observe", observe)
    patch.setattr(calibration, "heap_pictures", lambda *_: [])


def without_pages(patch: pytest.MonkeyPatch) -> None:
    """Let a calibration leave its results and its card, without pictures and pages."""

    def write_results(campaign: Any, study: Any, folder: Path, *_: Any, **__: Any) -> None:
        results = json.dumps({"campaign": campaign.to_dict()})
        (folder / "results.json").write_text(results, encoding="utf-8")
        write_material_card(campaign, study, folder)

    patch.setattr(calibration, "write_report", write_results)
    patch.setattr(calibration, "heap_pictures", lambda *_: [])
    patch.setattr(calibration, "verified_heap", lambda *_: None)


def resting(positions: np.ndarray, clump: Sequence, **facts: Any) -> CaseResult:
    """Build the result of a case that ended with equal grains, of one clump [x, y, z, r], at these places."""
    count = len(positions)
    return CaseResult(
        **{"status": "finished", "reason": ""} | facts,
        positions=positions,
        orientations=np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)),
        sizes=np.ones(count),
        shapes=np.zeros(count, dtype=int),
        clumps=np.array([clump]),
    )


def cone_of(slope: float, radius: float = 1e-3, **facts: Any) -> CaseResult:
    """Build the result of a case that ended in a cone of spheres of 20 mm, with a given slope."""
    x, y = (axis.ravel() for axis in np.meshgrid(*[np.arange(-BASE, BASE, radius)] * 2))
    z = slope * (BASE - np.hypot(x, y))
    places = np.column_stack([x, y, z])[z > 0.0]
    seen = {"grain_count": float(len(places)), "time_to_rest": 0.5} | facts.pop("observables", {})
    device = {"device": "CPU"}
    return resting(places, [[0.0, 0.0, 0.0, radius]], observables=seen, provenance=device, **facts)
