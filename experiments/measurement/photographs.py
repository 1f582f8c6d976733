"""Pictures and files of heaps to repose angles, their mean over heaps, and the target of a study."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from glob import glob
from pathlib import Path
from typing import Any

import numpy as np

from doe import Sample
from experiments.grains.spheres import require_known, require_no_text
from experiments.io.errors import InputError
from experiments.io.files import replacing
from experiments.measurement import drum_pictures
from experiments.measurement.duplicates import Duplicates
from experiments.measurement.heap_files import (
    READINGS,
    HeapSettings,
    is_heap_file,
    mean_values,
    measure_heap_file,
    values_of,
)
from experiments.studyfile.target_section import Grouping
from imaging import (
    FitSettings,
    PictureError,
    ReposeAngle,
    View,
    measure_photograph,
    overlay,
    overlay_drum,
    read_picture,
    save_picture,
)
from imaging.geometry import Picture
from imaging.repose import confidence_interval

SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp", ".heic", ".heif")
"""Endings of the pictures in a folder."""
USES = {
    "photograph": ("crop", "plate", "heap", "elevation", "distance", "focal_length", "least_focal_length"),
    "picture of a drum": ("crop", "drum", "circle", "diameter"),
    "file of spheres": ("unit", "plate_height", "types"),
}
"""Known facts that the measurement of each subject uses."""
LEVEL = 0.95
"""Confidence level of all intervals."""
ROW_VALUES = (
    "left", "right", "mean", "se", "low", "high", "tilt", "elevation", "distance", "plate", "heap_pixels",
    *READINGS,
)  # fmt: skip
"""Measured values of a row."""
NOT_IN_NAMES = str.maketrans("", "", '/\\:*?"<>|')
"""Characters that some systems do not allow in file names."""

Row = dict[str, Any]
"""Measurement of one picture, see `measure_pictures`."""


@dataclass(frozen=True)
class PictureOptions:
    """Options of the measurement of pictures and of their mean."""

    fit: str = "flank"
    """Name of a fit, one of ``imaging.FITS``."""
    view: View = field(default_factory=View)
    """Known facts of every picture."""
    heaps: HeapSettings = field(default_factory=HeapSettings)
    """Known facts of every file of spheres."""
    by: Grouping = "picture"
    """Pictures of one heap: each picture is another heap, or each folder is one heap."""
    keep_doubtful: bool = False
    """True: doubtful pictures count in the mean."""
    drum: bool = False
    """True: the pictures show rotating drums, along the axis."""
    diameter: float | None = None
    """Inner diameter of the drum [m]; None: heights are in radii of the drum."""

    @property
    def subject(self) -> str:
        """Subject of the pictures: heap, or drum."""
        return drum_pictures.DRUM if self.drum else "heap"

    def require_used(self, picture: Path) -> None:
        """Refuse known facts that the measurement of a picture would not use."""
        facts = vars(self.view) | vars(self.heaps) | {"drum": self.drum or None, "diameter": self.diameter}
        photograph, drum, spheres = USES
        subject = spheres if is_heap_file(picture) else drum if self.drum else photograph
        for right, names in USES.items():
            if wrong := [n for n in names if n not in USES[subject] and facts[n] not in (None, ())]:
                problem = f"is for a {right}; this file is read as a {subject}"
                alone = "Leave it out, or measure this file by itself."
                hint = "Use --drum." if (right, subject) == (drum, photograph) else alone
                raise InputError(f"{picture}, {wrong[0]}", problem, hint=hint)

    def heap_of(self, picture: Path, number: int) -> Hashable:
        """Return the heap that a picture shows, given its number."""
        return picture.parent if self.by == "folder" else number


def find_pictures(pattern: str, folder: Path, place: str, by: Grouping = "picture") -> list[Path]:
    """Find the pictures of a folder, or of a pattern like ``photos/*.jpg``, relative to ``folder``."""
    named = folder / pattern
    if os.path.isdir(named):  # unlike Path.is_dir, it accepts names that are too long
        inner = named.rglob("*") if by == "folder" else named.iterdir()
        found = sorted(path for path in inner if path.suffix.lower() in SUFFIXES)
    else:
        found = sorted(map(Path, glob(str(named))))
    if len(found) < 2:
        raise InputError(place, f"needs at least two pictures of heaps ({len(found)} at {named})", pattern)
    return found


def expanded(paths: Sequence[Path]) -> list[Path]:
    """Return paths with the files for each pattern like ``photos/*.jpg`` that names no file itself, sorted.

    Shells of Windows leave such patterns to the program, as all shells do between quotes.
    """
    found = ([path] if os.path.lexists(path) else sorted(map(Path, glob(str(path)))) for path in paths)
    return [each for path, files in zip(paths, found, strict=True) for each in files or [path]]


def require_separate(pictures: Sequence[Path], options: PictureOptions, place: str) -> None:
    """Refuse pictures of different heaps with the same content; raise `InputError` with both."""
    given = Duplicates()
    for number, picture in enumerate(pictures, start=1):
        if picture.is_file():
            heap = options.heap_of(picture, number)
            given.add_file(picture, heap, str(picture), f"{place}: picture {number}")


def measure_pictures(
    pictures: Sequence[Path],
    options: PictureOptions | None = None,
    overlay_folder: Path | None = None,
    watch: Callable[[int], None] = lambda done: None,
) -> list[Row]:
    """Measure the repose angle of each picture, or file of spheres; a failed one does not affect the others.

    The overlay folder gets copies with the fitted flanks: ``NAME-angle.png`` for each picture, with its
    folder's name where two have one name; for spheres also ``NAME-angle-clean.png``, without flanks. `watch`
    is called with the number of measured pictures.

    Returns
    -------
    list of dict
        For each picture: ``picture``, ``source`` (photograph, or the format of a heap's file and the part of
        it that was used), ``fit``, ``left``, ``right``, ``mean``, ``se``, the ends ``low`` and ``high`` of
        the 95 % interval, ``tilt`` and ``elevation`` of the camera [degrees], its ``distance`` [heap widths]
        where it is known, the ``plate``'s line (x1, y1, x2, y2) and the heap's width ``heap_pixels``
        [pixels], all None for a failed one; ``correction``, the seen lines in words where the angles are
        corrected for the camera's height; ``line_angle``, ``middle_angle``, ``height_angle``,
        ``centre_angle`` and ``volume_angle``, what other readings of the outline give; ``doubts``, a list
        of sentences; ``overlay``, the drawn copy or None; ``reason`` of a failure, else empty. Of a drum
        `drum_pictures.row_values` between ``source`` and ``correction``.
    """
    options = options or PictureOptions()
    FitSettings.of(options.fit)
    if overlay_folder and any(folder.is_file() for folder in (overlay_folder, *overlay_folder.parents)):
        raise InputError("--overlay", "must be a folder, not a file", str(overlay_folder))
    for picture in filter(os.path.isfile, pictures):
        options.require_used(picture)
    rows = []
    for picture, name in zip(pictures, drawn_names(pictures), strict=True):
        rows.append(_measured_row(picture, options, overlay_folder / name if overlay_folder else None))
        watch(len(rows))
    return rows


def _measured_row(picture: Path, options: PictureOptions, copy: Path | None) -> Row:
    drum = {"source": drum_pictures.DRUM} | dict.fromkeys(drum_pictures.ROW_VALUES)
    heap = {"source": "photograph", "fit": options.fit} | dict.fromkeys(ROW_VALUES)
    row: Row = {"picture": str(picture)} | (drum if options.drum else heap)
    row |= {"correction": "", "doubts": [], "overlay": None, "reason": ""}
    # A picture may break a decoder, memory or a fit in unexpected ways: that is the reason of its row.
    try:
        if options.drum:
            found = drum_pictures.read_drum_file(picture, options.view)
            row |= drum_pictures.row_values(found, options.diameter, LEVEL)
            draw: Callable[[], tuple[Picture, ...]] = partial(_drawn, picture, overlay_drum, found)
        elif is_heap_file(picture):
            row["source"] = "file of spheres"
            measured = measure_heap_file(picture, options.fit, options.heaps)
            row |= values_of(measured, LEVEL)
            draw = measured.pictures
        else:
            require_known(picture)
            require_no_text(picture)
            angle = angle_of(picture, options)
            row |= _values(angle)
            row["correction"] = angle.correction
            draw = partial(_drawn, picture, overlay, angle)
        if copy:
            clean = copy.with_name(f"{copy.stem}-clean.png")
            for path, drawing in zip((copy, clean), draw(), strict=False):
                with replacing(path) as temporary:
                    save_picture(temporary, drawing)
            row["overlay"] = str(copy)
    except (PictureError, InputError) as error:
        row["reason"] = str(error) if str(picture) in str(error) else f"{picture}: {error}"
    except MemoryError:
        row["reason"] = f"{picture}: the picture does not fit into memory"
    except Exception as error:
        task = "drawing" if row["mean"] is not None else "measuring"
        row["reason"] = f"{picture}: {task} failed: {type(error).__name__}: {error}"
    return row


def angle_of(picture: Path, options: PictureOptions) -> ReposeAngle:
    """Measure the angle of a heap; where a picture shows no heap but a drum, say so."""
    try:
        return measure_photograph(picture, options.fit, options.view)
    except PictureError as error:
        if os.path.isfile(picture) and drum_pictures.shows_drum(picture):
            raise InputError(str(picture), "shows a rotating drum", hint="Use --drum.") from error
        raise


def _drawn(picture: Path, draw: Callable[..., Picture], found: object) -> tuple[Picture]:
    return (draw(read_picture(picture), found),)


def _values(angle: ReposeAngle) -> Row:
    outline = angle.outline
    columns, rows = outline.plate.picture_point(outline.position[[0, -1]], np.zeros(2))
    return mean_values(angle, angle.left, angle.right, LEVEL, angle.doubts) | {
        "tilt": outline.plate.tilt,
        "elevation": outline.elevation,
        "distance": outline.distance,
        "plate": [float(value) for value in (columns[0], rows[0], columns[1], rows[1])],
        "heap_pixels": float(np.ptp(outline.position)),
    }


def drawn_names(pictures: Sequence[Path]) -> list[str]:
    """Return short and different names of the drawn copies."""
    long = [f"{p.parent.name}_{p.name.replace('.', '-')}".translate(NOT_IN_NAMES) for p in pictures]
    names = [picture.stem for picture in pictures]
    # names may differ by case alone, which some systems ignore
    for longer in (long, [f"{name}-{number}" for number, name in enumerate(long, start=1)]):
        count = Counter(name.casefold() for name in names)
        names = [two if count[one.casefold()] > 1 else one for one, two in zip(names, longer, strict=True)]
    return [f"{name}-angle.png" for name in names]


@dataclass(frozen=True)
class MeanAngle:
    """Mean over heaps."""

    mean: float
    """Mean over the heaps of each heap's mean over its pictures [degrees]."""
    sd: float | None
    """Standard deviation of one heap [degrees]; None with one heap."""
    n: int
    """Number of heaps."""
    low: float | None
    high: float | None
    """Ends of the 95 % interval of the mean; None with one heap."""
    pictures: int
    """Number of pictures in the mean."""
    left_out: tuple[str, ...]
    """Measured pictures that are left out because they are doubtful."""
    of: str = "heap"
    """Subject of the pictures: heap, or drum."""

    def __str__(self) -> str:
        parts = [f"mean {self.mean:.2f} degrees of {self.n} {self.of}{'s' if self.n > 1 else ''}"]
        if self.sd is not None:
            parts.append(f"sd {self.sd:.2f}, 95 % interval {self.low:.2f} to {self.high:.2f}")
        if self.left_out:
            parts.append(f"{len(self.left_out)} doubtful left out")
        return "; ".join(parts)


def used_rows(rows: Sequence[Mapping[str, Any]], options: PictureOptions) -> list[Mapping[str, Any]]:
    """Return the rows that count in the mean."""
    return [row for row in rows if row["mean"] is not None and (options.keep_doubtful or not row["doubts"])]


def mean_angle(rows: Sequence[Mapping[str, Any]], options: PictureOptions | None = None) -> MeanAngle | None:
    """Average the rows of `measure_pictures` over heaps; None where no picture counts."""
    options = options or PictureOptions()
    used = used_rows(rows, options)
    if not used:
        return None
    heaps: dict[Hashable, list[float]] = {}
    for number, row in enumerate(used):
        heaps.setdefault(options.heap_of(Path(row["picture"]), number), []).append(row["mean"])
    means = np.array([np.mean(views) for views in heaps.values()])
    left_out = tuple(row["picture"] for row in rows if row["mean"] is not None and row not in used)
    mean, n = float(means.mean()), len(means)
    sd = float(means.std(ddof=1)) if n > 1 else None
    low, high = (None, None) if sd is None else confidence_interval(mean, sd / n**0.5, n - 1, LEVEL)
    return MeanAngle(mean, sd, n, low, high, len(used), left_out, options.subject)


def target_sample(rows: Sequence[Mapping[str, Any]], options: PictureOptions, place: str) -> Sample:
    """Return the sample of heaps that a target is made of."""
    mean = mean_angle(rows, options)
    if mean is None or mean.sd is None:
        problem = "; ".join(("needs two measured heaps at least", *left_out_notes(rows, options)))
        hint = "To count doubtful pictures, use keep_doubtful (--keep-doubtful)."
        raise InputError(place, problem, str(mean.n if mean else 0), hint)
    return Sample(mean.mean, mean.sd, mean.n)


def left_out_notes(rows: Sequence[Mapping[str, Any]], options: PictureOptions) -> tuple[str, ...]:
    """Name the pictures that do not count, with their reasons."""
    used = used_rows(rows, options)
    left_out = [row for row in rows if row not in used]
    return tuple(
        f"left out: {row['reason'] or row['picture'] + ': doubtful: ' + '; '.join(row['doubts'])}"
        for row in left_out
    )


def target_text(rows: Sequence[Mapping[str, Any]], options: PictureOptions) -> str:
    """Write the ``[target]`` section of a study file; raise `InputError` with fewer than two heaps."""
    sample, mean = target_sample(rows, options, "--target"), mean_angle(rows, options)
    used, left_out = (mean.pictures, len(mean.left_out)) if mean else (0, 0)
    return (
        f"[target]  # {used} photographs; left out as doubtful: {left_out}\n"
        + ('observable = "dynamic_angle"\n' if options.drum else f'fit = "{options.fit}"\n')
        + f'mean = "{sample.mean:.3f} deg"\n'
        f'sd = "{sample.sd:.3f} deg"\n'
        f"n = {sample.n}\n"
    )


def csv_table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Write the rows as CSV; lists are joined by semicolons."""
    import pandas as pd  # loads slowly

    joined = lambda value: "; ".join(map(str, value)) if isinstance(value, list) else value  # noqa: E731
    return pd.DataFrame(rows, dtype=object).map(joined).to_csv(index=False, lineterminator="\n")
