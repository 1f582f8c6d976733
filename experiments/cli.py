"""The command line ``dem-warp``: each command checks its input, calls public functions and shows the result.

Imports of the simulator, the statistics and the pictures are inside the commands: ``--help`` needs none.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from experiments.commands.console import (
    FAILED_RUN,
    Attempt,
    CaseProgress,
    clear_errors,
    fail,
    messages,
    plain,
)
from experiments.commands.early import check_study_file
from experiments.commands.results import print_angles, print_clump, print_measured, show_stage

app = typer.Typer(
    name="dem-warp",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _show_version(wanted: bool) -> None:
    if wanted:
        from dem_warp import __version__
        from dem_warp.version import source_commit

        commit = source_commit()
        typer.echo(f"dem-warp {__version__}" + (f" ({commit})" if commit else ""))
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    """Calibrate discrete element models of grain: simulated heaps, designed experiments, repose angles."""


StudyFile = Annotated[
    Path | None, typer.Argument(metavar="[STUDY.toml]", help="Study file; left out: the paper's buckwheat.")
]
Scale = Annotated[
    str | None,
    typer.Option(
        help="A scale of the study; the paper's has bench, soft and paper. Left out: paper with a CUDA "
        "device, bench without, where the study has it.",
    ),
]
Device = Annotated[str | None, typer.Option(help="cpu, cuda or cuda:N. Left out: the GPU if there is one.")]
Devices = Annotated[
    str | None,
    typer.Option(
        "--device",
        help="cpu, cuda, cuda:N or several GPUs, as cuda:0,cuda:1. Left out: the GPU if there is one.",
    ),
]
Workers = Annotated[int | None, typer.Option(min=1, help="Processes on the CPU. Left out: one a core.")]
Out = Annotated[Path | None, typer.Option(help="Folder of the results, new or empty.")]
Resume = Annotated[bool, typer.Option("--resume", help="Go on in the folder of an earlier run.")]
AsJson = Annotated[bool, typer.Option("--json", help="Write the result to standard output as JSON.")]


@app.command(epilog="Example: [bold]dem-warp calibrate mygrain.toml --out out/mygrain[/]")
def calibrate(
    study: StudyFile = None,
    out: Out = None,
    scale: Scale = None,
    device: Device = None,
    workers: Workers = None,
    engine: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Engine of an installed package. Left out: dem-warp's own."),
    ] = None,
    resume: Resume = False,
    follow_paper: Annotated[
        bool, typer.Option("--follow-paper", help="Simulate the paper's own runs too, and set them beside.")
    ] = False,
    only_paper: Annotated[
        bool, typer.Option("--only-paper", help="Simulate the paper's own runs, and no campaign.")
    ] = False,
    paper_replicates: Annotated[int, typer.Option(min=1, help="Heaps of each of the paper's runs.")] = 3,
    as_json: AsJson = False,
) -> None:
    """Run a whole calibration: noise floor, screening, climb, surface, optimum, verification, report."""
    with clear_errors():
        check_study_file(study, scale)
        from experiments import api
        from experiments.runs.choices import chosen_device, chosen_study, default_folder

        device = chosen_device(device)
        chosen = chosen_study(study, scale, device)
        folder = out or default_folder(chosen)
    go_on = Attempt.of(
        "calibrate", study, out=folder, scale=chosen.scale, device=device, workers=workers, engine=engine,
        follow_paper=follow_paper, only_paper=only_paper,
        paper_replicates=paper_replicates if follow_paper or only_paper else None, json=as_json,
    )  # fmt: skip
    with clear_errors(go_on):
        messages.print(f"{chosen.name}, on {device}", chosen.note, sep="\n")
        ended = api.calibrate(
            chosen,
            folder,
            device=device,
            workers=workers,
            engine=engine,
            resume=resume,
            published_replicates=paper_replicates if follow_paper or only_paper else 0,
            campaign=not only_paper,
            watch=CaseProgress,
            on_stage=show_stage,
        )
    if ended.record is not None:
        messages.print(f"Published runs: {ended.record}")
    if as_json:
        typer.echo(json.dumps(ended.to_dict(), allow_nan=False))
    if (campaign := ended.campaign) is None:
        return
    messages.print(f"{campaign.outcome}: {campaign.reason}")
    messages.print(f"Report: {ended.report}")
    if campaign.outcome == "too-many-failed-runs":
        raise typer.Exit(FAILED_RUN)


@app.command(epilog="Example: [bold]dem-warp discover mygrain.toml mygrain-measured.csv --out out/lacks[/]")
def discover(
    study: Annotated[Path, typer.Argument(metavar="STUDY.toml", help="Study file with its conditions.")],
    measured: Annotated[
        Path | None,
        typer.Argument(
            metavar="[MEASURED.csv]", help="Measured heaps; left out: only the library waves are run."
        ),
    ] = None,
    out: Out = None,
    bank: Annotated[
        Path | None, typer.Option(help="Library waves run earlier for this study; left out: they are run.")
    ] = None,
    photographs_only: Annotated[
        bool, typer.Option("--photographs-only", help="Look only at what photographs show.")
    ] = False,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the bootstraps and of the fresh runs.")] = 1,
    scale: Scale = None,
    device: Devices = None,
    workers: Workers = None,
    resume: Resume = False,
    as_json: AsJson = False,
) -> None:
    """Find the effect that a model lacks: calibrate, test the gap, name what explains it, show it closed."""
    with clear_errors():
        check_study_file(study, scale)
        from experiments import api
        from experiments.report.discovery import results_of, verdict_line
        from experiments.runs.choices import chosen_device, chosen_study, default_folder

        device = chosen_device(device, several=True)
        chosen = chosen_study(study, scale, device)
        folder = out or default_folder(chosen, "discover")
    go_on = Attempt.of(
        "discover", study, measured, out=folder, bank=bank, photographs_only=photographs_only, scale=scale,
        device=device, workers=workers, seed=seed, json=as_json,
    )  # fmt: skip
    with clear_errors(go_on):
        messages.print(f"{chosen.name}, on {device}", chosen.note, sep="\n")
        ended = api.discover(
            chosen,
            measured,
            folder,
            bank=bank,
            photographs_only=photographs_only,
            seed=seed,
            device=device,
            workers=workers,
            resume=resume,
            watch=CaseProgress,
        )
    if ended.discovery is None:
        messages.print(f"Library waves: {ended.page}")
        return
    if as_json:
        typer.echo(json.dumps(results_of(ended.discovery, ended.terms), allow_nan=False))
    messages.print(verdict_line(ended.discovery, ended.terms))
    messages.print(f"Report: {ended.page}")


@app.command(epilog="Example: [bold]dem-warp heap --scale bench --set E=0.48 --set F=0.45 --seed 7[/]")
def heap(
    study: StudyFile = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="Value of a factor.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of sizes, places and orientations.")] = 1,
    scene: Annotated[
        str | None, typer.Option(metavar="NAME", help="A further scene of the study, [response-scene.NAME].")
    ] = None,
    out: Out = None,
    scale: Scale = None,
    device: Device = None,
    as_json: AsJson = False,
) -> None:
    """Simulate one heap: heap.vtp (ParaView), snapshot.png with the fitted flanks, angle.json.

    A study of a hopper, a drum or a draw-down gives what that test measures instead of the angle; so does
    --scene with a further scene of the study.
    """
    with clear_errors():
        check_study_file(study, scale)
        from experiments.cases import require_unused, simulate_heap, write_heap
        from experiments.runs.choices import chosen_device, chosen_study, default_folder
        from experiments.studyfile.campaign import TARGET_SCENE

        device = chosen_device(device)
        chosen = chosen_study(study, scale, device)
        values = chosen.natural_settings(_assignments(settings or []), "--set")
        folder = out or default_folder(chosen, f"{scene or 'heap'}-{seed}")
        require_unused(folder)
        with CaseProgress(scene or "heap") as progress:
            simulated = simulate_heap(chosen, values, seed, device, progress, scene or TARGET_SCENE)
        write_heap(simulated, folder)
    if as_json:
        typer.echo(json.dumps(simulated.to_dict(), allow_nan=False))
    messages.print(f"Files: {folder}")
    if simulated.reason:
        fail(f"the case {simulated.result.status}: {simulated.reason}", FAILED_RUN)
    elif not as_json:
        print_measured(simulated)


@app.command(epilog="Example: [bold]dem-warp angle photos/*.jpg --fit middle --overlay measured[/]")
def angle(
    pictures: Annotated[list[Path], typer.Argument(metavar="PICTURE...", help="Photographs of heaps.")],
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
    as_target: Annotated[bool, typer.Option("--target", help="Print a study's \\[target] section.")] = False,
    as_csv: Annotated[bool, typer.Option("--csv", help="Print the rows as CSV.")] = False,
    as_json: AsJson = False,
) -> None:
    """Measure repose angles on photographs.

    How to take them:

    - the phone level, as high as the heap's middle, five heap widths away or more (zoom in);

    - a plain wall behind that differs from the grains; soft light, no hard shadow;

    - the whole heap with its foot, half the picture wide, the plate seen on both sides of it;

    - nothing else in view: no tube, ruler, label or second heap (--crop cuts them off).

    Doubtful angles are marked, with the reason, and left out of the mean. Pictures in HEIC need
    pip install 'dem-warp\\[heic]', or to be saved as JPEG.
    """
    with clear_errors():
        from experiments.commands import photographs

        view = photographs.view_of(crop, plate, heap_number, elevation, distance)
        grouping = photographs.grouping_of(by)
        rows = photographs.measure_pictures(pictures, fit, overlay, view)
        mean = photographs.mean_angle(rows, grouping, keep_doubtful)
        if as_target:
            typer.echo(photographs.target_section(mean, fit), nl=False)
        elif as_csv:
            typer.echo(plain(photographs.csv_table(rows)), nl=False)
        elif as_json:
            result = {"pictures": rows, "mean": mean.to_dict() if mean else None}
            typer.echo(json.dumps(result, allow_nan=False))
        else:
            print_angles(rows, fit)
            if mean:
                typer.echo(str(mean))
    for row in rows:
        for doubt in row["doubts"]:
            messages.print(f"Doubtful: {row['picture']}: {doubt}")
    if rejected := [row["reason"] for row in rows if row["reason"]]:
        fail("\n".join(rejected))


@app.command(epilog="Example: [bold]dem-warp clump tri-pyramid:5.90x3.93 --spheres 9 --out clump.txt[/]")
def clump(
    shape: Annotated[
        str,
        typer.Argument(
            metavar="SHAPE",
            help="A mesh file in mm; a solid by its dimensions in mm (sphere:D, ellipsoid:LxWxT, "
            "cylinder:LxD, capsule:LxD, tri-pyramid:HxEDGE); or a file of spheres (x y z r in mm), "
            "to be described.",
        ),
    ],
    spheres: Annotated[
        int | None, typer.Option(min=1, max=256, help="Spheres to fill the solid with.")
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

        reach = _quantity(protrusion, "length", "--protrusion")
        mass_density = _quantity(density, "density", "--density") if density else None
        made = make_clump(shape, spheres, reach)
        if out:
            write_clump(made.shape, out)
    if as_json:
        typer.echo(json.dumps(made.to_dict(mass_density), allow_nan=False))
    else:
        print_clump(made.to_dict(mass_density))


@app.command(epilog="Example: [bold]dem-warp new mygrain[/] writes mygrain.toml")
def new(
    name: Annotated[str, typer.Argument(help="Name of the grain, and of the file.")],
    measured: Annotated[
        bool,
        typer.Option(
            "--measured", help="Write NAME-measured.csv instead: room for heaps measured for the study NAME."
        ),
    ] = False,
) -> None:
    """Write a commented study file to start from, or a file for the measured heaps of a study."""
    with clear_errors():
        if measured:
            from experiments.measurement.template import write_measured_template
            from experiments.studyfile import load_study

            study = Path(name) if name.endswith(".toml") else Path(f"{name}.toml")
            path, then = write_measured_template(load_study(study)), f"dem-warp discover {study}"
        else:
            from experiments.studyfile import write_template

            path, then = write_template(name), "dem-warp calibrate"
    typer.echo(plain(f"Wrote {path}. Fill it in, then: {then} {path}"))


def main() -> None:
    """Run the command line."""
    app()


def _assignments(texts: list[str]) -> dict[str, str]:
    """Split ``NAME=VALUE`` options."""
    from experiments.errors import InputError

    pairs = [text.partition("=") for text in texts]
    for text, (name, equals, value) in zip(texts, pairs, strict=True):
        if not (name.strip() and equals and value.strip()):
            raise InputError("needs NAME=VALUE, for example E=0.48", text, "--set")
    return {name.strip(): value.strip() for name, _, value in pairs}


def _quantity(text: str, dimension: str, option: str) -> float:
    """Read an option's quantity in SI."""
    from experiments.errors import InputError
    from experiments.studyfile.units import Quantity

    try:
        return Quantity.parse(text).to_base(dimension)
    except ValueError as error:
        raise InputError(str(error), text, option) from None
