"""``dem-warp angle``: photographs and files of heaps to repose angles."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from experiments.commands.console import clear_errors, fail, plain
from experiments.commands.options import AsJson
from experiments.commands.results import print_angles, print_findings

ANGLE_EXAMPLE = "Example: [bold]dem-warp angle photos/*.jpg --fit middle --overlay measured[/]"


def angle(
    pictures: Annotated[
        list[Path],
        typer.Argument(
            metavar="PICTURE...",
            help="Photographs of heaps; or heaps of LIGGGHTS, LAMMPS, Yade and others: text dumps (of which "
            "the last frame), tables of spheres, VTK files.",
        ),
    ],
    fit: Annotated[str, typer.Option(help="Part of the flanks: flank, middle, lower or upper.")] = "flank",
    overlay: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Draw the fitted flanks on copies in this folder.")
    ] = None,
    by: Annotated[
        str, typer.Option(help="Views of one heap: each picture another heap, or one heap a folder.")
    ] = "picture",
    keep_doubtful: Annotated[bool, typer.Option(help="Count doubtful pictures in the mean.")] = False,
    crop: Annotated[str | None, typer.Option(metavar="X1,Y1,X2,Y2", help="Look at this part only.")] = None,
    plate: Annotated[
        str | None,
        typer.Option(metavar="X1,Y1,X2,Y2", help="Two points (pixels) where heap and plate meet."),
    ] = None,
    heap_number: Annotated[
        int | None, typer.Option("--heap", help="Which of several, from the left.")
    ] = None,
    elevation: Annotated[
        float | None, typer.Option(help="Angle at which the camera looks down, in degrees.")
    ] = None,
    distance: Annotated[float | None, typer.Option(help="Camera to heap, in widths of the heap.")] = None,
    unit: Annotated[
        str | None, typer.Option(help="Unit of length in files of spheres. Left out: what they name, or m.")
    ] = None,
    plate_height: Annotated[
        str | None,
        typer.Option(metavar="LENGTH", help='Plate of files of spheres, as "2 mm". Left out: it is found.'),
    ] = None,
    as_target: Annotated[bool, typer.Option("--target", help="Print a study's \\[target] section.")] = False,
    as_csv: Annotated[bool, typer.Option("--csv", help="Print the rows as CSV.")] = False,
    as_json: AsJson = False,
) -> None:
    """Measure repose angles on photographs, and on simulated heaps of other codes.

    How to take them:

    - the phone level, as high as the heap's middle, five heap widths away or more (zoom in);

    - a plain wall behind that differs from the grains; soft light, no hard shadow;

    - the whole heap with its foot, half the picture wide, the plate seen on both sides of it;

    - nothing else in view: no tube, ruler, label or second heap (--crop cuts them off).

    Doubtful angles are marked, with the reason, and left out of the mean. Pictures in HEIC need
    pip install 'dem-warp\\[heic]', or to be saved as JPEG. Heaps of spheres are seen from eight sides.
    """
    with clear_errors():
        from experiments.measurement import photographs
        from experiments.measurement.heap_files import heap_settings

        photographs.require_one_form({"--target": as_target, "--csv": as_csv, "--json": as_json})
        view = photographs.view_of(crop, plate, heap_number, elevation, distance)
        heaps = heap_settings(unit, plate_height)
        grouping = photographs.grouping_of(by)
        rows = photographs.measure_pictures(pictures, fit, overlay, view, heaps)
        mean = photographs.mean_angle(rows, grouping, keep_doubtful)
        if as_target:
            typer.echo(photographs.target_section(mean, fit, rows, grouping), nl=False)
        elif as_csv:
            typer.echo(plain(photographs.csv_table(rows)), nl=False)
        elif as_json:
            result = {"pictures": rows, "mean": mean.to_dict() if mean else None}
            typer.echo(json.dumps(result, allow_nan=False))
        else:
            print_angles(rows, fit)
            if mean:
                typer.echo(str(mean))
    print_findings(rows)
    if rejected := [row["reason"] for row in rows if row["reason"]]:
        fail("\n".join(rejected))
