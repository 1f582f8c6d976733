"""Heaps of the paper's 31 runs under bases: simulated once, and read by every estimator afterwards."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from dem_warp import Case, CaseResult, simulate
from experiments.cases import Store
from experiments.evidence.studies.buckwheat.bases.grid import Base, grid
from experiments.io.files import write_text
from experiments.studyfile import load_study
from experiments.studyfile.study import MeasurementSection
from imaging import PictureError, heap_outlines

LEAST_WORLDS = 120
"""Bases of one law are simulated together until a batch has this many worlds: fewer leave a GPU idle."""

KEPT = ("stage", "run", "replicate", "published", "seed", "status", "reason", "case_key")
"""Columns of a base's table before its heaps are read."""

HEAP_TOLD = ("grain_count", "solid_fraction", "grains_lost", "rolled_fraction", "centre_height")
"""Observables that are kept beside the angles."""


@dataclass(frozen=True)
class Folder:
    """Folder of bases: a table each, and the heaps of all."""

    path: Path

    @property
    def store(self) -> Store:
        """Heaps by the key of their case."""
        return Store(self.path / "cases")

    def table(self, base: Base) -> Path:
        """File of a base."""
        return self.path / f"{base.name}.csv"


def angle_column(estimator: str) -> str:
    """Name of the column with the angles [deg] of an estimator."""
    return f"angle_{estimator}"


def simulate_bases(
    wanted: Iterable[Base], folder: Folder, settings: dict[str, Any], device: str | None = None
) -> None:
    """Simulate the 31 runs of bases that have no table yet, batch after batch, and write their tables.

    The settings are scale, modulus_scale (None: the scale's) and replicates. Each heap is kept as its case
    ends: after an interruption only those that lack are simulated.
    """
    for together in batches(wanted, 31 * settings["replicates"]):
        new = [base for base in together if not folder.table(base).is_file()]
        plans = {base.name: _plan(base, folder.store, settings) for base in new}
        _fill(folder.store, {key: case for _, cases in plans.values() for key, case in cases.items()}, device)
        for base in new:
            table, cases = plans[base.name]
            ends = [folder.store.load(key) for key in cases]
            table = table.assign(status=[end.status for end in ends], reason=[end.reason for end in ends])
            told = pd.DataFrame([end.observables for end in ends]).reindex(columns=list(HEAP_TOLD))
            table = pd.concat([table[list(KEPT)], told], axis=1)
            write_text(folder.table(base), table.to_csv(index=False))
            print(f"{base.name}: {(table['status'] == 'finished').sum()} of {len(table)} heaps", flush=True)


def batches(wanted: Iterable[Base], worlds_each: int) -> list[list[Base]]:
    """Put bases of one law together, until they have `LEAST_WORLDS` worlds."""
    found: list[list[Base]] = []
    for base in wanted:
        last = found[-1] if found else []
        if last and last[0].law == base.law and len(last) * worlds_each < LEAST_WORLDS:
            last.append(base)
        else:
            found.append([base])
    return found


def measure_bases(wanted: Iterable[Base], folder: Folder, workers: int | None = None) -> None:
    """Read the heaps of every table by the estimators that it lacks, over so many processes."""
    estimators = [estimator.name for estimator in grid().estimator]
    section = load_study().measurement
    with ProcessPoolExecutor(workers or os.cpu_count()) as pool:
        for path in (folder.table(base) for base in wanted):
            if not path.is_file():
                continue
            table = pd.read_csv(path)
            lacking = [name for name in estimators if angle_column(name) not in table]
            if not lacking:
                continue
            read = partial(read_heap, folder.store, section, lacking)
            angles = pd.DataFrame(list(pool.map(read, table["case_key"])), index=table.index)
            write_text(path, table.join(angles).to_csv(index=False))
            print(f"{path.stem}: read by {', '.join(lacking)}", flush=True)


def read_heap(
    store: Store, section: MeasurementSection, estimators: Sequence[str], key: str
) -> dict[str, float]:
    """Read a stored heap by estimators: angles [deg] by `angle_column`, NaN where there is none."""
    result = store.load(key)
    angles = dict.fromkeys(map(angle_column, estimators), np.nan)
    if result.status != "finished":
        return angles
    outlines = heap_outlines(result.sphere_centers, result.sphere_radii, section.azimuths, section.pixels)
    for name in estimators:
        try:
            angles[angle_column(name)] = outlines.angle(name).mean
        except PictureError:
            continue
    return angles


def _plan(base: Base, store: Store, settings: dict[str, Any]) -> tuple[pd.DataFrame, dict[str, Case]]:
    """Lay out a base's table, and its cases by key, in order."""
    variant = base.variant
    study = variant.load_study(settings["scale"], settings["modulus_scale"])
    table = variant.planned_cases(settings["replicates"])
    names = [factor.name for factor in study.factors]
    rows = zip(table[names].to_dict("records"), table["seed"], strict=True)
    made = [study.case({str(name): float(x) for name, x in row.items()}, int(seed)) for row, seed in rows]
    cases = {store.key(case): case for case in made}
    return table.assign(case_key=list(cases)), cases


def _fill(store: Store, cases: dict[str, Case], device: str | None) -> None:
    """Simulate what the store lacks, all at once; keep each result as it ends."""
    missing = [key for key in cases if not store.has(key)]

    def keep(index: int, result: CaseResult) -> None:
        store.save(missing[index], result)

    if missing:
        simulate([cases[key] for key in missing], device, on_result=keep, checkpoint=store.unfinished)
