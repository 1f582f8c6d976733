"""Pictures of a campaign's heaps, with the fitted flanks drawn on them."""

from __future__ import annotations

import base64
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import pandas as pd

from dem_warp import CaseResult
from dem_warp.cores import cores
from experiments.calibrate.campaign import Campaign
from experiments.cases.measuring import MeasuringThreads
from experiments.measurement.case_observables import measure_heap
from experiments.report.kit.numbers import trimmed
from experiments.studyfile import Study
from imaging import HeapAngle, Snapshot, overlay, snapshot

JPEG_QUALITY = 88

SHOWN_OF_A_STAGE = {"target": 1, "screening": 2, "climb": 2, "verification": 3}
"""Heaps shown of each stage, evenly from its flattest to its steepest."""

STAGE_NAMES = {"target": "Target", "screening": "Screening", "climb": "Climb", "verification": "Verification"}


@dataclass(frozen=True)
class HeapPicture:
    """One picture of the page."""

    title: str
    caption: str
    image: np.ndarray
    """Rows, columns, blue-green-red; uint8."""

    @property
    def data_uri(self) -> str:
        """The picture as a JPEG inside the page."""
        _, data = cv2.imencode(".jpg", self.image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
        return "data:image/jpeg;base64," + base64.b64encode(data.tobytes()).decode("ascii")


def heap_pictures(campaign: Campaign, study: Study, load: Callable[[str], CaseResult]) -> list[HeapPicture]:
    """Draw the flattest and steepest heaps of every stage, and heaps of the verification.

    `load` finds the result of a case by its ``case_key``, as ``Store.load`` does.
    """
    cases = campaign.cases
    kept = campaign.selection.kept if campaign.selection else ()
    measured = cases[cases["angle"].notna()]
    shown = [
        case
        for stage, count in SHOWN_OF_A_STAGE.items()
        for case in _spread(measured[measured["stage"] == stage], count).to_dict("records")
    ]
    with MeasuringThreads(cores()) as threads:
        return list(threads.map(lambda case: _picture(case, study, load(str(case["case_key"])), kept), shown))


def _spread(cases: pd.DataFrame, count: int) -> pd.DataFrame:
    """Pick `count` cases evenly from the flattest to the steepest (the middle one when it is one)."""
    ordered = cases.sort_values("angle")
    places = np.linspace(0.0, 1.0, count) if count > 1 else np.array([0.5])
    picked = np.unique(np.rint(places * max(len(ordered) - 1, 0)).astype(int))
    return ordered.iloc[picked[picked < len(ordered)]]


def drawn_heap(
    study: Study, result: CaseResult, view: int | None = None
) -> tuple[tuple[HeapAngle, int], Snapshot, np.ndarray]:
    """Measure and draw a heap in one view: angle and view, picture, overlay.

    Without a `view`, it is the one nearest to the mean over all.

    Raises
    ------
    imaging.PictureError
        When there is no heap to measure.
    """
    angle = measure_heap(study.measurement, result)
    if view is None:
        view = int(np.argmin([abs(seen.mean - angle.mean) for seen in angle.views]))
    picture = snapshot(
        result.sphere_centers,
        result.sphere_radii,
        angle.azimuths[view],
        pixels=study.measurement.pixels,
        backend="raster",  # a second each also without a GPU, and the same picture on every machine
        grains=result.sphere_grain,
    )
    return (angle, view), picture, overlay(picture, angle.views[view])


def _picture(case: Mapping[str, Any], study: Study, result: CaseResult, kept: tuple[str, ...]) -> HeapPicture:
    (angle, view), _, image = drawn_heap(study, result)
    values = "".join(f", {name} = {trimmed(case[name], 3)}" for name in kept)
    return HeapPicture(
        title=f"{STAGE_NAMES[case['stage']]}, run {case['run']}, heap {case['replicate']}",
        caption=f"{angle.mean:.2f}° ± {angle.se:.2f}° over {len(angle.views)} views{values}; "
        f"this view: left {angle.views[view].left:.1f}°, right {angle.views[view].right:.1f}°.",
        image=image,
    )
