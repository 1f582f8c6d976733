"""``dem-warp clump``: grain shapes from meshes, dimensions and other codes' files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from experiments.commands.console import clear_errors, messages
from experiments.commands.options import AsJson
from experiments.commands.results import print_clump, print_trial
from experiments.io.errors import InputError
from experiments.io.units import read_quantity, read_share

if TYPE_CHECKING:
    from experiments.grains.clumps.clump_maker import Clump

CLUMP_EXAMPLE = "Example: [bold]dem-warp clump tri-pyramid:5.90x3.93 --spheres 9 --out clump.txt[/]"


def clump(
    shape: Annotated[
        str,
        typer.Argument(
            metavar="SHAPE",
            help="A mesh file in mm; a solid by its dimensions in mm (sphere:D, ellipsoid:LxWxT, "
            "cylinder:LxD, capsule:LxD, tri-pyramid:HxEDGE); or a file of spheres of dem-warp, LIGGGHTS, "
            "Yade, EDEM or DEM-Engine, to describe.",
        ),
    ],
    spheres: Annotated[
        int | None, typer.Option(min=1, max=256, help="Spheres to fill the solid with.")
    ] = None,
    tolerance: Annotated[
        str | None,
        typer.Option(
            metavar="PERCENT",
            help="Use the fewest spheres that keep all three errors (volume, inertia, surface) below this, "
            "e.g. 5%.",
        ),
    ] = None,
    unit: Annotated[
        str | None,
        typer.Option(help='Unit of a file, e.g. m, or the length of 1 in it, e.g. "2.5 mm". Default: mm.'),
    ] = None,
    protrusion: Annotated[
        str | None,
        typer.Option(
            help="How far a sphere may pass the surface; auto: until the volume is the solid's. Default: "
            "0 mm, or auto with --tolerance."
        ),
    ] = None,
    density: Annotated[str | None, typer.Option(help='Density for the mass, e.g. "698 kg/m^3".')] = None,
    out: Annotated[
        Path | None, typer.Option(help="File of spheres to write, for a study's grain.clump.")
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the clump and the solid, e.g. to a .png.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Make a grain of spheres from a mesh or measured dimensions: volume, mass, inertia, spheres."""
    with clear_errors():
        from experiments.grains.clumps.clump_maker import ClumpRequest, make_clump, write_clump

        _require_new(out, picture)
        request = ClumpRequest(
            shape, spheres, read_share(tolerance, "--tolerance") if tolerance else None,
            _reach(protrusion, tolerance), unit,
        )  # fmt: skip
        mass_density = _density(density) if density else None
        with messages.status("Fitting spheres"):
            made = make_clump(request, print_trial if tolerance else lambda trial: None)
        if out:
            write_clump(made.shape, out)
        if picture:
            made.draw(picture)
    if as_json:
        typer.echo(json.dumps(made.to_dict(mass_density), allow_nan=False))
    else:
        print_clump(made.to_dict(mass_density))
    _print_remarks(made, shape)


def _density(text: str) -> float:
    """Read a density [kg/m^3], and print a doubt about one that no solid has."""
    from experiments.studyfile.wall_sections import density_doubt

    density = read_quantity(text, "density", "--density")
    if density <= 0.0:
        raise InputError("--density", "must be greater than 0", text)
    if doubt := density_doubt(density, "--density"):
        messages.print(f"Doubtful: {doubt}")
    return density


def _require_new(out: Path | None, picture: Path | None) -> None:
    """Refuse files that cannot be written before anything is fitted."""
    from experiments.grains.clumps.clump_picture import require_picture
    from experiments.io.files import require_new_file

    if out:
        require_new_file(out, "a clump")
    if picture:
        require_picture(picture)


def _print_remarks(made: Clump, source: str) -> None:
    """Print how a file was read, and advice about a poor fit."""
    if made.description:
        messages.print(f"Read: {source}: {made.description}")
    if made.doubt:
        messages.print(f"Doubtful: {made.doubt}")
    if made.advice:
        messages.print(f"Advice: {made.advice}")


def _reach(protrusion: str | None, tolerance: str | None) -> float | None:
    """Protrusion [m]; None: the one that keeps the volume."""
    if protrusion is None:
        return None if tolerance else 0.0
    return None if protrusion == "auto" else read_quantity(protrusion, "length", "--protrusion")
