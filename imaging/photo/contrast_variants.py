"""Variants of a photograph's contrast, for pictures whose plain contrast does not show one clear heap."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

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
COLORS, CUT_WIDTH, CUT_MARGIN, CUT_ROUNDS = 3, 320, 0.04, 4
"""Channels of a picture that is cut, width of its copy [pixels], its margin without a heap, and rounds."""
CUT_LIGHT, CUT_LEAST = (0.75, 1.35), 14.0
"""Factors between the light on one surface, and least difference of two surfaces [of 255]."""
PIECE_SHARE, LEAST_CUT = 0.1, 64
"""Least area of a piece, as a share of the largest, and of all that is cut out [pixels]."""


def with_low_threshold(seen: Contrast) -> Contrast:
    """Add a threshold just above the wall's noise."""
    faint = FAINT * max(seen.noise, LEAST_NOISE)
    return replace(seen, thresholds=tuple(dict.fromkeys((*seen.thresholds, faint))))


def without_shadows(seen: Contrast) -> Contrast:
    """Remove what may be a shadow on the wall."""
    values = unshaded(seen.colors, seen.background, _grain_reach(seen))
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


def cut_out(seen: Contrast) -> list[Contrast]:
    """Cut out each whole thing in front of wall and plate: contrasts of 100 within it and 0 outside.

    A graph cut (Rother, Kolmogorov and Blake, ACM Trans. Graphics 23, 2004) on a reduced copy begins with
    what differs, by more than a light does, from the wall and from both ends of its row.
    """
    rows, columns, channels = seen.colors.shape
    if channels != COLORS:
        return []
    factor = max(1, round(columns / CUT_WIDTH))
    _, labels, stats, _ = cv2.connectedComponentsWithStats(_cut(seen, (columns // factor, rows // factor)))
    areas = stats[:, cv2.CC_STAT_AREA] * ~np.isin(np.arange(len(stats)), (0, labels[0, 0]))  # no margin
    pieces = [labels == number for number in np.flatnonzero(areas > PIECE_SHARE * areas.max())]
    fronts = [cv2.resize(piece.astype(np.float32), (columns, rows)) for piece in pieces]
    return [replace(seen, values=_soft(seen.colors, front, factor), thresholds=(50.0,)) for front in fronts]


def _cut(seen: Contrast, size: tuple[int, int]) -> NDArray[np.uint8]:
    """Things in front of wall and plate, and the picture's margin, as 1 in a copy of this size."""
    shape, layers = size[::-1], (seen.colors, seen.background)
    small, wall = (
        cv2.resize(np.clip(each, 0.0, 255.0), size, interpolation=cv2.INTER_AREA).astype(np.float32)
        for each in layers
    )
    edge = max(2, round(CUT_MARGIN * min(size)))
    smooth = cv2.GaussianBlur(small, (0, 0), 1.0)
    left, right = (np.median(side, axis=1)[:, None] for side in (smooth[:, :edge], smooth[:, -edge:]))
    share = np.linspace(0.0, 1.0, size[0], dtype=np.float32)[None, :, None]
    like = np.zeros(shape, dtype=np.bool_)
    for own in (wall, left + share * (right - left), left, right):
        power = np.maximum((own * own).sum(axis=2), LEAST_NOISE)
        light = np.clip((smooth * own).sum(axis=2) / power, *CUT_LIGHT)
        like |= np.linalg.norm(smooth - light[:, :, None] * own, axis=2) < max(3.0 * seen.noise, CUT_LEAST)
    mask, inner = np.full(shape, cv2.GC_BGD, np.uint8), np.s_[edge:-edge, edge:-edge]
    mask[inner] = np.where(like, cv2.GC_PR_BGD, cv2.GC_PR_FGD)[inner]
    if min((mask == kind).sum() for kind in (cv2.GC_PR_BGD, cv2.GC_PR_FGD)) < LEAST_CUT:
        return np.zeros(shape, np.uint8)
    cv2.setRNGSeed(0)
    color, models, mode = small.astype(np.uint8), np.zeros((2, 1, 65)), cv2.GC_INIT_WITH_MASK
    cv2.grabCut(color, mask, (0, 0, 1, 1), models[0], models[1], CUT_ROUNDS, mode)
    front = (mask != cv2.GC_PR_BGD).astype(np.uint8)
    return np.asarray(cv2.morphologyEx(front, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)), dtype=np.uint8)


def _soft(colors: Layer, front: Layer, factor: int) -> Layer:
    """Contrast of a piece: an edge is where the colour is halfway between those near it on both sides."""
    window, size = np.ones((2 * factor + 1,) * 2, np.uint8), (6 * factor + 1,) * 2
    sides = [cv2.erode((side > 0.99).astype(np.float32), window) for side in (front, 1.0 - front)]
    totals = [np.maximum(cv2.blur(side, size), 1e-3) for side in sides]
    inside, outside = (
        cv2.blur(colors * side[:, :, None], size).reshape(colors.shape) / total[:, :, None]
        for side, total in zip(sides, totals, strict=True)
    )
    step = inside - outside
    share = ((colors - outside) * step).sum(axis=2) / np.maximum((step * step).sum(axis=2), CUT_LEAST**2)
    between = (sides[0] + sides[1] == 0.0) & (np.minimum(*totals) > 1e-3)
    return np.asarray(100.0 * np.where(between, np.clip(share, 0.0, 1.0), front > 0.5), dtype=np.float32)
