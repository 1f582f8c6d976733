"""Reasons to doubt an angle: each a rule with its limit, what was found, and why the limit is where it is."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from imaging.flanks import MINIMUM_FLANK_COLUMNS, FlankLine
from imaging.outline import Outline
from imaging.reasons import Doubt

LARGEST_LEAN = 4.0
"""Left and right flank [degrees]: heaps poured on a level plate stand within 2.5 of one another as a rule."""
LARGEST_ERROR = 0.75
"""Standard error of the mean [degrees]: 9 of 1371 rendered heaps had more, two of them wrong by over 1.7."""
ROUGH_EDGE = 1.0
"""The same from which on another look may show more: twice what a heap of twenty grains across has."""
LARGEST_UNSEEN_TILT = 5.0
"""Tilt [degrees] that is believed without a plate in view: hands hold a phone level within 3 or 4."""
LARGEST_TILT = 12.0
"""Tilt [degrees] that is believed with one: nobody holds a camera so, and a sliver has any."""
LEAST_ANGLE, GREATEST_ANGLE = 5.0, 60.0
"""Repose angles of dry grains [degrees] lie well within."""
LARGEST_ELEVATION = 12.0
"""Camera's height over the plate [degrees] up to which its effect, 2.3 degrees on a heap of 20, is taken out:
of ten rendered heaps seen from higher up three were wrong by a degree or more."""
LARGEST_MISFIT = 0.06
"""Root mean square of the outline's shape about its two lines, over its height: heaps of only twenty grains
across have up to 0.055, a parabola's dome 0.069, half a circle 0.075."""
SHAPE_PARTS = 6
"""Parts of a flank whose means are its shape; what is left is roughness."""
LARGEST_END = 0.3
"""Height of the outline's end over the heap's: a heap ends a grain high, a dish's wall higher."""
LEAST_END = 3.0
"""Rise at an end [pixels] below which it is the blur of an edge."""
LEAST_FOOT_SLOPE = 0.6
"""Slope of a flank's lowest third over the rest's, or the reverse: it lies within for 19 heaps of 20."""
LARGEST_SHORTFALL = 0.08
"""Part of the base by which one foot ends further before its line meets the plate than the other does: feet
end alike (0.07 at most in 275 rendered heaps), and one in the shade may have the colour of the wall."""
LARGEST_CLIFF = 0.25
"""Part of the heap's height by which its outline falls at once towards the foot: 0.21 at most in 455 rendered
heaps, where grains stand on grains; a foot that is missed leaves an edge as high as what was missed."""
CLIFF_WIDTH = 0.008
"""Part of the outline's columns on either side whose medians are compared: more than one stray column."""
STEP_PARTS = 8
LEAST_STEP_SLOPE = 0.35
"""Slope between parts of a flank over that of its line: where a board's top stands inside an outline it is at
most 0.2, on 99 heaps of 100 above 0.5."""
END_WIDTH = 0.02
"""Part of the outline's columns that make its end."""
LARGEST_SHIFT = 1.0
"""Change of the mean [degrees] with the threshold: an edge stays where it is, a shadow's fades."""


def doubts_of(
    left: FlankLine,
    right: FlankLine,
    mean: float,
    se: float,
    outline: Outline,
    largest_error: float = LARGEST_ERROR,
) -> Iterator[Doubt]:
    """Go through the rules for an angle with its fitted lines; doubts of the outline itself are not repeated.

    Parameters
    ----------
    left, right : FlankLine
    mean, se : float
        Angle with its standard error [degrees].
    outline : Outline
    largest_error : float
        Standard error [degrees] that is believed.
    """
    lean = abs(left.angle - right.angle)
    if lean > LARGEST_LEAN:
        yield Doubt("lean", f"left and right are {lean:.1f} degrees apart, over {LARGEST_LEAN:g}")
    if se > largest_error:
        yield Doubt("error", f"a standard error of {se:.2f} degrees, over {largest_error:g}")
    if not LEAST_ANGLE <= mean <= GREATEST_ANGLE:
        yield Doubt("range", f"{mean:.1f} degrees, outside {LEAST_ANGLE:g} to {GREATEST_ANGLE:g}")
    if abs(outline.plate.tilt) > LARGEST_TILT:
        yield Doubt("tilt", f"{outline.plate.tilt:.1f} degrees, over {LARGEST_TILT:g}")
    if outline.elevation > LARGEST_ELEVATION:
        finding = f"the camera looks down by {outline.elevation:.0f} degrees, over {LARGEST_ELEVATION:g}"
        yield Doubt("elevation", finding)
    misfit = relative_misfit(left, right, outline)
    if misfit > LARGEST_MISFIT:
        yield Doubt(
            "straightness", f"flanks bend {misfit:.3f} heights off their lines, over {LARGEST_MISFIT:g}"
        )
    for line, side in ((left, "left"), (right, "right")):
        share = foot_slope(line, outline)
        if not LEAST_FOOT_SLOPE <= share <= 1.0 / LEAST_FOOT_SLOPE:
            finding = f"the {side} flank's lower third is {share:.2f} times as steep as the rest"
            yield Doubt(
                "foot", f"{finding}, beyond a factor of {1.0 / LEAST_FOOT_SLOPE:.2g}: a board, a shadow?"
            )
    short = foot_shortfall(left, right, outline)
    if short > LARGEST_SHORTFALL:
        finding = f"one foot ends {short:.2f} of the base further before its line does than the other"
        yield Doubt("foot", f"{finding}, over {LARGEST_SHORTFALL:g}: is it in the shade?")
    fall = highest_cliff(outline)
    if fall > LARGEST_CLIFF:
        finding = f"the outline falls by {fall:.2f} heights at once, over {LARGEST_CLIFF:g}"
        yield Doubt("foot", f"{finding}: is a part of the foot missed?")
    flattest = min(step_slope(line, outline) for line in (left, right))
    if flattest < LEAST_STEP_SLOPE:
        finding = f"a part of a flank is {max(flattest, 0.0):.2f} times as steep as its line"
        yield Doubt("step", f"{finding}, under {LEAST_STEP_SLOPE:g}: the top of a board?")
    end = highest_end(outline)
    if end > LARGEST_END and end * outline.height.max() > LEAST_END:
        yield Doubt(
            "ends", f"an end {end:.2f} heights over the plate, over {LARGEST_END:g}: a dish or board?"
        )


