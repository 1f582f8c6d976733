"""Observables of finished cases."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from dem_warp import Case, CaseResult
from experiments.studyfile.observables import (
    BULK_DENSITY,
    BY_NAME,
    NAMES,
    OBSERVABLES,
    OUTLINE,
    READINGS,
    SOLID_FRACTION,
    View,
)
from experiments.studyfile.study import MeasurementSection
from imaging import HeapAngle, PictureError, heap_angle


@dataclass(frozen=True)
class Observed:
    """Measurements of one case."""

    observables: Mapping[str, float] = field(default_factory=dict)
    """Observables by their columns, in their units, as far as they could be measured."""
    angle: HeapAngle | None = None
    """Repose angle with its views; None without a measurable heap."""
    reason: str = ""
    """Reason why the case failed or has no measurable heap, else empty."""


def measure_heap(settings: MeasurementSection, result: CaseResult) -> HeapAngle:
    """Measure the repose angle of a finished case; raise `imaging.PictureError` without a heap."""
    return heap_angle(
        result.sphere_centers,
        result.sphere_radii,
        azimuths=settings.azimuths,
        fit=settings.fit,
        pixels=settings.pixels,
        grain_count=len(result.positions),
    )


def observe(settings: MeasurementSection, result: CaseResult, leaves_a_heap: bool = True) -> Observed:
    """Measure a case; without a heap, its observables are those that the scene reports."""
    reported = result.observables
    if result.status != "finished" or not leaves_a_heap:
        return Observed(reported, reason=result.reason)
    reported = {
        each.name: reported[each.stands_in]
        for each in OBSERVABLES
        if each.stands_in in reported and each.name not in reported
    } | reported
    try:
        heap = measure_heap(settings, result)
    except PictureError as error:
        return Observed(reported, reason=f"no heap: {error}")
    views = [View.of(view) for view in heap.views]
    wanted = (*OBSERVABLES, *(OUTLINE if settings.outline else ()))
    seen = {each.column: each.in_heap(heap, views) for each in wanted if each.by_photograph}
    with suppress(PictureError):  # a heap with flanks may have too few columns in their middle
        seen |= {each.column: each.in_heap(heap, views) for each in READINGS}
    return Observed(seen | reported, heap)


def with_bulk_density(observables: Mapping[str, float], case: Case) -> dict[str, float]:
    """Add the bulk density [kg/m3] to the observables of a case with a filling."""
    if SOLID_FRACTION not in observables:
        return dict(observables)
    return {**observables, BULK_DENSITY: observables[SOLID_FRACTION] * case.grain_material.density}


def measure(
    settings: MeasurementSection, result: CaseResult, names: Sequence[str] = NAMES
) -> tuple[np.ndarray, str]:
    """Measure named observables of a case, by default those of a heap.

    Return the values (observables,) in their units and an empty reason; or all NaN with the reason of a
    failure: the case failed, its heap cannot be measured, or a value is missing.
    """
    leaves_a_heap = any(name in BY_NAME and BY_NAME[name].by_photograph for name in names)
    found = observe(settings, result, leaves_a_heap)
    columns = [BY_NAME[name].column if name in BY_NAME else name for name in names]
    missing = [column for column in columns if column not in found.observables]
    if result.status != "finished" or (leaves_a_heap and found.angle is None) or missing:
        return np.full(len(names), np.nan), found.reason or f"missing: {', '.join(missing)}"
    return np.array([found.observables[column] for column in columns]), ""
