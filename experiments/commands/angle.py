"""``dem-warp angle``: photographs and files of heaps to repose angles."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from experiments.commands.console import clear_errors, fail, plain, shown_count
from experiments.commands.options import AsJson
from experiments.commands.results import DRUM_COLUMNS, HEAP_COLUMNS, print_angles, print_findings

if TYPE_CHECKING:
    from experiments.measurement.photographs import PictureOptions
    from imaging import View

ANGLE_EXAMPLE = "Example: [bold]dem-warp angle photos/*.jpg --fit middle --overlay measured[/]"


Crop = Annotated[str | None, typer.Option(metavar="X1,Y1,X2,Y2", help="Look at this part only.")]
PlateLine = Annotated[
    str | None, typer.Option(metavar="X1,Y1,X2,Y2", help="Two points (pixels) where heap and plate meet.")
]
HeapNumber = Annotated[
    int | None, typer.Option("--heap", help="Number of the heap from the left, where there are several.")
]
Elevation = Annotated[float | None, typer.Option(help="Angle at which the camera looks down, in degrees.")]
Distance = Annotated[
    float | None, typer.Option(help="Distance of the camera from the heap, in widths of the heap.")
]
DrumCircle = Annotated[
    str | None,
    typer.Option(
        metavar="X,Y,R", help="Middle and radius (pixels) of the drum's inner edge. Default: found."
    ),
]
DrumDiameter = Annotated[
    str | None,
    typer.Option(metavar="LENGTH", help='Inner diameter of the drum, e.g. "84 mm", for heights in metres.'),
]
HeapUnit = Annotated[
    str | None, typer.Option(help="Unit of length in files of spheres. Default: the file's own, or m.")
]
PlateHeight = Annotated[
    str | None,
    typer.Option(metavar="LENGTH", help='Plate height in files of spheres, e.g. "2 mm". Default: found.'),
]
GrainTypes = Annotated[
    str | None,
    typer.Option("--type", help="Types that are grain in files of spheres, e.g. 1 or 1,3. Default: all."),
]


def angle(
    pictures: Annotated[
        list[Path],
        typer.Argument(
            metavar="PICTURE...",
            help="Photographs of heaps; or heaps of LIGGGHTS, LAMMPS, Yade and others: text dumps (the last "
            "frame), tables of spheres, VTK, extended XYZ, NumPy and MercuryDPM files; gzip is read.",
        ),
    ],
    fit: Annotated[str, typer.Option(help="flank, trimmed, middle, lower or upper part.")] = "flank",
    overlay: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Draw the fitted flanks on copies in this folder.")
    ] = None,
    by: Annotated[
        Literal["picture", "folder"],
        typer.Option(help="picture: one heap per picture; folder: one heap per folder."),
    ] = "picture",
    keep_doubtful: Annotated[bool, typer.Option(help="Count doubtful pictures in the mean.")] = False,
    crop: Crop = None,
    plate: PlateLine = None,
    heap_number: HeapNumber = None,
    elevation: Elevation = None,
    distance: Distance = None,
    drum: Annotated[bool, typer.Option("--drum", help="The pictures show a rotating drum.")] = False,
    circle: DrumCircle = None,
    diameter: DrumDiameter = None,
    unit: HeapUnit = None,
    plate_height: PlateHeight = None,
    types: GrainTypes = None,
    as_target: Annotated[bool, typer.Option("--target", help="Print a study's \\[target] section.")] = False,
    as_csv: Annotated[bool, typer.Option("--csv", help="Print the rows as CSV.")] = False,
    as_json: AsJson = False,
) -> None:
    r"""Measure repose angles on photographs, and on simulated heaps of other codes.

    How to take photographs:

    - hold the phone level, as high as the heap's middle, five heap widths away or more (zoom in);

    - use a plain wall that differs from the grains, and soft light without hard shadows;

    - show the whole heap with its foot, half the picture wide, and the plate on both sides of it;

    - show nothing else: no tube, ruler, label or second heap (--crop cuts them off).

    Doubtful angles are marked, with the reason, and left out of the mean. Pictures in HEIC need
    pip install 'dem-warp\[heic]', or must be saved as JPEG. Heaps of spheres are viewed from eight sides.

    With --drum the pictures show a rotating drum along its axis, level, one look or an average over time: the
    result is the dynamic angle, the heights of the surface at nine places, and the filling.
    """
    with clear_errors():
        from experiments.measurement import photographs
        from experiments.measurement.heap_files import heap_settings

        pictures = photographs.expanded(pictures)
        _require_one_form({"--target": as_target, "--csv": as_csv, "--json": as_json})
        view = _view(crop, plate, heap_number, elevation, distance, circle)
        heaps = heap_settings(unit, plate_height, types)
        options = photographs.PictureOptions(fit, view, heaps, by, keep_doubtful, drum, _length(diameter))
        if as_target:
            photographs.require_separate(pictures, options, "--target")
        with shown_count("pictures", len(pictures)) as watch:
            rows = photographs.measure_pictures(pictures, options, overlay, watch)
        try:
            if as_target:
                typer.echo(photographs.target_text(rows, options), nl=False)
            elif as_csv:
                typer.echo(plain(photographs.csv_table(rows)), nl=False)
            else:
                _print_mean(rows, options, as_json)
        finally:
            print_findings(rows)
    if rejected := [row["reason"] for row in rows if row["reason"]]:
        fail("\n".join(rejected))


def _print_mean(rows: Sequence[Mapping[str, Any]], options: PictureOptions, as_json: bool) -> None:
    from experiments.measurement.photographs import mean_angle

    mean = mean_angle(rows, options)
    if as_json:
        result = {"pictures": rows, "mean": asdict(mean) if mean else None}
        typer.echo(json.dumps(result, allow_nan=False))
        return
    if options.drum:
        print_angles(rows, "Rotating drums, angles in degrees", DRUM_COLUMNS)
    else:
        print_angles(rows, f"Repose angles in degrees, {options.fit} fit", HEAP_COLUMNS)
    if mean:
        typer.echo(str(mean))


def _require_one_form(chosen: Mapping[str, bool]) -> None:
    """Refuse two forms of the output at once, given by their options."""
    from experiments.io.errors import InputError

    given = [option for option, wanted in chosen.items() if wanted]
    if len(given) > 1:
        *others, last = chosen
        problem = f"only one of {', '.join(others)} and {last} is possible"
        raise InputError(given[1], problem, " ".join(given), "Each is the whole output.")


def _length(text: str | None) -> float | None:
    from experiments.io.errors import InputError
    from experiments.io.units import read_quantity

    length = None if text is None else read_quantity(text, "length", "--diameter")
    if length is not None and not length > 0.0:
        raise InputError("--diameter", "must be positive", text)
    return length


def _view(
    crop: str | None,
    plate: str | None,
    heap: int | None,
    elevation: float | None,
    distance: float | None,
    circle: str | None,
) -> View:
    from experiments.io.errors import InputError
    from imaging import View

    corners = _numbers(crop, "--crop", "four numbers X1,Y1,X2,Y2")
    if corners is not None and any(value != int(value) for value in corners):
        raise InputError("--crop", "must be whole pixels X1,Y1,X2,Y2", crop)
    part: Any = None if corners is None else tuple(map(int, corners))
    line: Any = _numbers(plate, "--plate", "four numbers X1,Y1,X2,Y2")
    ring: Any = _numbers(circle, "--circle", "three numbers X,Y,R")
    return View(part, line, heap, elevation, distance, circle=ring)


def _numbers(text: str | None, option: str, form: str) -> tuple[float, ...] | None:
    """Read numbers between commas, as many as the form has; None where they are not given."""
    from experiments.io.errors import InputError

    if text is None:
        return None
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != form.count(",") + 1 or not all(abs(number) < float("inf") for number in numbers):
        raise InputError(option, f"must be {form}", text)
    return numbers
