"""Pictures and files of heaps to repose angles, and these to the target of a calibration."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy import special

from experiments.io.errors import InputError
from experiments.io.files import replacing
from experiments.measurement.copies import Repeats
from experiments.measurement.heap_files import HeapSettings, is_heap_file, measure_heap_file, values_of
from imaging import (
    FitSettings,
    PictureError,
    ReposeAngle,
    View,
    measure_photograph,
    overlay,
    read_picture,
    save_picture,
)
from imaging.geometry import Picture

LEVEL = 0.95
"""Of all intervals."""
Grouping = Literal["picture", "folder"]
ROW_VALUES = (
    "left", "right", "mean", "se", "low", "high", "tilt", "elevation", "distance", "plate", "heap_pixels",
)  # fmt: skip
"""Measured values of a row."""
NOT_IN_NAMES = str.maketrans("", "", '/\\:*?"<>|')
"""Characters that no file's name has on every system."""


def view_of(
    crop: str | None,
    plate: str | None,
    heap: int | None,
    elevation: float | None,
    distance: float | None,
) -> View:
    """Read what a person says of the pictures.

    Raises
    ------
    InputError
        When a list is not of four numbers.
    imaging.PictureError
        When a number breaks its rule.
    """
    corners = _four(crop, "--crop")
    if corners is not None and any(value != int(value) for value in corners):
        raise InputError("--crop", "expected X1,Y1,X2,Y2 are whole pixels", crop)
    part = None if corners is None else (int(corners[0]), int(corners[1]), int(corners[2]), int(corners[3]))
    return View(part, _four(plate, "--plate"), heap, elevation, distance)


def _four(text: str | None, option: str) -> tuple[float, float, float, float] | None:
    if text is None:
        return None
    try:
        x1, y1, x2, y2 = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(option, "expected four numbers X1,Y1,X2,Y2", text) from None
    if not np.isfinite([x1, y1, x2, y2]).all():
        raise InputError(option, "expected four finite numbers X1,Y1,X2,Y2", text)
    return x1, y1, x2, y2


def require_one_form(chosen: Mapping[str, bool]) -> None:
    """Refuse two forms of the result at once, by their options; each takes the whole standard output.

    Raises
    ------
    InputError
        With the options that were given.
    """
    given = [option for option, wanted in chosen.items() if wanted]
    if len(given) > 1:
        *others, last = chosen
        rule = f"only one of {', '.join(others)} and {last}: each is the whole output"
        raise InputError(given[1], rule, " ".join(given))


def grouping_of(by: str) -> Grouping:
    """Read which pictures show one heap; raise `InputError` on anything but picture or folder."""
    if by == "picture":
        return "picture"
    if by == "folder":
        return "folder"
    raise InputError("--by", "is picture or folder", by)


