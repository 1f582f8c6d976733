"""Heaps in a row, at one scale."""

from collections.abc import Mapping

import cv2
import numpy as np

from dem_warp import CaseResult
from experiments.report.pictures import drawn_heap
from experiments.studyfile import Study

ROW_WIDTH = 1500
"""Columns of a row of heaps, at most."""

ROW_HEAD = 40
"""Rows above the heaps of a row for what is written there."""


def heap_row(study: Study, heaps: Mapping[str, CaseResult]) -> np.ndarray:
    """Draw heaps next to each other at one scale, on one plate: (rows, columns, 3), blue-green-red.

    The study's measurement gives the angles; heaps come by what is written above them (ASCII).
    """
    drawn = [drawn_heap(study, result) for result in heaps.values()]
    coarsest = max(picture.meters_per_pixel for _, picture, _ in drawn)
    width = sum(image.shape[1] * picture.meters_per_pixel / coarsest for _, picture, image in drawn)
    panels = []
    for _, picture, image in drawn:
        ratio = min(1.0, ROW_WIDTH / width) * picture.meters_per_pixel / coarsest
        size = (round(ratio * image.shape[1]), round(ratio * image.shape[0]))
        shrunk = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
        panels.append((shrunk, round(ratio * (picture.ground_row + 0.5))))
    above = max(ground for _, ground in panels) + ROW_HEAD
    below = max(len(image) - ground for image, ground in panels)
    row = []
    for (image, ground), title in zip(panels, heaps, strict=True):
        top, bottom = above - ground, below - (len(image) - ground)
        panel = cv2.copyMakeBorder(image, top, bottom, 0, 0, cv2.BORDER_REPLICATE)
        place, font = (12, ROW_HEAD - 12), cv2.FONT_HERSHEY_DUPLEX
        cv2.putText(panel, title, place, font, 0.6, (40, 32, 28), 1, cv2.LINE_AA)
        row.append(panel)
    return np.hstack(row)
