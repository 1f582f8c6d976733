"""Photographs to outlines: a heap before a wall, on a plate, under somebody's lamp, in somebody's hand.

A large picture is searched on a reduced copy; the edge that is found there is refined at full size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from imaging.errors import PictureError
from imaging.fits import FitSettings
from imaging.flanks import fit_flanks
from imaging.geometry import FloatArray, Picture
from imaging.outline import Outline, levelled
from imaging.photo.background import Contrast, contrast_with_background
from imaging.photo.doubts import (
    LARGEST_LEAN,
    LARGEST_MISFIT,
    LARGEST_SHIFT,
    ROUGH_EDGE,
    doubts_of,
    relative_misfit,
)
from imaging.photo.looks import apart_from_plate, grains_together, with_faint, without_shadows
from imaging.photo.shade import MOST_SHADED, WIDELY_SHADED, ShadedEdge, shaded_edge, without_sharp_shadows
from imaging.photo.sighting import Sighting, darker_below, refuse_brimful, sight, without_strays
from imaging.photo.view import View, level_angle
from imaging.plate import PlateLine
from imaging.reasons import Doubt

NO_HEAP = 0.1
"""Misfit of the flanks' shape, in heights, from which on it is no heap: half a circle, 0.075, is doubtful."""
CROOKED = 0.03
"""Misfit of the flanks' shape, in heights, that another look at the picture may better."""
NEARLY = 2.0
"""Factor between misfits beyond which the better one shows the heap, and the other something beside it."""
WELL = 0.5
"""Misfit up to which a heap is well shown, whatever shows it better: half of what is doubted."""
APART = 1.5
"""Factor between thresholds from which on one confirms the other: at nearer ones a shadow ends there too."""
AS_GOOD = 1.3
"""Factor between misfits that are about the same: two thresholds on one heap differ by as much."""
LEAST_STEP = 15.0
"""Difference of colours [of 255] across an edge below which it is not refined."""
SEARCHED_PIXELS = 800_000
"""A larger picture is searched on a copy of about this many pixels."""


def photographed_outline(picture: Picture, view: View, meters_per_pixel: float | None, place: str) -> Outline:
    """Find the heap of a photograph (see `find_outline`)."""
    part = view.inside(picture.shape, place)
    cut = picture[part]
    left, top = part[1].start, part[0].start
    factor = max(1, round(np.sqrt(cut.shape[0] * cut.shape[1] / SEARCHED_PIXELS)))
    sighting = find_heap(_reduced(cut, factor), _given_plate(view, left, top, factor), view, place)
    if view.elevation is not None:
        sighting = replace(sighting, elevation=view.elevation, elevation_se=0.0)
    columns = np.flatnonzero(np.isfinite(sighting.rows)).astype(np.float64)
    rows = sighting.rows[columns.astype(np.intp)]
    plate = sighting.plate
    if factor > 1:
        columns, rows = _refined(cut, columns, rows, factor)
        row = factor * (plate.row + 0.5) - 0.5 - plate.slope * (0.5 * factor - 0.5)
        plate = replace(plate, row=row)
    plate = replace(plate, row=plate.row - plate.slope * left + top)
    position, height = levelled(columns + left, rows + top, plate, place)
    return Outline(
        position,
        height,
        plate,
        meters_per_pixel,
        elevation=sighting.elevation,
        elevation_se=sighting.elevation_se,
        distance=view.distance_of(float(np.ptp(position))),
        photographed=True,
        doubts=sighting.doubts,
    )


def _refined(
    picture: Picture, columns: FloatArray, rows: FloatArray, factor: int
) -> tuple[FloatArray, FloatArray]:
    """Columns and rows of an edge at full size, from those on the reduced copy.

    In each column the edge is where the colour is halfway from that above the strip of `2 * factor` pixels
    about the coarse edge to that below it; where the two hardly differ, the coarse edge stays.
    """
    coarse_columns, coarse_rows = (factor * (value + 0.5) - 0.5 for value in (columns, rows))
    fine = np.arange(np.ceil(coarse_columns[0]), np.floor(coarse_columns[-1]) + 1)
    coarse = np.interp(fine, coarse_columns, coarse_rows)
    reach = 2 * factor
    middle = np.rint(coarse).astype(np.intp)
    strip = np.clip(middle + np.arange(-reach, reach + 1)[:, None], 0, picture.shape[0] - 1)
    colors = picture[strip, fine.astype(np.intp)].reshape(*strip.shape, -1).astype(np.float32)
    above, below = (
        cv2.blur(part.mean(axis=0)[None], (2 * factor + 1, 1)).reshape(len(fine), -1)
        for part in (colors[:factor], colors[-factor:])
    )
    step = below - above
    size = np.einsum("ij,ij->i", step, step)
    share = np.einsum("kij,ij->ki", colors - above, step) / np.maximum(size, 1.0)
    inside = share >= 0.5
    first = np.maximum(inside.argmax(axis=0), 1)
    column = np.arange(len(fine))
    before, after = share[first - 1, column], share[first, column]
    part = np.clip((after - 0.5) / np.maximum(after - before, 1e-6), 0.0, 1.0)
    found = middle - reach + first - part
    sure = (size >= LEAST_STEP**2) & inside.any(axis=0) & ~inside[0]
    return fine, np.where(sure, found, coarse)


