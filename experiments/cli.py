"""The command line ``dem-warp``: each command checks its input, calls public functions and shows the result.

Imports of the simulator, the statistics and the pictures are inside the commands: ``--help`` needs none.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from experiments.commands.console import FAILED_RUN, CaseProgress, clear_errors, fail, messages

if TYPE_CHECKING:
    from experiments.calibrate.results import StageResult
    from experiments.cases import Heap
    from experiments.commands.discover import Job

app = typer.Typer(
    name="dem-warp",
    help="Calibrate discrete element models of grain: simulated heaps, designed experiments, repose angles.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
)

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
AsJson = Annotated[bool, typer.Option("--json", help="Write the result to standard output as JSON.")]


@app.command(epilog="Example: [bold]dem-warp calibrate mygrain.toml --out out/mygrain[/]")
def calibrate(
    study: StudyFile = None,
    out: Annotated[Path | None, typer.Option(help="Folder of the results, new or empty.")] = None,
    scale: Scale = None,
    device: Device = None,
    workers: Workers = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on in the folder of an earlier run.")] = False,
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
        from experiments.commands.choices import chosen_device, chosen_study, default_folder
        from experiments.commands.run import (
            Desk,
            check_runs,
            found_by,
            record_paper,
            replay_paper,
            run_campaign,
        )

        device = chosen_device(device)
        chosen = chosen_study(study, scale, device)
        folder = out or default_folder(chosen)
        check_runs(chosen, campaign=not only_paper, paper=follow_paper or only_paper)
    again = {"--follow-paper": follow_paper, "--only-paper": only_paper}
    with clear_errors(resume=_resume_command(study, folder, chosen.scale, device, again, paper_replicates)):
        messages.print(f"{chosen.name}, on {device}", chosen.note, sep="\n", markup=False)
        desk = Desk.open(chosen, folder, device, workers, resume, CaseProgress)
        replay = replay_paper(desk, paper_replicates) if follow_paper or only_paper else None
        campaign = None if only_paper else run_campaign(desk, _show_stage, replay)
        if replay is not None:
            messages.print(f"The paper's runs: {record_paper(desk, replay, campaign)}")
    if as_json:
        typer.echo(json.dumps(found_by(campaign, replay), allow_nan=False))
    if campaign is None:
        return
    messages.print(f"{campaign.outcome}: {campaign.reason}")
    messages.print(f"Report: {folder / 'report.html'}")
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
    out: Annotated[Path | None, typer.Option(help="Folder of the results, new or empty.")] = None,
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
    resume: Annotated[bool, typer.Option("--resume", help="Go on in the folder of an earlier run.")] = False,
    as_json: AsJson = False,
) -> None:
    """Find the effect that a model lacks: calibrate, test the gap, name what explains it, show it closed."""
    with clear_errors():
        from experiments.commands.choices import chosen_devices, chosen_study, default_folder
        from experiments.commands.discover import Job, run_search
        from experiments.report.discovery import results_of, verdict_line

        device = chosen_devices(device)
        chosen = chosen_study(study, scale, device)
        folder = out or default_folder(chosen, "discover")
        job = Job(chosen, measured, folder, bank, photographs_only, device, workers, seed)
    with clear_errors(resume=_resume_search(job, scale)):
        messages.print(f"{chosen.name}, on {device}", chosen.note, sep="\n", markup=False)
        ended = run_search(job, resume, CaseProgress)
    if ended.discovery is None:
        messages.print(f"Library waves: {ended.page}")
        return
    if as_json:
        typer.echo(json.dumps(results_of(ended.discovery, ended.terms), allow_nan=False))
    messages.print(verdict_line(ended.discovery, ended.terms), markup=False)
    messages.print(f"Report: {ended.page}")


@app.command(epilog="Example: [bold]dem-warp heap --scale bench --set E=0.48 --set F=0.45 --seed 7[/]")
def heap(
    study: StudyFile = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Value of a factor."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of sizes, places and orientations.")] = 1,
    scene: Annotated[
        str | None, typer.Option(metavar="NAME", help="A further scene of the study, [response-scene.NAME].")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder of the results, new or empty.")] = None,
    scale: Scale = None,
    device: Device = None,
    as_json: AsJson = False,
) -> None:
    """Simulate one heap: heap.vtp (ParaView), snapshot.png with the fitted flanks, angle.json.

    A study of a hopper, a drum or a draw-down gives what that test measures instead of the angle; so does
    --scene with a further scene of the study.
    """
    with clear_errors():
        from experiments.cases import require_unused, simulate_heap, write_heap
        from experiments.commands.choices import chosen_device, chosen_study, default_folder
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
        _print_measured(simulated)


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
            typer.echo(photographs.csv_table(rows), nl=False)
        elif as_json:
            result = {"pictures": rows, "mean": mean.to_dict() if mean else None}
            typer.echo(json.dumps(result, allow_nan=False))
        else:
            _print_angles(rows, fit)
            if mean:
                typer.echo(str(mean))
    for row in rows:
        for doubt in row["doubts"]:
            messages.print(f"Doubtful: {row['picture']}: {doubt}", markup=False)
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
    spheres: Annotated[int | None, typer.Option(min=1, help="Spheres to fill the solid with.")] = None,
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
        _print_clump(made.to_dict(mass_density))


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
            from experiments.discover.data.template import write_measured_template
            from experiments.studyfile import load_study

            study = Path(name) if name.endswith(".toml") else Path(f"{name}.toml")
            path, then = write_measured_template(load_study(study)), f"dem-warp discover {study}"
        else:
            from experiments.studyfile import write_template

            path, then = write_template(name), "dem-warp calibrate"
    typer.echo(f"Wrote {path}. Fill it in, then: {then} {path}")


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


def _show_stage(name: str, result: StageResult) -> None:
    """Show what a stage decided, as it ends."""
    for decision in result.decisions:
        messages.print(f"{name.replace('_', ' ')}: {decision.outcome}", markup=False)


def _print_clump(facts: dict[str, Any]) -> None:
    """Show a clump's facts, one a line, without its spheres."""
    moments = ", ".join(f"{moment:.4f}" for moment in facts["inertia_over_mass_mm2"])
    typer.echo(f"spheres {facts['sphere_count']}, bounding radius {facts['bounding_radius_mm']:.3f} mm")
    typer.echo(f"volume {facts['volume_mm3']:.4f} mm3 (overlaps counted once)")
    typer.echo(f"inertia over mass {moments} mm2 (principal)")
    if facts["mass_mg"] is not None:
        typer.echo(f"mass {facts['mass_mg']:.4f} mg")
    if facts["coverage"] is not None:
        typer.echo(f"covers {facts['coverage']:.1%} of the solid, passes it by {facts['overshoot']:.1%}")


