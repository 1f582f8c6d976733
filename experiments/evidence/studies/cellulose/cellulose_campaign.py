"""Campaign of the study: a wide design, a second one about what it found, and repeats of the best point."""

import json
from pathlib import Path
from typing import Any

import pandas as pd

from dem_warp.device import resolve_device
from dem_warp.provenance import provenance
from experiments.evidence.studies.cellulose.cellulose_fit import calibrate_on, prediction
from experiments.evidence.studies.cellulose.cellulose_heaps import (
    WALL_TIMES,
    simulate_drums,
    with_curves,
    write_curves,
)
from experiments.evidence.studies.cellulose.cellulose_plan import (
    HELD_BACK,
    MEASURED,
    RUNS,
    batch,
    first_points,
    second_points,
    study_at,
)
from experiments.io.errors import InputError
from experiments.io.files import write_text
from experiments.io.program_version import with_version

CURVES, FACTS, PREDICTION = "curves.csv.xz", "provenance.json", "prediction.csv"
"""Files of a record: averaged edges of all drums, what made them, and the sealed prediction."""


def run_study(scale: str, folder: Path, device: str | None = None, workers: int | None = None) -> None:
    """Run the whole study at a scale: simulate, fit, and write the record's tables and the prediction.

    Drums that the folder holds are not simulated again.
    """
    if scale not in RUNS:
        raise InputError("--scale", f"must be one of {', '.join(RUNS)}", scale)
    study, runs = study_at(scale), RUNS[scale]
    tables: list[pd.DataFrame] = []

    def simulated(points: pd.DataFrame, stage: str, speeds: tuple[int, ...], seed: int) -> None:
        planned = batch(points, stage, speeds, seed)
        print(f"{stage}: {len(planned)} drums", flush=True)
        tables.append(simulate_drums(study, planned, folder, device, workers))

    simulated(first_points(study, runs), "first", MEASURED, 1000)
    wide = calibrate_on(study, *_half_dark(tables, folder))
    everywhere = (*MEASURED, *HELD_BACK)
    simulated(second_points(study, wide.free.settings, runs.second), "second", everywhere, 2000)
    found = calibrate_on(study, *_half_dark(tables, folder))
    best = pd.concat([found.best] * runs.checks, ignore_index=True)
    simulated(best, "check", everywhere, 3000)
    kept, curves = with_curves(pd.concat(tables, ignore_index=True), folder)
    write_curves(folder / CURVES, kept, curves)
    final = calibrate_on(study, kept, curves[0.5])
    write_text(
        folder / PREDICTION, prediction(final, study.case({}, 0).scene.diameter / 2).to_csv(index=False)
    )
    facts = _origin(device) | {"scale": scale, "failed": _failed(tables), "wall_times": _wall_times(folder)}
    write_text(folder / FACTS, json.dumps(facts, indent=1) + "\n")


def _wall_times(folder: Path) -> list[dict[str, Any]]:
    """Drums and seconds of each stage, over all calls."""
    table = pd.read_csv(folder / WALL_TIMES).groupby("stage", sort=False, as_index=False).sum()
    return table.to_dict("records")


def _half_dark(tables: list[pd.DataFrame], folder: Path) -> tuple[pd.DataFrame, Any]:
    kept, curves = with_curves(pd.concat(tables, ignore_index=True), folder)
    return kept, curves[0.5]


def _failed(tables: list[pd.DataFrame]) -> list[str]:
    """Reasons of the drums that did not finish."""
    table = pd.concat(tables, ignore_index=True)
    lost = table[table["status"] != "finished"]
    return [f"{row.stage} {row.point} at {row.rpm}/min: {row.reason}" for row in lost.itertuples()]


def _origin(device: str | None) -> dict[str, Any]:
    import warp as wp

    return with_version(provenance(wp.get_device(resolve_device(device)), "mixed"))