def _reduced(picture: Picture, factor: int) -> Picture:
    if factor == 1:
        return picture
    rows, columns = (size // factor for size in picture.shape[:2])
    whole = picture[: rows * factor, : columns * factor]
    return np.asarray(cv2.resize(whole, (columns, rows), interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _given_plate(view: View, left: int, top: int, factor: int) -> PlateLine | None:
    """The plate's line as a person gave it, in the reduced copy of the part."""
    if view.plate is None:
        return None
    x1, y1, x2, y2 = view.plate
    slope = (y2 - y1) / (x2 - x1)
    row = y1 - top + slope * (left - x1)
    return PlateLine((row + 0.5 - slope * (0.5 - 0.5 * factor)) / factor - 0.5, slope, visible=True)


def find_heap(picture: Picture, given: PlateLine | None, view: View, place: str) -> Sighting:
    """Find the heap in a picture of moderate size: of several thresholds the one that shows it best.

    An edge of a heap stays where it is whatever the threshold; where those that show a heap without a doubt
    disagree on its angle, there is one.
    """
    seen = contrast_with_background(picture, place, np.float32)
    best, finding = _best_seen(seen, given, view, place)
    if best.crooked > NO_HEAP:
        rule = "expected two straight flanks meet at the tip of a heap"
        raise PictureError(place, rule, f"no heap: an outline {best.crooked:.2f} of its height off two lines")
    shaded = shaded_edge(seen, best.sighting.rows, best.sighting.plate)
    doubted = _doubt_of_shade(shaded, best, place)
    if shaded.share > MOST_SHADED:
        width = int(np.isfinite(best.sighting.rows).sum())
        if lit := _without_sharp_shadow(seen, width, given, view, place):
            best, finding, doubted = lit, "", []
    if given is None:
        refuse_brimful(seen, best.sighting, best.ends, place)
    doubts = list(best.sighting.doubts)
    if given is None and darker_below(seen, best.sighting, best.ends):
        doubts.append(
            Doubt("shade", "what is below the whole heap is darker than beside it: its shadow, or a dish?")
        )
    doubts += doubted
    if best.clear and finding:
        doubts.append(Doubt("threshold", finding))
    return replace(best.sighting, doubts=tuple(doubts))


def _best_seen(seen: Contrast, given: PlateLine | None, view: View, place: str) -> tuple[Judged, str]:
    """The heap that shows best, and what speaks against where its edge is, if anything does.

    Another look counts where it leaves fewer doubts than the plain one, none where this refuses, or where its
    thresholds disagree.
    """
    tries, errors = _tries(with_faint(seen), given, view, place)
    plain = [judged for judged in tries if judged.clear]
    best = _first_of_best(tries)
    filled: list[Judged] = []
    if best is None or not best.steady(plain) or best.crooked > CROOKED:
        shadowless, _ = _tries(without_shadows(seen), given, view, place)
        others = list(shadowless)
        if best is None or not best.clear or best.crooked > CROOKED or best.shift(plain) > LARGEST_SHIFT:
            filled, _ = _tries(grains_together(seen), given, view, place)
            others += filled + _tries(apart_from_plate(seen), given, view, place)[0]
            if best is None:
                others = [judged for judged in others if judged.clear]
            if best is None or best.clear or any(len(other.doubts) < len(best.doubts) for other in others):
                tries = tries + others
                best = _first_of_best(tries)
            if best is None:
                raise errors[0]
        else:
            tries = tries + others
        if best.clear and best.shift(tries) > LARGEST_SHIFT:
            best, tries = _without_its_shadow(best, plain, shadowless, tries)
    if any(best is judged for judged in filled) and not best.confirmed(tries):
        return best, "no other threshold shows a heap like this, of grains in part as light as the wall"
    shift = best.shift(tries)
    if shift > LARGEST_SHIFT:
        return best, f"the angle moves by {shift:.1f} degrees with the threshold, over {LARGEST_SHIFT:g}"
    return best, ""


def _without_its_shadow(
    best: Judged, plain: list[Judged], shadowless: list[Judged], tries: list[Judged]
) -> tuple[Judged, list[Judged]]:
    """The best one, and what it has to agree with, where a shadow alone moves the edge with the threshold.

    That is so where the look without shadows shows one edge at both of its thresholds, and so does one of the
    plain ones, or there is only one of them, without any to confirm it.
    """
    if len(shadowless) < 2 or not all(judged.clear for judged in shadowless):
        return best, tries
    firm = min(shadowless, key=lambda judged: judged.misfit)
    if firm.shift(shadowless) > LARGEST_SHIFT or firm.misfit > max(NEARLY * best.misfit, WELL):
        return best, tries
    if len(plain) > 1 and not any(firm.like(judged) for judged in plain):
        return best, tries
    return best if firm.like(best) else firm, shadowless


def _without_sharp_shadow(
    seen: Contrast, width: int, given: PlateLine | None, view: View, place: str
) -> Judged | None:
    """The heap, about so wide, without its sharp shadow, where both thresholds show it without a doubt."""
    tries, _ = _tries(without_sharp_shadows(seen, width), given, view, place)
    firm = _first_of_best(tries)
    if firm is None or len(tries) < 2 or not all(judged.clear for judged in tries):
        return None
    if firm.shift(tries) > LARGEST_SHIFT:
        return None
    shaded = shaded_edge(seen, firm.sighting.rows, firm.sighting.plate)
    return firm if shaded.share <= MOST_SHADED else None


def _doubt_of_shade(shaded: ShadedEdge, best: Judged, place: str) -> list[Doubt]:
    """A doubt where bands of shaded wall lie along much of a flank, or the angle without them is another one.

    Some windows between grains are as even as a shadow and of the wall's hue, above all before a wall whose
    pattern widens what counts as its hue: so short, and so shallow, they make nothing of the angle.
    """
    if shaded.share <= MOST_SHADED:
        return []
    found = f"{shaded.share:.2f} of a flank's edge has wall below it, darker, and no grains: a sharp shadow?"
    if shaded.share <= WIDELY_SHADED:
        try:
            below = _judged(replace(best.sighting, rows=shaded.rows), place)
        except PictureError:
            return [Doubt("shade", found)]
        if best.like(below):
            return []
    return [Doubt("shade", found)]


def _tries(
    seen: Contrast, given: PlateLine | None, view: View, place: str
) -> tuple[list[Judged], list[PictureError]]:
    """Heaps at the thresholds of a contrast, and why others show none."""
    tries, errors = [], []
    for threshold in seen.thresholds:
        try:
            found = without_strays(sight(seen, threshold, given, view, place))
            tries.append(replace(_judged(found, place), threshold=threshold))
        except PictureError as error:
            errors.append(error)
    return tries, errors


@dataclass(frozen=True)
class Judged:
    """A sighting with the angle of its whole flanks [degrees], what speaks against it, and its misfit.

        `crooked` is the misfit of its flanks alone, in heights (see `relative_misfit`); `ends` are where its
    lines meet the plate, `threshold` is where the contrast was cut.
    """

    sighting: Sighting
    mean: float
    doubts: tuple[Doubt, ...]
    misfit: float
    crooked: float
    ends: tuple[float, float]
    threshold: float = 0.0

    @property
    def clear(self) -> bool:
        """There is no doubt."""
        return not self.doubts

    def like(self, other: Judged) -> bool:
        """The angles are the same within what a threshold may change."""
        return abs(other.mean - self.mean) <= LARGEST_SHIFT

    def confirmed(self, others: Sequence[Judged]) -> bool:
        """Another one, doubtful or not, has about the same angle."""
        return any(self.like(other) for other in others if other is not self)

    def steady(self, others: Sequence[Judged]) -> bool:
        """There is no doubt, one at quite another threshold confirms it, and none of `others` disagrees."""
        low, high = self.threshold / APART, self.threshold * APART
        away = [other for other in others if not low < other.threshold < high]
        return self.clear and self.confirmed(away) and self.shift(others) <= LARGEST_SHIFT

    def shift(self, others: Sequence[Judged]) -> float:
        """Greatest change of the angle [degrees] among others without a doubt that fit well or nearly so."""
        limit = max(NEARLY * self.misfit, WELL)
        rivals = [other for other in others if other.clear and other.misfit <= limit]
        return max((abs(other.mean - self.mean) for other in rivals), default=0.0)


def _first_of_best(tries: Sequence[Judged]) -> Judged | None:
    """The first with the fewest doubts that fits about as well as the best of these."""
    fewest = min((len(judged.doubts) for judged in tries), default=0)
    good = [judged for judged in tries if len(judged.doubts) == fewest]
    limit = AS_GOOD * min((judged.misfit for judged in good), default=0.0)
    return next((judged for judged in good if judged.misfit <= limit), None)


def _judged(sighting: Sighting, place: str) -> Judged:
    columns = np.flatnonzero(np.isfinite(sighting.rows)).astype(np.float64)
    rows = sighting.rows[columns.astype(np.intp)]
    position, height = levelled(columns, rows, sighting.plate, place)
    outline = Outline(position, height, sighting.plate, elevation=sighting.elevation)
    left, right = fit_flanks(outline, FitSettings.of("flank"), place)
    mean = 0.5 * (left.angle + right.angle)
    se = 0.5 * float(np.hypot(left.se, right.se))
    # An angle that no grain has does not say that another look would show the heap better.
    judged = doubts_of(left, right, mean, se, outline, ROUGH_EDGE)
    found = (doubt for doubt in judged if doubt.name != "range")
    doubts = (*sighting.doubts, *found)
    lean = abs(left.angle - right.angle) / LARGEST_LEAN
    crooked = relative_misfit(left, right, outline)
    misfit = crooked / LARGEST_MISFIT + lean
    ends = (-left.intercept / left.slope, -right.intercept / right.slope)
    return Judged(sighting, level_angle(mean, sighting.elevation), doubts, misfit, crooked, ends)