def measure_pictures(
    pictures: Sequence[Path],
    fit: str = "flank",
    overlay_folder: Path | None = None,
    view: View | None = None,
    heaps: HeapSettings | None = None,
) -> list[dict[str, Any]]:
    """Measure the repose angle of each picture; one that cannot be measured costs the others nothing.

    Parameters
    ----------
    pictures
        Picture files, and files of spheres that hold a heap of LIGGGHTS, LAMMPS, Yade or another code.
    fit
        Name of a fit, one of ``imaging.FITS``.
    overlay_folder
        Where copies with the fitted flanks are drawn: ``NAME-angle.png`` for each picture, with its folder's
        name before where two have one name; of a file of spheres also ``NAME-angle-clean.png``, without them.
    view
        What is known of every picture beforehand.
    heaps
        What is known of every file of spheres beforehand.

    Returns
    -------
    list of dict
        For each picture: ``picture``, ``source`` (photograph, or the format of a heap's file and what was
        taken from it), ``fit``, ``left``, ``right``, ``mean``, ``se``, the ends ``low`` and
        ``high`` of the 95 % interval, ``tilt`` and ``elevation`` of the camera [degrees], its ``distance``
        [heap widths] where it is known, the ``plate``'s line (x1, y1, x2, y2) and the heap's width
        ``heap_pixels`` [pixels], all None where it could not be measured; ``doubts``, a list of sentences;
        ``overlay``, the drawn copy or None; ``reason``, empty where it could be measured and drawn.

    Raises
    ------
    InputError
        When the folder for the drawn copies is a file.
    imaging.PictureError
        When there is no such fit.
    """
    FitSettings.of(fit)
    if overlay_folder and any(folder.is_file() for folder in (overlay_folder, *overlay_folder.parents)):
        raise InputError("--overlay", "expected copies are drawn in a folder", f"the file {overlay_folder}")
    names = drawn_names(pictures)
    rows = []
    for picture, name in zip(pictures, names, strict=True):
        row: dict[str, Any] = {"picture": str(picture), "source": "photograph", "fit": fit}
        row |= dict.fromkeys(ROW_VALUES)
        row |= {"doubts": [], "overlay": None, "reason": ""}
        rows.append(row)
        # A picture may break a decoder, memory or a fit in ways that nobody thought of: it is a row, no end.
        try:
            if is_heap_file(picture):
                row["source"] = "file of spheres"
                heap = measure_heap_file(picture, fit, heaps or HeapSettings())
                row |= values_of(heap, LEVEL)
                drawn: Callable[[], tuple[Picture, ...]] = heap.pictures
            else:
                angle = measure_photograph(picture, fit, view)
                row |= _values(angle)
                drawn = partial(_drawn_photograph, picture, angle)
            if overlay_folder:
                clean = f"{Path(name).stem}-clean.png"
                for kept, drawing in zip((name, clean), drawn(), strict=False):
                    with replacing(overlay_folder / kept) as temporary:
                        save_picture(temporary, drawing)
                row["overlay"] = str(overlay_folder / name)
        except (PictureError, InputError) as error:
            row["reason"] = str(error) if str(picture) in str(error) else f"{picture}: {error}"
        except MemoryError:
            row["reason"] = f"{picture}: expected: a picture that fits into memory, got one that does not"
        except Exception as error:
            task = "drawing" if row["mean"] is not None else "measuring"
            row["reason"] = f"{picture}: {task} failed: {type(error).__name__}: {error}"
    return rows


def _drawn_photograph(picture: Path, angle: ReposeAngle) -> tuple[Picture]:
    """Copy of a photograph with its flanks; the photograph itself is the one without."""
    return (overlay(read_picture(picture), angle),)


def drawn_names(pictures: Sequence[Path]) -> list[str]:
    """Names of the drawn copies: as short as they can be, and all different."""
    names = [f"{picture.stem}-angle.png" for picture in pictures]
    for depth in range(2, 2 + max((len(picture.parts) for picture in pictures), default=0)):
        # as on systems whose names have no case, and without what no name there may have
        count = Counter(name.casefold() for name in names)
        names = [
            "_".join((*picture.parts[-depth:-1], name_of(picture))).translate(NOT_IN_NAMES)
            if count[name.casefold()] > 1
            else name
            for picture, name in zip(pictures, names, strict=True)
        ]
    seen: Counter[str] = Counter()
    different = []
    for name in names:
        times = seen[name.casefold()] = seen[name.casefold()] + 1
        different.append(name if times == 1 else f"{name.removesuffix('.png')}-{times}.png")
    return different


def name_of(picture: Path) -> str:
    """Name of a picture's drawn copy, its ending told where another picture has the same stem."""
    return f"{picture.name.replace('.', '-')}-angle.png"


def _values(angle: ReposeAngle) -> dict[str, Any]:
    low, high = angle.interval(LEVEL)
    outline = angle.outline
    ends = outline.position[[0, -1]]
    columns, rows = outline.plate.picture_point(ends, np.zeros(2))
    return {
        "left": angle.left,
        "right": angle.right,
        "mean": angle.mean,
        "se": angle.se,
        "low": low,
        "high": high,
        "tilt": outline.plate.tilt,
        "elevation": outline.elevation,
        "distance": outline.distance,
        "plate": [float(value) for value in (columns[0], rows[0], columns[1], rows[1])],
        "heap_pixels": float(np.ptp(outline.position)),
        "doubts": [str(doubt) for doubt in angle.doubts],
    }