def relative_misfit(left: FlankLine, right: FlankLine, outline: Outline) -> float:
    """Root mean square of an outline's shape about its two lines, over its height."""
    means = []
    for line in (left, right):
        covered = (outline.position >= line.start) & (outline.position <= line.stop)
        residual = outline.height[covered] - line.intercept - line.slope * outline.position[covered]
        means += [float(part.mean()) for part in np.array_split(residual, min(SHAPE_PARTS, len(residual)))]
    return float(np.sqrt(np.mean(np.square(means))) / outline.height.max())


def foot_slope(line: FlankLine, outline: Outline) -> float:
    """Slope of the lowest third of a flank over that of the rest; 1 where it has too few columns."""
    covered = (outline.position >= line.start) & (outline.position <= line.stop)
    x, h = outline.position[covered], outline.height[covered]
    if line.slope < 0.0:
        x, h = -x[::-1], h[::-1]
    third = len(x) // 3
    if third < MINIMUM_FLANK_COLUMNS:
        return 1.0
    low, high = (
        float((a - a.mean()) @ b / ((a - a.mean()) ** 2).sum())
        for a, b in ((x[:third], h[:third]), (x[third:], h[third:]))
    )
    return low / high if high > 0.0 else 0.0


def foot_shortfall(left: FlankLine, right: FlankLine, outline: Outline) -> float:
    """Part of the base by which one foot ends further before its line meets the plate than the other.

    It is 0 where the line is no higher there than an edge's blur.
    """
    feet = [-line.intercept / line.slope for line in (left, right)]
    short = np.array([outline.position.min() - feet[0], feet[1] - outline.position.max()])
    worst = int(short.argmax())
    if short[worst] * abs((left, right)[worst].slope) <= LEAST_END:
        return 0.0
    return float(short[worst] - max(short.min(), 0.0)) / (feet[1] - feet[0])


def highest_cliff(outline: Outline) -> float:
    """Greatest fall of an outline towards its feet, within the lowest quarter, over the greatest height."""
    heights, width = outline.height, max(3, round(CLIFF_WIDTH * len(outline.height)))
    levels = np.median(sliding_window_view(heights, width), axis=1)
    before, after = levels[:-width], levels[width:]
    falls = np.where(np.arange(len(before)) + width <= heights.argmax(), after - before, before - after)
    low = np.minimum(before, after) < heights.max() / 4
    return float(falls.max(where=low, initial=0.0) / heights.max())


def step_slope(line: FlankLine, outline: Outline) -> float:
    """Least slope between parts of a flank over that of its line, its foot and its tip left out."""
    covered = (outline.position >= line.start) & (outline.position <= line.stop)
    x, h = outline.position[covered], outline.height[covered]
    if line.slope < 0.0:
        x, h = -x[::-1], h[::-1]
    if len(x) < STEP_PARTS * MINIMUM_FLANK_COLUMNS:
        return 1.0
    middles, means = (
        np.array([part.mean() for part in np.array_split(values, STEP_PARTS)]) for values in (x, h)
    )
    slopes = np.diff(means) / np.diff(middles) / abs(line.slope)
    return float(slopes[1 : STEP_PARTS - 3].min())


def highest_end(outline: Outline) -> float:
    """Height of the higher end of an outline over the greatest height."""
    width = max(3, round(END_WIDTH * len(outline.height)))
    ends = [np.median(outline.height[:width]), np.median(outline.height[-width:])]
    return float(max(ends) / outline.height.max())
