"""Outlines of heaps on photographs, with any wall, plate and light.

A large picture is searched on a reduced copy; the edge found there is refined at full size.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import cv2
import numpy as np

from imaging.flank.camera_height import level_angle
from imaging.flank.fit_settings import FitSettings
from imaging.flank.flank_line import fit_flanks
from imaging.flank.outline import Doubt, Outline, levelled
from imaging.flank.plate_line import PlateLine
from imaging.geometry import FloatArray, Picture
from imaging.photo.around_foot import NARROW_BASE, FoundHeap, darker_below, refuse_narrow_base, without_strays
from imaging.photo.background import Contrast, contrast_with_background
from imaging.photo.contrast_variants import cut_out, with_low_threshold, without_board, without_shadows
from imaging.photo.doubts import (
    LARGEST_LEAN,
    LARGEST_MISFIT,
    LARGEST_SHIFT,
    ROUGH_EDGE,
    doubts_of,
    relative_misfit,
)
from imaging.photo.heap_on_plate import locate_heap
from imaging.photo.view_settings import View
from imaging.photo.wall_shadow import MOST_SHADED, WIDELY_SHADED, shaded_edge, without_sharp_shadows
from imaging.picture_error import PictureError

NO_HEAP = 0.1
"""Misfit of the flanks' shape, in heights, above which it is no heap: half a circle has 0.075."""
CROOKED = 0.03
"""Misfit of the flanks' shape, in heights, above which other variants of the contrast are tried."""
NEARLY = 2.0
"""Factor between misfits above which only the better one shows the heap."""
WELL = 0.5
"""Misfit below which a heap counts whatever fits better: half of the limit for doubts."""
APART = 1.5
"""Factor between thresholds above which one confirms the other: at closer ones a shadow ends there too."""
AS_GOOD = 1.3
"""Factor within which misfits are equal: two thresholds on one heap differ by as much."""
LEAST_STEP = 15.0
"""Smallest difference of colours [of 255] across an edge that is refined."""
LARGEST_OTHER = 1.25
"""Change of the mean with the way to find the outline [degrees]."""
SIDE_HEIGHT = 0.15
"""Part of the height from which on a heap's width is measured: a plate and single grains are lower."""
SEARCHED_PIXELS = 800_000
"""Size of the copy on which a larger picture is searched [pixels]."""


def photographed_outline(picture: Picture, view: View, meters_per_pixel: float | None, place: str) -> Outline:
    """Find the heap of a photograph (see `find_outline`)."""
    part = view.inside(picture.shape, place)
    cut = picture[part]
    left, top = part[1].start, part[0].start
    factor = max(1, round(np.sqrt(cut.shape[0] * cut.shape[1] / SEARCHED_PIXELS)))
    small, given = _reduced(cut, factor), _given_plate(view, left, top, factor)
    found = find_heap(small, given, view, place)
    if view.elevation is not None:
        found = replace(found, elevation=view.elevation, elevation_se=0.0)
    columns, rows = found.edge()
    plate = found.plate
    if factor > 1:
        columns, rows = _refined(cut, columns, rows, factor)
        row = factor * (plate.row + 0.5) - 0.5 - plate.slope * (0.5 * factor - 0.5)
        plate = replace(plate, row=row)
    plate = replace(plate, row=plate.row - plate.slope * left + top)
    position, height = levelled(columns + left, rows + top, plate, place)
    width = float(np.ptp(position[height > SIDE_HEIGHT * height.max()])) / (1.0 - SIDE_HEIGHT)
    return Outline(
        position,
        height,
        plate,
        meters_per_pixel,
        elevation=found.elevation,
        elevation_se=found.elevation_se,
        distance=view.distance_of(width),
        nearest=view.nearest_of(width),
        photographed=True,
        doubts=found.doubts,
    )


def _refined(
    picture: Picture, columns: FloatArray, rows: FloatArray, factor: int
) -> tuple[FloatArray, FloatArray]:
    """Refine an edge at full size, given its columns and rows on the reduced copy.

    In each column the edge is where the colour is halfway between that above and that below a strip of
    `2 * factor` pixels about the coarse edge; where the two hardly differ, the coarse edge is kept.
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
    """Return the plate's line of the view in the reduced copy of the part."""
    if view.plate is None:
        return None
    x1, y1, x2, y2 = view.plate
    slope = (y2 - y1) / (x2 - x1)
    row = y1 - top + slope * (left - x1)
    return PlateLine((row + 0.5 - slope * (0.5 - 0.5 * factor)) / factor - 0.5, slope, visible=True)


