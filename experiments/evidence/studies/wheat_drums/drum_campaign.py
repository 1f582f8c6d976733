"""Campaign of the study: drums of a wide design, their fit, and heaps at compatible settings."""

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import warp as wp

from dem_warp.device import resolve_device
from dem_warp.provenance import provenance
from experiments.cases import OwnWorkers, Store, run_cases
from experiments.evidence.studies.wheat_drums.drum_fit import SETTINGS, Slopes, WheatFit, fit_slopes
from experiments.evidence.studies.wheat_drums.drum_plan import (
    GRAIN,
    RUNS,
    data,
    heap_study_at,
    planned_drums,
    study_at,
)
from experiments.io.errors import InputError
from experiments.io.files import write_text
from experiments.io.program_version import with_version
from experiments.studyfile import Study

DRUMS, HEAPS, FACTS = "drums.csv", "heaps.csv", "provenance.json"
"""Files of a record."""

DRUM_TOLD = ("status", "reason", "grain_count", "dynamic_angle", "dynamic_angle_se")
HEAP_TOLD = ("status", "reason", "grain_count", "angle", "angle_se")
"""Columns that are kept of what a case tells."""


def run_study(scale: str, folder: Path, device: str | None = None, workers: int | None = None) -> None:
    """Run the whole study at a scale, and write the tables of its record.

    Cases that the folder holds are not simulated again.
    """
    if scale not in RUNS:
        raise InputError("--scale", f"must be one of {', '.join(RUNS)}", scale)
    runs, machine, store = RUNS[scale], OwnWorkers(device, workers), Store(folder / "cases")
    walls: list[dict[str, Any]] = []

    def simulated(study: Study, table: pd.DataFrame, stage: str, responses: tuple[str, ...]) -> pd.DataFrame:
        print(f"{stage}: {len(table)} cases", flush=True)
        began = time.perf_counter()
        found = run_cases(study, table, store, machine)
        seconds = round(time.perf_counter() - began, 1)
        walls.append({"stage": stage, "simulated": len(table), "seconds": seconds})
        kept = found.reindex(columns=[*table.columns, *responses])
        write_text(folder / f"{stage}.csv", kept.to_csv(index=False, float_format="%.6g"))
        return kept

    study = study_at(scale)
    drums = simulated(study, planned_drums(study, runs.points), Path(DRUMS).stem, DRUM_TOLD)
    fit = fit_slopes(Slopes.of(study, drums), data())
    planned = planned_heaps(study, fit, runs.heaps)
    simulated(heap_study_at(scale), planned, Path(HEAPS).stem, HEAP_TOLD)
    made = with_version(provenance(wp.get_device(resolve_device(device)), "mixed"))
    facts = made | {"scale": scale, "wall_times": walls}
    write_text(folder / FACTS, json.dumps(facts, indent=1) + "\n")


def planned_heaps(study: Study, fit: WheatFit, count: int) -> pd.DataFrame:
    """Lay out heaps at compatible settings; tube and plate are of any of the four materials in turn."""
    rng = np.random.default_rng(41)
    drawn = fit.settings[rng.choice(len(fit.settings), size=count, replace=False)]
    factors = {factor.name: factor for factor in study.factors}
    shell, walls = factors["mu_shell"], len(SETTINGS) - len(GRAIN)
    rows = []
    for number, point in enumerate(drawn):
        row = {
            name: factors[name].center + factors[name].half_range * point[i] for i, name in enumerate(GRAIN)
        }
        wall = shell.center + shell.half_range * point[len(GRAIN) + number % walls]
        rows.append(
            {"seed": 7000 + number, "wall": SETTINGS[len(GRAIN) + number % walls], **row, "mu_wall": wall}
        )
    return pd.DataFrame(rows)
