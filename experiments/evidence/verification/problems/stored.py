"""Cases of the heavy problems: what has ended is kept on disk, so that a stopped run goes on where it was."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from dem_warp import Case, CaseResult, simulate
from experiments.cases import Store
from experiments.measurement.case_observables import measure_heap
from experiments.studyfile import Study
from imaging import PictureError

CASES = Path("out") / "verification" / "cases"
"""Folder of the cases, next to the pages of problems that were run by name."""


def finished_cases(cases: Sequence[Case], device: str, store: Store | None = None) -> list[CaseResult]:
    """Results of cases, in order; those that are not stored yet are simulated, all at once.

    Parameters
    ----------
    cases
        Their keys must differ: no two may differ in nothing but the skin.
    device
        "cpu", "cuda" or "cuda:N".
    store
        Where results and checkpoints are kept; by default in `CASES`.
    """
    store = store or Store(CASES)
    keys = [store.key(case) for case in cases]
    missing = [number for number, key in enumerate(keys) if not store.has(key)]

    def keep(index: int, result: CaseResult) -> None:
        store.save(keys[missing[index]], result)

    fresh = simulate(
        [cases[number] for number in missing], device, on_result=keep, checkpoint=store.unfinished
    )
    results = dict(zip(missing, fresh, strict=True))
    return [results[number] if number in results else store.load(key) for number, key in enumerate(keys)]


def repose_angles(study: Study, results: Sequence[CaseResult]) -> np.ndarray:
    """Angle of each heap [deg]; not a number where the case failed or has no measurable heap."""
    with ThreadPoolExecutor() as pool:
        return np.array(list(pool.map(lambda result: _angle(study, result), results)))


def _angle(study: Study, result: CaseResult) -> float:
    if result.status != "finished":
        return np.nan
    try:
        return measure_heap(study.measurement, result).mean
    except PictureError:
        return np.nan
