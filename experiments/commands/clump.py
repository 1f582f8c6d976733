"""``dem-warp clump``: grain shapes from meshes, dimensions and other codes' files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from experiments.commands.console import clear_errors, messages
from experiments.commands.options import AsJson, quantity
from experiments.commands.results import print_clump

CLUMP_EXAMPLE = "Example: [bold]dem-warp clump tri-pyramid:5.90x3.93 --spheres 9 --out clump.txt[/]"


def clump(
    shape: Annotated[
        str,
        typer.Argument(
            metavar="SHAPE",
            help="A mesh file in mm; a solid by its dimensions in mm (sphere:D, ellipsoid:LxWxT, "
            "cylinder:LxD, capsule:LxD, tri-pyramid:HxEDGE); or a file of spheres of dem-warp, LIGGGHTS, "
            "Yade, EDEM or DEM-Engine, to be described.",
        ),
    ],
    spheres: Annotated[
        int | None, typer.Option(min=1, max=256, help="Spheres to fill the solid with.")
    ] = None,
    unit: Annotated[
        str | None,
        typer.Option(help='Unit of a file, as m, or the length that is 1 in it, as "2.5 mm". Left out: mm.'),
    ] = None,
    protrusion: Annotated[
        str, typer.Option(help="How far a sphere may pass the surface: sharp edges are covered better.")
    ] = "0 mm",
    density: Annotated[str | None, typer.Option(help='For the mass, as "698 kg/m^3".')] = None,
    out: Annotated[
        Path | None, typer.Option(help="File of spheres to write, for a study's grain.clump.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Make a grain of spheres from a mesh or measured dimensions: volume, mass, inertia, spheres."""
    with clear_errors():
        from experiments.commands.shapes import make_clump, write_clump

        reach = quantity(protrusion, "length", "--protrusion")
        mass_density = quantity(density, "density", "--density") if density else None
        made = make_clump(shape, spheres, reach, unit)
        if out:
            write_clump(made.shape, out)
    if as_json:
        typer.echo(json.dumps(made.to_dict(mass_density), allow_nan=False))
    else:
        print_clump(made.to_dict(mass_density))
    if made.told:
        messages.print(f"Read: {shape}: {made.told}")