@dataclass(frozen=True)
class MeanAngle:
    """Mean over heaps."""

    mean: float
    """Mean over the heaps of each one's mean over its pictures [degrees]."""
    sd: float | None
    """Standard deviation of one heap [degrees]; None with one heap."""
    n: int
    """Heaps."""
    low: float | None
    high: float | None
    """Ends of the 95 % interval of the mean; None with one heap."""
    pictures: int
    """Pictures that it holds."""
    left_out: tuple[str, ...]
    """Measured pictures that are doubtful, and so left out."""

    def __str__(self) -> str:
        """Write the mean as a line for people."""
        said = [f"mean {self.mean:.2f} degrees of {self.n} heap{'s' if self.n > 1 else ''}"]
        if self.sd is not None:
            said.append(f"sd {self.sd:.2f}, 95 % interval {self.low:.2f} to {self.high:.2f}")
        if self.left_out:
            said.append(f"{len(self.left_out)} doubtful left out")
        return "; ".join(said)

    def to_dict(self) -> dict[str, Any]:
        """Values for JSON."""
        return asdict(self)


def mean_angle(
    rows: Sequence[Mapping[str, Any]], by: Grouping = "picture", keep_doubtful: bool = False
) -> MeanAngle | None:
    """Average measured pictures over heaps; None where no picture is left.

    Parameters
    ----------
    rows
        From `measure_pictures`.
    by
        Whether every picture shows another heap, or those of one folder are views of one.
    keep_doubtful
        Whether doubtful pictures count.
    """
    measured = [row for row in rows if row["mean"] is not None]
    used = [row for row in measured if keep_doubtful or not row["doubts"]]
    if not used:
        return None
    heaps: dict[Hashable, list[float]] = {}
    for index, row in enumerate(used):
        heaps.setdefault(_heap(row, index, by), []).append(row["mean"])
    means = np.array([np.mean(views) for views in heaps.values()])
    left_out = tuple(row["picture"] for row in measured if row not in used)
    mean, n = float(means.mean()), len(means)
    if n == 1:
        return MeanAngle(mean, None, n, None, None, len(used), left_out)
    sd = float(means.std(ddof=1))
    reach = float(special.stdtrit(n - 1, 0.5 + 0.5 * LEVEL)) * sd / np.sqrt(n)
    return MeanAngle(mean, sd, n, mean - reach, mean + reach, len(used), left_out)


def _require_separate_heaps(rows: Sequence[Mapping[str, Any]], by: Grouping) -> None:
    """Refuse measured pictures, one of which is given for two heaps, to the byte."""
    repeats = Repeats()
    for index, row in enumerate(rows):
        if row["mean"] is not None:
            name = row["picture"]
            repeats.add_file(Path(name), _heap(row, index, by), name, f"--target: picture {index + 1}")


def _heap(row: Mapping[str, Any], index: int, by: Grouping) -> Hashable:
    """Heap that a picture shows."""
    return Path(row["picture"]).parent if by == "folder" else index


def target_section(
    mean: MeanAngle | None, fit: str, rows: Sequence[Mapping[str, Any]], by: Grouping = "picture"
) -> str:
    """Write the ``[target]`` section of a study file, of the mean of rows.

    Raises
    ------
    InputError
        When there are not two heaps: a target has a standard deviation. When a picture is given for two.
    """
    _require_separate_heaps(rows, by)
    if mean is None or mean.sd is None:
        received = f"{mean.n if mean else 0} (doubtful pictures count with --keep-doubtful)"
        raise InputError("--target", "a target needs two measured heaps at the least", received)
    return (
        f"[target]  # {mean.pictures} photographs, {fit} fit; left out as doubtful: {len(mean.left_out)}\n"
        f'mean = "{mean.mean:.3f} deg"\n'
        f'sd = "{mean.sd:.3f} deg"\n'
        f"n = {mean.n}\n"
    )


def csv_table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Write the rows as CSV; lists are joined by semicolons."""
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=list(rows[0]), lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({key: _cell(value) for key, value in row.items()})
    return text.getvalue()


def _cell(value: Any) -> Any:
    return "; ".join(str(part) for part in value) if isinstance(value, list) else value