def _resume_command(
    study: Path | None, folder: Path, scale: str | None, device: str, flags: dict[str, bool], replicates: int
) -> str:
    words = ["dem-warp calibrate", *([str(study)] if study else []), f"--out {folder}"]
    words += [*([f"--scale {scale}"] if scale else []), f"--device {device}"]
    if given := [flag for flag, wanted in flags.items() if wanted]:
        words += [*given, f"--paper-replicates {replicates}"]
    return " ".join([*words, "--resume"])


def _resume_search(job: Job, scale: str | None) -> str:
    words = ["dem-warp discover", str(job.study.file), *([str(job.measured)] if job.measured else [])]
    words += [f"--out {job.folder}", *([f"--bank {job.bank}"] if job.bank else [])]
    words += ["--photographs-only"] if job.photographs_only else []
    words += [*([f"--scale {scale}"] if scale else []), f"--device {job.device} --seed {job.seed}"]
    return " ".join([*words, "--resume"])


def _print_measured(simulated: Heap) -> None:
    """Show the angle of a heap; for a test that leaves none, what else it measures, one a line."""
    if simulated.angle:
        typer.echo(f"{simulated.angle.mean:.2f} +- {simulated.angle.se:.2f} degrees")
        return
    for name, unit in simulated.units.items():
        value = simulated.result.observables[name]
        typer.echo(f"{name.replace('_', ' ')}: {value:.5g} {'' if unit == '1' else unit}".rstrip())


def _print_angles(rows: list[dict[str, Any]], fit: str) -> None:
    table = Table(title=f"Repose angles in degrees, {fit} fit")
    table.add_column("picture", overflow="fold")
    for name in ("left", "right", "mean", "se"):
        table.add_column(name, justify="right")
    table.add_column("doubts", overflow="fold")
    for row in rows:
        if row["mean"] is not None:
            values = [f"{row[name]:.2f}" for name in ("left", "right", "mean", "se")]
            doubts = ", ".join(doubt.partition(":")[0] for doubt in row["doubts"])
            table.add_row(row["picture"], *values, doubts)
    if table.row_count:
        Console().print(table)
