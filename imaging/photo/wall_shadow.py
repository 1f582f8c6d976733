"""Sharp shadows on the wall next to a heap: the wall's own colour and texture, with less light.

Under a flash or a bare bulb a shadow's edge is as sharp as the heap's, whatever the threshold. But the area
inside it has the hue of the wall, and no grains.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from imaging.flank.plate_line import PlateLine
from imaging.geometry import FloatArray, Layer
from imaging.photo.background import LEAST_NOISE, Contrast, inner, otsu_threshold, unevenness

DARKEST, LIGHTEST = 0.2, 0.95
"""Share of the light in a sharp shadow; lighter shadows hardly differ from the wall."""
HUE_NOISE, HUE_DIFFERENCE = 4.0, 8.0
"""Largest difference of a shadow's hue from the wall's, in multiples of the wall's noise, and [of 255]: a
second lamp tints a shadow by as much."""
CALM_SHARE = 0.006
"""Radius of a window with parts of some grains, in the heap's widths."""
WALL_CALM = 0.9
"""Part of the wall that counts as even."""
CALM = 1.3
"""Largest unevenness of a shadow over that of the wall: a shadow dims the texture, but not the noise."""
EDGE = 2
"""Depth of a blurred edge [pixels], which has neither side's colour."""
BAND = 0.04
"""Least depth of a band along the edge, in heights: along a whole flank it makes some tenths of a degree."""
MOST_SHADED = 0.1
"""Largest share of a flank's columns with such a band at a heap's own edge: gaps between black grains may be
even."""
WIDELY_SHADED = 0.25
"""Share above which the edge is doubted whatever its effect on the angle: with textured walls shadows of 2
degrees had 0.4 and more."""
PARTLY = 0.5
"""Share of a heap's middle with the wall's hue and no grains above which it is a grey powder, whose edge is
its own if it is as light as the middle."""
SAME_LIGHT = 1.25
"""Factor within which two parts of a powder are equally light: a lamp makes one flank darker."""
CORE = 0.15
"""Half width of the middle, in widths."""
LOWER_CUT = 0.6
"""Second threshold over the first: a blurred edge would move between them."""
SPECK = 5
"""Width of removed specks [pixels]: the rim of a shadow is uneven."""


def shaded_edge(seen: Contrast, rows: FloatArray, plate: PlateLine) -> tuple[float, FloatArray]:
    """Find bands of shaded wall below the upper edge of a heap, given as rows (NaN outside the heap).

    The first is the share of the edge with such a band below it, on the flank that has more; the second the
    edge below these bands, (columns,).

    A grey powder in front of a white wall is as even as its shadow; there only a different lightness counts.
    """
    columns = np.flatnonzero(np.isfinite(rows))
    edge, ground = rows[columns], np.minimum(plate.rows_at(columns), len(seen.values))
    height = np.maximum(ground - edge, 0.0)
    dimming = _dimming(seen)[:, columns]
    like = _like_wall(seen, len(columns))[:, columns]
    row = np.arange(len(like))[:, None]
    tip, tallest = int(height.argmax()), float(height.max())
    middle = slice(max(tip - round(CORE * len(columns)), 0), tip + round(CORE * len(columns)) + 1)
    inner = ((row >= edge + 0.25 * height) & (row < ground - 0.1 * height))[:, middle]
    if not inner.any():
        return 0.0, rows
    alike = float(like[:, middle][inner].mean())
    within = float(np.median(dimming[:, middle][inner])) if alike > PARTLY else None
    first = np.ceil(edge) + EDGE
    other = (~like & (row >= first)) | (row >= ground)
    depth = np.where(other.any(axis=0), other.argmax(axis=0), len(like)) - first
    deep = depth > BAND * tallest
    share, lower = 0.0, rows.copy()
    for flank in (slice(None, tip), slice(tip, None)):
        if not deep[flank].any():
            continue
        band = (row >= first) & (row <= first + BAND * tallest) & deep
        light = float(np.median(dimming[:, flank][band[:, flank]]))
        if within is None or not 1.0 / SAME_LIGHT < light / within < SAME_LIGHT:
            share = max(share, float(deep[flank].mean()))
            lower[columns[flank]] = np.where(deep, first + depth, edge)[flank]
    return share, lower


def without_sharp_shadows(seen: Contrast, width: int) -> Contrast:
    """Remove the shaded wall up to a shadow's sharp edge, for a heap of a width."""
    dimming = np.clip(_dimming(seen), DARKEST, 1.0)
    away = _distance(seen.colors - dimming[:, :, None] * seen.background)
    values = np.hypot(away, _calm(seen.colors, width))
    window = np.ones((SPECK, SPECK), np.uint8)
    opened = np.asarray(cv2.morphologyEx(values, cv2.MORPH_OPEN, window), dtype=np.float32)
    cut = otsu_threshold(opened.ravel())
    return replace(seen, values=opened, thresholds=(cut, LOWER_CUT * cut))


def _like_wall(seen: Contrast, width: int) -> NDArray[np.bool_]:
    """Find pixels of the wall's hue that are darker, and no more uneven than the wall."""
    dimming = _dimming(seen)
    away = _distance(seen.colors - dimming[:, :, None] * seen.background)
    calm = _calm(seen.colors, width)
    wall = calm[seen.values < min(seen.thresholds)]
    even = CALM * float(np.quantile(wall, WALL_CALM)) + LEAST_NOISE if wall.size else LEAST_NOISE
    hue = max(HUE_NOISE * seen.noise, HUE_DIFFERENCE)
    return np.asarray(
        (dimming > DARKEST) & (dimming < LIGHTEST) & (away < hue) & (calm < even), dtype=np.bool_
    )


def _dimming(seen: Contrast) -> Layer:
    """Share of the wall's light at each pixel, as far as its colour is the wall's."""
    own = seen.background
    power = np.maximum(inner(own, own), LEAST_NOISE)
    return np.asarray(inner(seen.colors, own) / power)


def _distance(difference: Layer) -> Layer:
    return np.asarray(np.sqrt(inner(difference, difference)))


def _calm(colors: Layer, width: int) -> Layer:
    """Unevenness in the most even window with the pixel: at an edge that of its own side."""
    reach = max(2, round(CALM_SHARE * width))
    window = np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)
    return np.asarray(cv2.erode(unevenness(colors, reach), window))
