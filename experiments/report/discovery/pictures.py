"""Heaps to be set side by side: photographed, and simulated by a model."""

from __future__ import annotations

from pathlib import Path

from dem_warp import CaseResult
from experiments.report.pictures import HeapPicture, drawn_heap
from experiments.study import Study
from imaging import PictureError, measure_photograph, overlay, read_picture

PIXELS = 800
"""Width of a drawn heap."""


def photograph(path: Path, condition: str, fit: str) -> HeapPicture | None:
    """Draw the fitted flanks on a photograph; None where it shows no heap."""
    try:
        angle = measure_photograph(path, fit)
    except PictureError:
        return None
    caption = (
        f"“{condition}”, {path.name}: {angle.mean:.1f}°; left {angle.left:.1f}°, right {angle.right:.1f}°."
    )
    return HeapPicture("Measured", caption, overlay(read_picture(path), angle))


def simulated_heap(title: str, condition: str, study: Study, result: CaseResult) -> HeapPicture | None:
    """Draw a heap of a model as a photograph would show it, x to the right; None where the case left none."""
    if result.status != "finished":
        return None
    try:
        (angle, view), _, image = drawn_heap(_in_large(study), result, view=0)
    except PictureError:
        return None
    seen = angle.views[view]
    caption = (
        f"“{condition}”: {angle.mean:.1f}° ± {angle.se:.1f}° over {len(angle.views)} views; this view: left"
        f" {seen.left:.1f}°, right {seen.right:.1f}°."
    )
    return HeapPicture(title, caption, image)


def _in_large(study: Study) -> Study:
    measurement = study.measurement.model_copy(update={"pixels": max(PIXELS, study.measurement.pixels)})
    return study.model_copy(update={"measurement": measurement})
