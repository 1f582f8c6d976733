"""Variants of a photograph's contrast, for pictures whose plain contrast does not show one clear heap."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from imaging.flank.outline import largest_pieces
from imaging.geometry import Layer
from imaging.photo.background import LEAST_NOISE, Contrast, otsu_threshold, unshaded

FAINT = 6.0
"""Threshold for the faintest parts of a heap, in multiples of the wall's noise."""
GRAIN_SHARE = 0.005
"""Radius of a window with a grain or two, in the picture's widths."""
BOARD_SHARE = 0.08
"""Part of a board's width, at either end, that shows its colours."""
BOARD_SAMPLES = 4000
"""Largest number of pixels for a board's colours."""


def with_low_threshold(seen: Contrast) -> Contrast:
    """Add a threshold just above the wall's noise."""
    faint = FAINT * max(seen.noise, LEAST_NOISE)
    return replace(seen, thresholds=tuple(dict.fromkeys((*seen.thresholds, faint))))


def without_shadows(seen: Contrast) -> Contrast:
    """Remove what may be a shadow on the wall."""
    values = unshaded(seen.colors, seen.background, _grain_reach(seen))
    return replace(seen, values=values, thresholds=_cuts(values, seen.noise))


def with_filled_gaps(seen: Contrast) -> Contrast:
    """Fill the gaps of grains as light as the wall, between darker and lighter ones."""
    size = 2 * _grain_reach(seen) + 1
    # the running sums of a blur may be negative by rounding
    values = np.sqrt(np.maximum(cv2.blur(seen.values**2, (size, size)), 0.0))
    return replace(seen, values=values, thresholds=_cuts(values, seen.noise))


def without_board(seen: Contrast) -> Contrast:
    """Remove a board under the heap, by the colours of its ends.

    A board seen from above has slanting ends and no straight edge behind the heap, but at most two colours,
    of its top and of its front.
    """
    body, _ = largest_pieces(seen.values > seen.thresholds[-1])
    covered = np.flatnonzero(body.any(axis=0))
    size = max(2, round(BOARD_SHARE * len(covered)))
    ends = np.zeros_like(body)
    for side in (covered[:size], covered[-size:]):
        ends[:, side] = body[:, side]
    sample = seen.colors[ends][:: max(1, int(ends.sum()) // BOARD_SAMPLES)]
    if len(sample) < 2:
        return replace(seen, thresholds=())
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 20, 0.5)
    cv2.setRNGSeed(0)
    start = np.zeros((len(sample), 1), dtype=np.int32)
    single = np.asarray(sample, dtype=np.float32)
    _, label, centers = cv2.kmeans(single, 2, start, criteria, 1, cv2.KMEANS_PP_CENTERS)
    tones = np.asarray(centers, dtype=np.float32)
    spread = float(np.median(np.linalg.norm(single - tones[np.asarray(label).ravel()], axis=1)))
    values = seen.values
    for tone in tones:
        own = np.broadcast_to(tone, seen.colors.shape)
        values = np.minimum(values, unshaded(seen.colors, own, 0))
    # A board's blurred rim has neither its colours nor the wall's.
    size = 2 * _grain_reach(seen) + 1
    window = np.ones((size, size), np.uint8)
    opened = np.asarray(cv2.morphologyEx(values, cv2.MORPH_OPEN, window), dtype=np.float32)
    return replace(seen, values=opened, thresholds=_cuts(opened, max(seen.noise, spread)))


def _grain_reach(seen: Contrast) -> int:
    return max(2, round(GRAIN_SHARE * seen.values.shape[1]))


def _cuts(values: Layer, noise: float) -> tuple[float, ...]:
    return tuple(dict.fromkeys((otsu_threshold(values.ravel()), FAINT * max(noise, LEAST_NOISE))))
