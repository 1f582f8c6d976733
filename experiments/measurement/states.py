"""Observables of simulated states: what a case that has ended gives of its test."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from dem_warp import CaseResult
from experiments.studyfile.observables import BY_NAME, NAMES, OBSERVABLES, OUTLINE, View
from experiments.studyfile.study import MeasurementSection
from imaging import HeapAngle, PictureError, heap_angle


@dataclass(frozen=True)
class Observed:
    """Measurements of one case."""

    observables: Mapping[str, float] = field(default_factory=dict)
    """Observables by their columns, in their units; what could not be measured is left out."""
    angle: HeapAngle | None = None
    """The repose angle with its views; None without a measurable heap."""
    reason: str = ""
    """Reason that the case failed or that its heap cannot be measured; empty when neither did."""


def measure_heap(settings: MeasurementSection, result: CaseResult) -> HeapAngle:
    """Measure the repose angle of a finished case as a study says.

    Raises
    ------
    imaging.PictureError
        When there is no measurable heap.
    """
    return heap_angle(
        result.sphere_centers,
        result.sphere_radii,
        azimuths=settings.azimuths,
        fit=settings.fit,
        pixels=settings.pixels,
        grain_count=len(result.positions),
    )


def observe(settings: MeasurementSection, result: CaseResult, leaves_a_heap: bool = True) -> Observed:
    """Measure a case; of a scene that leaves no heap, what it tells of is all."""
    told = result.observables
    if result.status != "finished" or not leaves_a_heap:
        return Observed(told, reason=result.reason)
    told = {
        each.name: told[each.stands_in]
        for each in OBSERVABLES
        if each.stands_in in told and each.name not in told
    } | told
    try:
        heap = measure_heap(settings, result)
    except PictureError as error:
        return Observed(told, reason=f"no heap: {error}")
    views = [View.of(view) for view in heap.views]
    wanted = (*OBSERVABLES, *(OUTLINE if settings.outline else ()))
    seen = {each.column: each.in_heap(heap, views) for each in wanted if each.by_photograph}
    return Observed(seen | told, heap)


def measure(
    settings: MeasurementSection, result: CaseResult, names: Sequence[str] = NAMES
) -> tuple[np.ndarray, str]:
    """Measure named observables of a case, all or none; left out those of a heap, `OBSERVABLES`.

    Only where a photograph shows one of them is there a heap to be measured.

    Returns
    -------
    values : (observables,) array
        In their units; NaN, all of them, for a case that has none.
    reason : str
        Why a case has none: it failed, its heap cannot be measured, or one was not told; else empty.
    """
    leaves_a_heap = any(name in BY_NAME and BY_NAME[name].by_photograph for name in names)
    found = observe(settings, result, leaves_a_heap)
    columns = [BY_NAME[name].column if name in BY_NAME else name for name in names]
    untold = [column for column in columns if column not in found.observables]
    if result.status != "finished" or (leaves_a_heap and found.angle is None) or untold:
        return np.full(len(names), np.nan), found.reason or f"was not told: {', '.join(untold)}"
    return np.array([found.observables[column] for column in columns]), ""
