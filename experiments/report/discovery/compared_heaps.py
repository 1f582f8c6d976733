"""Heaps to be set side by side: photographed, and simulated by models."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from dem_warp import CaseResult
from experiments.report.pictures import HeapPicture, drawn_heap
from experiments.studyfile import Study
from imaging import PictureError, ReposeAngle, measure_photograph, overlay, read_picture

PIXELS = 800
"""Width of a drawn heap."""

WIDEST = 1000
"""Columns of a picture in the page, at most."""

ASIDE, ABOVE, BELOW = 0.2, 0.12, 0.06
"""Free space to either side of a heap, above its summit and below its plate, in its widths."""


@dataclass(frozen=True)
class _Window:
    """Reach of a picture: to either side of the heap's middle, above its plate and below, in any unit."""

    reach: float
    above: float
    below: float

    @classmethod
    def around(cls, width: float, height: float) -> _Window:
        return cls((0.5 + ASIDE) * width, height + ABOVE * width, BELOW * width)

    def over(self, unit: float) -> _Window:
        """Return the window in another unit."""
        return _Window(self.reach / unit, self.above / unit, self.below / unit)


def photograph(path: Path, condition: str, fit: str) -> HeapPicture | None:
    """Cut the heap out of a photograph, its fitted flanks drawn on it; None where it shows no heap."""
    try:
        angle = measure_photograph(path, fit)
    except PictureError:
        return None
    sides = f"left {angle.left:.1f}°, right {angle.right:.1f}°"
    caption = f"“{condition}”, {path.name}: {angle.mean:.1f}°; {sides}."
    return HeapPicture("Measured", caption, _shown(read_picture(path), angle, _Window.around(*_size(angle))))


def turned(result: CaseResult, azimuth: float) -> CaseResult:
    """Turn a heap about its vertical by an azimuth [deg]; one that did not finish stays."""
    if not azimuth or result.status != "finished":
        return result
    turn = Rotation.from_euler("z", azimuth, degrees=True)
    orientations = (turn * Rotation.from_quat(result.orientations)).as_quat()
    return replace(result, positions=turn.apply(result.positions), orientations=orientations)


def simulated_heaps(models: Mapping[str, CaseResult], condition: str, study: Study) -> list[HeapPicture]:
    """Draw heaps as a photograph would show them, x to the right, all at one scale.

    They come from models by their titles, with the study under the condition; one without a heap is left out.
    """
    heaps, pixels = {}, max(PIXELS, study.measurement.pixels)
    large = study.model_copy(update={"measurement": study.measurement.model_copy(update={"pixels": pixels})})
    for title, result in models.items():
        try:
            if result.status == "finished":
                heaps[title] = drawn_heap(large, result, view=0)
        except PictureError:
            continue
    drawn = heaps.values()
    sizes = [seen.meters_per_pixel * np.array(_size(angle.views[view])) for (angle, view), seen, _ in drawn]
    pictures = []
    for title, ((angle, view), picture, _) in heaps.items():
        seen = angle.views[view]
        window = _Window.around(*np.max(sizes, axis=0)).over(picture.meters_per_pixel)
        caption = (
            f"“{condition}”: {angle.mean:.1f}° ± {angle.se:.1f}° over {len(angle.views)} views; this view:"
            f" left {seen.left:.1f}°, right {seen.right:.1f}°."
        )
        pictures.append(HeapPicture(title, caption, _shown(picture.image, seen, window, beyond=True)))
    return pictures


def _size(angle: ReposeAngle) -> tuple[float, float]:
    return float(np.ptp(angle.outline.position)), float(angle.outline.height.max())


def _shown(image: np.ndarray, angle: ReposeAngle, window: _Window, beyond: bool = False) -> np.ndarray:
    """Cut a window of pixels about the heap out of a picture, and draw the fitted flanks on it.

    What is beyond the picture is left out, or made of its border.
    """
    ends = angle.outline.position[[0, -1]]
    columns, rows = angle.outline.plate.picture_point(ends, np.zeros(2))
    middle, ground = float(columns.mean()), float(rows.mean())
    left, right = round(middle - window.reach), round(middle + window.reach)
    top, bottom = round(ground - window.above), round(ground + window.below)
    part = image[max(top, 0) : bottom, max(left, 0) : right]
    if beyond:
        lacks = ((-top, bottom - len(image)), (-left, right - image.shape[1]), (0, 0))
        part = np.pad(part, np.maximum(lacks, 0), "edge")
    else:
        left, top = max(left, 0), max(top, 0)
    drawn = overlay(np.ascontiguousarray(part), angle.in_part(left, top))
    if drawn.shape[1] <= WIDEST:
        return drawn
    rows_left = round(len(drawn) * WIDEST / drawn.shape[1])
    return cv2.resize(drawn, (WIDEST, rows_left), interpolation=cv2.INTER_AREA)
