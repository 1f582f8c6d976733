"""Rules that doubt an angle, with their limits."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from imaging.flank.camera_height import near_change
from imaging.flank.flank_line import MINIMUM_FLANK_COLUMNS, FlankLine
from imaging.flank.outline import Doubt, Outline
from imaging.geometry import FloatArray

LARGEST_LEAN = 4.0
"""Difference of left and right flank [degrees]: heaps on a level plate have up to 2.5 as a rule."""
LARGEST_ERROR = 0.75
"""Standard error of the mean [degrees]: 9 of 1371 rendered heaps had more."""
ROUGH_EDGE = 1.0
"""Standard error above which variants of the contrast are tried: twice that of twenty grains across."""
LARGEST_UNSEEN_TILT = 5.0
"""Tilt without a visible plate [degrees]: hands hold a phone level within 3 or 4."""
LARGEST_TILT = 12.0
"""Tilt with a visible plate [degrees]."""
LARGEST_ELEVATION = 13.0
"""Angle at which the camera looks down [degrees] whose effect is corrected (3.9 degrees on a heap of 20)."""
LARGEST_NEAR_CHANGE = 2.0
"""Change of the angle if the camera had the widest usual lens, plus the standard error [degrees]."""
LARGEST_MISFIT = 0.06
"""Root mean square of the outline's shape about its two lines, over its height: heaps of twenty grains across
have up to 0.055, a parabola 0.069, half a circle 0.075."""
SHAPE_PARTS = 6
"""Parts of a flank whose means are its shape; the rest is roughness."""
LARGEST_END = 0.3
"""Height of the outline's end over the heap's: a heap ends a grain high, a dish's wall higher."""
LEAST_END = 3.0
"""Rise at an end [pixels] below which it is a blurred edge."""
LEAST_FOOT_SLOPE = 0.6
"""Slope of a flank's lowest third over the rest's, or the reverse: 95 % of heaps are within."""
LARGEST_SHORTFALL = 0.08
"""Difference of the gaps between each foot and its line's end, over the base: 0.07 at most in 275 rendered
heaps. A foot in the shade may have the colour of the wall."""
LARGEST_CLIFF = 0.25
"""Step of the outline towards the foot, over the heap's height: 0.21 at most in 455 rendered heaps. A missed
foot leaves a step."""
CLIFF_WIDTH = 0.008
"""Part of the outline's columns on either side whose medians are compared: more than one stray column."""
STEP_PARTS = 8
LEAST_STEP_SLOPE = 0.35
"""Slope between parts of a flank over that of its line: the top of a board has at most 0.2, 99 % of heaps
have over 0.5."""
END_WIDTH = 0.02
"""Part of the outline's columns that are its end."""
LARGEST_SHIFT = 1.0
"""Change of the mean with the threshold [degrees]: that of an edge is small, that of a shadow is not."""


def doubts_of_mean(
    mean: float, se: float, largest_error: float, whole: float = 0.0, usual: tuple[float, float] = (5.0, 60.0)
) -> Iterator[Doubt]:
    """Doubt a large standard error, the `whole` of which may have more parts, and an unusual angle."""
    if se > largest_error:
        yield Doubt("error", f"a standard error of {whole or se:.2f} degrees, over {largest_error:g}")
    if not usual[0] <= mean <= usual[1]:
        yield Doubt("range", f"{mean:.1f} degrees, outside {usual[0]:g} to {usual[1]:g}")


def doubts_of(
    left: FlankLine,
    right: FlankLine,
    mean: float,
    se: float,
    outline: Outline,
    largest_error: float = LARGEST_ERROR,
    whole: float = 0.0,
) -> Iterator[Doubt]:
    """Apply the rules to an angle with its lines' standard error; the outline's own are not repeated."""
    lean = abs(left.angle - right.angle)
    if lean > LARGEST_LEAN:
        yield Doubt("lean", f"left and right are {lean:.1f} degrees apart, over {LARGEST_LEAN:g}")
    yield from doubts_of_mean(mean, se, largest_error, whole)
    if abs(outline.plate.tilt) > LARGEST_TILT:
        yield Doubt("tilt", f"{outline.plate.tilt:.1f} degrees, over {LARGEST_TILT:g}")
    if outline.elevation > LARGEST_ELEVATION:
        finding = f"the camera looks down by {outline.elevation:.0f} degrees, over {LARGEST_ELEVATION:g}"
        yield Doubt("elevation", finding)
    near = near_change(0.5 * (left.angle + right.angle), outline)
    if near and abs(near) + se > LARGEST_NEAR_CHANGE:
        finding = f"{near:+.1f} +- {se:.1f} degrees if the camera was {outline.nearest:.1f} heap widths away"
        yield Doubt("distance", f"{finding}, over {LARGEST_NEAR_CHANGE:g}: give its distance")
    misfit = relative_misfit(left, right, outline)
    if misfit > LARGEST_MISFIT:
        finding = f"the flanks deviate from their lines by {misfit:.3f} heights, over {LARGEST_MISFIT:g}"
        yield Doubt("straightness", finding)
    for line, side in ((left, "left"), (right, "right")):
        share = foot_slope(line, outline)
        if not LEAST_FOOT_SLOPE <= share <= 1.0 / LEAST_FOOT_SLOPE:
            finding = f"the {side} flank's lower third is {share:.2f} times as steep as the rest"
            limit = 1.0 / LEAST_FOOT_SLOPE
            cause = "few grains, a ragged edge?" if _is_ragged(line) else "a board, a shadow?"
            yield Doubt("foot", f"{finding}, beyond a factor of {limit:.2g}: {cause}")
    short = foot_shortfall(left, right, outline)
    if short > LARGEST_SHORTFALL:
        finding = f"one foot ends {short:.2f} of the base earlier than the other"
        yield Doubt("foot", f"{finding}, over {LARGEST_SHORTFALL:g}: is it in the shade?")
    fall = highest_cliff(outline)
    if fall > LARGEST_CLIFF:
        finding = f"the outline has a step of {fall:.2f} heights, over {LARGEST_CLIFF:g}"
        yield Doubt("foot", f"{finding}: is a part of the foot missing?")
    flattest = min(step_slope(line, outline) for line in (left, right))
    if flattest < LEAST_STEP_SLOPE:
        finding = f"a part of a flank is {max(flattest, 0.0):.2f} times as steep as its line"
        cause = (
            "few grains, a ragged edge?" if _is_ragged(left) or _is_ragged(right) else "the top of a board?"
        )
        yield Doubt("step", f"{finding}, under {LEAST_STEP_SLOPE:g}: {cause}")
    end = highest_end(outline)
    if end > LARGEST_END and end * outline.height.max() > LEAST_END:
        finding = f"an end is {end:.2f} heights over the plate, over {LARGEST_END:g}"
        yield Doubt("ends", f"{finding}: a dish or board?")


