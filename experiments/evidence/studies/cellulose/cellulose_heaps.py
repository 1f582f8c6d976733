"""Simulated drums of the study: each kept with its edge over time, and never simulated twice."""

import time
from pathlib import Path

import numpy as np
import pandas as pd

from dem_warp import CaseResult
from dem_warp.checkpoint import case_name
from experiments.cases import OwnWorkers, Store
from experiments.evidence.studies.cellulose.cellulose_plan import case_of, places
from experiments.evidence.studies.cellulose.drum_edges import EdgeWatch, edge_file, read_edges
from experiments.io.files import replacing, write_text
from experiments.studyfile import Study

LEVELS = (0.2, 0.5, 0.8)
"""Darkness of the averaged picture at which its edge is read."""

WALL_TIMES = "wall_times.csv"
"""Drums and seconds of each call, by stage."""


def simulate_drums(
    study: Study, table: pd.DataFrame, folder: Path, device: str | None = None, workers: int | None = None
) -> pd.DataFrame:
    """Simulate the drums of a table that the folder lacks, and add a row to its wall times.

    Returns
    -------
    table
        With status, reason, grain_count and the name of the case.
    """
    store, edges, began = Store(folder / "cases"), folder / "edges", time.perf_counter()
    stage, done = str(table["stage"].iloc[0]), 0
    cases = [case_of(study, row) for _, row in table.iterrows()]
    keys, names = [store.key(case) for case in cases], [case_name(case) for case in cases]
    missing = [
        i
        for i, (key, name) in enumerate(zip(keys, names, strict=True))
        if not (store.has(key) and (edge_file(edges, name).is_file() or store.load(key).status != "finished"))
    ]

    def keep(number: int, result: CaseResult) -> None:
        nonlocal done
        done += 1
        store.save(keys[missing[number]], result)
        what = f"{stage}, {result.status} {result.reason}".rstrip()
        print(f"{time.perf_counter() - began:6.0f} s, drum {number + 1}: {what}", flush=True)

    if missing:
        machine = OwnWorkers(device, workers, EdgeWatch(edges, places()))
        try:
            machine.simulate([cases[i] for i in missing], on_result=keep, checkpoint=store.unfinished)
        finally:
            _note_time(folder, stage, done, time.perf_counter() - began)
    ends = [store.load(key) for key in keys]
    return table.assign(
        status=[end.status for end in ends],
        reason=[end.reason for end in ends],
        grain_count=[end.observables.get("grain_count", np.nan) for end in ends],
        dynamic_angle=[end.observables.get("dynamic_angle", np.nan) for end in ends],
        case=names,
    )


def _note_time(folder: Path, stage: str, simulated: int, seconds: float) -> None:
    """Add the drums of a call, also of one that was stopped, to the wall times of the folder."""
    row = pd.DataFrame([{"stage": stage, "simulated": simulated, "seconds": round(seconds, 1)}])
    path = folder / WALL_TIMES
    known = [pd.read_csv(path)] if path.is_file() else []
    write_text(path, pd.concat([*known, row]).to_csv(index=False))


def with_curves(table: pd.DataFrame, folder: Path) -> tuple[pd.DataFrame, dict[float, np.ndarray]]:
    """Drop the drums without an edge, and read the edges of the others.

    Returns
    -------
    table
        Drums that finished, in their order.
    curves
        By darkness, the heights of the averaged edges [mm], shape (drums, places).
    """
    kept = table[table["status"] == "finished"].reset_index(drop=True)
    edges = [read_edges(folder / "edges", name) for name in kept["case"]]
    return kept, {dark: 1e3 * np.array([edge.level(dark) for edge in edges]) for dark in LEVELS}


def write_curves(path: Path, table: pd.DataFrame, curves: dict[float, np.ndarray]) -> None:
    """Write averaged edges next to their drums: all that a later fit needs."""
    x = 1e3 * places()
    names = [f"{value:.3f}" for value in x]
    frames = []
    for dark, rows in curves.items():
        frame = pd.DataFrame(np.round(rows, 3), columns=names)
        frames.append(pd.concat([table.assign(dark=dark), frame], axis=1))
    with replacing(path) as temporary:
        pd.concat(frames, ignore_index=True).to_csv(temporary, index=False, compression="xz")


def read_curves(path: Path) -> tuple[pd.DataFrame, dict[float, np.ndarray]]:
    """Read what `write_curves` wrote."""
    found = pd.read_csv(path)
    names = list(found.columns[found.columns.get_loc("dark") + 1 :])
    by_dark = dict(list(found.groupby("dark")))
    table = by_dark[0.5].drop(columns=["dark", *names]).reset_index(drop=True)
    return table, {float(dark): rows[names].to_numpy(float) for dark, rows in by_dark.items()}