def find_heap(picture: Picture, given: PlateLine | None, view: View, place: str) -> FoundHeap:
    """Find the heap in a picture of moderate size, at the threshold that shows it best.

    The edge of a heap does not depend on the threshold: the angle is in doubt where thresholds without doubts
    disagree about it.
    """
    seen = contrast_with_background(picture, place, np.float32)
    cut = _cut_out(seen, view, place) if given is None and view.heap is None else None
    try:
        found = _judged(seen, *_best_seen(seen, given, view, place), given, view, place)
    except PictureError:
        if cut is None:
            raise
        return cut
    if cut is None or cut.doubts or found.doubts:
        return found if cut is None or cut.doubts else cut
    shift = abs(_candidate(cut, place).mean - _candidate(found, place).mean)
    if shift <= LARGEST_OTHER:
        return found
    finding = f"cut out in another way, the angle changes by {shift:.1f} degrees, over {LARGEST_OTHER:g}"
    return replace(found, doubts=(Doubt("threshold", finding),))


def _cut_out(seen: Contrast, view: View, place: str) -> FoundHeap | None:
    """Return the only thing cut out that is a heap, without another doubt than a high camera's."""
    heaps = []
    for piece in cut_out(seen):
        for each in _candidates(piece, None, view, place)[0]:
            with suppress(PictureError):
                heap = _judged(seen, each, "", None, view, place)
                heaps.append(replace(heap, doubts=(*heap.doubts, *each.doubts)))
    sure = [heap for heap in heaps if {doubt.name for doubt in heap.doubts} <= {"elevation"}]
    return sure[0] if len(sure) == 1 else None


def _judged(
    seen: Contrast, best: Candidate, finding: str, given: PlateLine | None, view: View, place: str
) -> FoundHeap:
    """Doubt the best candidate by what is around it, or refuse it."""
    if best.crooked > NO_HEAP:
        finding = f"an outline that deviates from two lines by {best.crooked:.2f} of its height"
        raise PictureError(place, "no heap: two straight flanks must meet at its tip", finding)
    share, below = shaded_edge(seen, best.heap.rows, best.heap.plate)
    doubted = _doubt_of_shade(share, below, best, place)
    if share > MOST_SHADED:
        width = int(np.isfinite(best.heap.rows).sum())
        if lit := _without_sharp_shadow(seen, width, given, view, place):
            best, finding, doubted = lit, "", []
    doubts = list(best.heap.doubts)
    try:
        refuse_narrow_base(seen, best.heap, best.ends, place)
    except PictureError:
        if given is None:
            raise
        doubts.append(Doubt("plate", NARROW_BASE))
    if darker_below(seen, best.heap, best.ends):
        doubts.append(Doubt("shade", "it is darker below the heap than on both sides: a shadow, or a dish?"))
    doubts += doubted
    if best.clear and finding:
        doubts.append(Doubt("threshold", finding))
    return replace(best.heap, doubts=tuple(doubts))


def _best_seen(seen: Contrast, given: PlateLine | None, view: View, place: str) -> tuple[Candidate, str]:
    """Return the best candidate, and a finding that speaks against its edge, or an empty text.

    A variant of the contrast counts where it leaves fewer doubts than the plain contrast, leaves none where
    this shows no heap, or where the thresholds of this disagree.
    """
    candidates, errors = _candidates(with_low_threshold(seen), given, view, place)
    plain = [each for each in candidates if each.clear]
    best = _first_of_best(candidates)
    if best is None or not best.steady(plain) or best.crooked > CROOKED:
        others = _candidates(without_shadows(seen), given, view, place)[0]
        if best is None or not best.clear or best.crooked > CROOKED or best.shift(plain) > LARGEST_SHIFT:
            others += _candidates(without_board(seen), given, view, place)[0]
            if best is None:
                others = [each for each in others if each.clear]
            if best is None or best.clear or any(len(other.doubts) < len(best.doubts) for other in others):
                candidates = candidates + others
                best = _first_of_best(candidates)
            if best is None:
                raise errors[0]
        else:
            candidates = candidates + others
    shift = best.shift(candidates)
    if shift > LARGEST_SHIFT:
        return best, f"the angle changes by {shift:.1f} degrees with the threshold, over {LARGEST_SHIFT:g}"
    return best, ""