def relative_misfit(left: FlankLine, right: FlankLine, outline: Outline) -> float:
    """Return the root mean square of an outline's shape about its two lines, over its height."""
    means = []
    for line in (left, right):
        x, h = line.covered(outline)
        residual = h - line.intercept - line.slope * x
        means += [float(part.mean()) for part in np.array_split(residual, min(SHAPE_PARTS, len(residual)))]
    return float(np.sqrt(np.mean(np.square(means))) / outline.height.max())


def _rising(line: FlankLine, outline: Outline) -> tuple[FloatArray, FloatArray]:
    """Return positions and heights of a flank, mirrored so that it rises to the right."""
    x, h = line.covered(outline)
    return (-x[::-1], h[::-1]) if line.slope < 0.0 else (x, h)


def foot_slope(line: FlankLine, outline: Outline) -> float:
    """Return the slope of a flank's lowest third over that of the rest; 1 where it has too few columns."""
    x, h = _rising(line, outline)
    third = len(x) // 3
    if third < MINIMUM_FLANK_COLUMNS:
        return 1.0
    low, high = (
        float((a - a.mean()) @ b / ((a - a.mean()) ** 2).sum())
        for a, b in ((x[:third], h[:third]), (x[third:], h[third:]))
    )
    return low / high if high > 0.0 else 0.0


def _is_ragged(line: FlankLine) -> bool:
    """Return whether roughness alone may make a third of a flank as flat as `LEAST_FOOT_SLOPE`.

    The slope of a third has 3 ** 1.5 times the standard error of the whole flank's.
    """
    turn = np.radians(line.angle)
    relative = np.radians(line.se) / max(float(np.sin(turn) * np.cos(turn)), 1e-3)
    return bool(2.0 * 3.0**1.5 * relative > 1.0 - LEAST_FOOT_SLOPE)


def foot_shortfall(left: FlankLine, right: FlankLine, outline: Outline) -> float:
    """Return the difference of the gaps between each foot and its line's end, over the base.

    It is 0 where the line is no higher there than a blurred edge.
    """
    feet = [-line.intercept / line.slope for line in (left, right)]
    short = np.array([outline.position.min() - feet[0], feet[1] - outline.position.max()])
    worst = int(short.argmax())
    if short[worst] * abs((left, right)[worst].slope) <= LEAST_END:
        return 0.0
    return float(short[worst] - max(short.min(), 0.0)) / (feet[1] - feet[0])


def highest_cliff(outline: Outline) -> float:
    """Return the greatest step of an outline towards its feet, in the lowest quarter, over the height."""
    heights, width = outline.height, max(3, round(CLIFF_WIDTH * len(outline.height)))
    levels = np.median(sliding_window_view(heights, width), axis=1)
    before, after = levels[:-width], levels[width:]
    falls = np.where(np.arange(len(before)) + width <= heights.argmax(), after - before, before - after)
    low = np.minimum(before, after) < heights.max() / 4
    return float(falls.max(where=low, initial=0.0) / heights.max())


def step_slope(line: FlankLine, outline: Outline) -> float:
    """Return the least slope between parts of a flank, without foot and tip, over that of its line."""
    x, h = _rising(line, outline)
    if len(x) < STEP_PARTS * MINIMUM_FLANK_COLUMNS:
        return 1.0
    middles, means = (
        np.array([part.mean() for part in np.array_split(values, STEP_PARTS)]) for values in (x, h)
    )
    slopes = np.diff(means) / np.diff(middles) / abs(line.slope)
    return float(slopes[1 : STEP_PARTS - 3].min())


def highest_end(outline: Outline) -> float:
    """Return the height of the higher end of an outline over the greatest height."""
    width = max(3, round(END_WIDTH * len(outline.height)))
    ends = [np.median(outline.height[:width]), np.median(outline.height[-width:])]
    return float(max(ends) / outline.height.max())