def _without_sharp_shadow(
    seen: Contrast, width: int, given: PlateLine | None, view: View, place: str
) -> Candidate | None:
    """Find the heap of a width without its sharp shadow; None unless both thresholds show it undoubted."""
    candidates, _ = _candidates(without_sharp_shadows(seen, width), given, view, place)
    firm = _first_of_best(candidates)
    if firm is None or len(candidates) < 2 or not all(each.clear for each in candidates):
        return None
    if firm.shift(candidates) > LARGEST_SHIFT:
        return None
    return firm if shaded_edge(seen, firm.heap.rows, firm.heap.plate)[0] <= MOST_SHADED else None


def _doubt_of_shade(share: float, rows: FloatArray, best: Candidate, place: str) -> list[Doubt]:
    """Doubt the angle where bands of shaded wall along a flank are long, or change the angle.

    Gaps between grains may be as even as a shadow and of the wall's hue, but they are short and shallow and
    do not change the angle.
    """
    if share <= MOST_SHADED:
        return []
    finding = f"{share:.2f} of a flank's edge has darker wall below it, and no grains: a sharp shadow?"
    if share <= WIDELY_SHADED:
        try:
            below = _candidate(replace(best.heap, rows=rows), place)
        except PictureError:
            return [Doubt("shade", finding)]
        if best.like(below):
            return []
    return [Doubt("shade", finding)]


def _candidates(
    seen: Contrast, given: PlateLine | None, view: View, place: str
) -> tuple[list[Candidate], list[PictureError]]:
    """Return the heaps at the thresholds of a contrast, and the errors of thresholds without a heap."""
    candidates, errors = [], []
    for threshold in seen.thresholds:
        try:
            heap = without_strays(locate_heap(seen, threshold, given, view, place))
            candidates.append(replace(_candidate(heap, place), threshold=threshold))
        except PictureError as error:
            errors.append(error)
    return candidates, errors


@dataclass(frozen=True)
class Candidate:
    """A found heap with the angle of its whole flanks [degrees], its doubts and its misfit.

    `crooked` is the misfit of the flanks alone, in heights (see `relative_misfit`); `ends` are the positions
    where the lines meet the plate, `threshold` is that of the contrast.
    """

    heap: FoundHeap
    mean: float
    doubts: tuple[Doubt, ...]
    misfit: float
    crooked: float
    ends: tuple[float, float]
    threshold: float = 0.0

    @property
    def clear(self) -> bool:
        """True where there is no doubt."""
        return not self.doubts

    def like(self, other: Candidate) -> bool:
        """Return True if the angles are equal within the change that a threshold may make."""
        return abs(other.mean - self.mean) <= LARGEST_SHIFT

    def steady(self, others: Sequence[Candidate]) -> bool:
        """Return True if there is no doubt, a distant threshold confirms it, and none of `others` differs."""
        low, high = self.threshold / APART, self.threshold * APART
        away = [other for other in others if not low < other.threshold < high]
        return self.clear and any(map(self.like, away)) and self.shift(others) <= LARGEST_SHIFT

    def shift(self, others: Sequence[Candidate]) -> float:
        """Return the greatest change of the angle [degrees] among others without doubts that fit well."""
        limit = max(NEARLY * self.misfit, WELL)
        rivals = [other for other in others if other.clear and other.misfit <= limit]
        return max((abs(other.mean - self.mean) for other in rivals), default=0.0)


def _first_of_best(candidates: Sequence[Candidate]) -> Candidate | None:
    """Return the first with the fewest doubts that fits about as well as the best of these."""
    fewest = min((len(each.doubts) for each in candidates), default=0)
    good = [each for each in candidates if len(each.doubts) == fewest]
    limit = AS_GOOD * min((each.misfit for each in good), default=0.0)
    return next((each for each in good if each.misfit <= limit), None)


def _candidate(heap: FoundHeap, place: str) -> Candidate:
    position, height = levelled(*heap.edge(), heap.plate, place)
    outline = Outline(position, height, heap.plate, elevation=heap.elevation)
    left, right = fit_flanks(outline, FitSettings.of("flank"), place)
    mean = 0.5 * (left.angle + right.angle)
    se = 0.5 * float(np.hypot(left.se, right.se))
    # An unusual angle does not mean that another threshold shows the heap better.
    doubted = doubts_of(left, right, mean, se, outline, ROUGH_EDGE)
    doubts = (*heap.doubts, *(doubt for doubt in doubted if doubt.name != "range"))
    lean = abs(left.angle - right.angle) / LARGEST_LEAN
    crooked = relative_misfit(left, right, outline)
    misfit = crooked / LARGEST_MISFIT + lean
    ends = (-left.intercept / left.slope, -right.intercept / right.slope)
    return Candidate(heap, level_angle(mean, heap.elevation), doubts, misfit, crooked, ends)
