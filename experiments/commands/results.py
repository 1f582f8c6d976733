"""Results as text on standard output."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from experiments.commands.console import messages, plain

if TYPE_CHECKING:
    from experiments.cases import Heap, Resources
    from experiments.grains.clumps.clump_search import Trial
    from experiments.runs.calibration import StageResult
    from experiments.studyfile import Study


def show_stage(name: str, result: StageResult) -> None:
    """Show the decisions of a stage."""
    for decision in result.decisions:
        messages.print(f"{name.replace('_', ' ')}: {decision.outcome}")


def print_study(study: Study, resources: Resources) -> None:
    """Print the study, its workers, the programs that it starts, and doubts about it."""
    engine = study.engine and (study.engine.command or study.engine.name)
    by = f", simulated by the program: {engine}" if engine else ""
    messages.print(f"{study.name}, on {resources}{by}", study.note, sep="\n")
    for doubt in study.doubts():
        messages.print(f"Doubtful: {doubt}")


def print_clump(facts: Mapping[str, Any]) -> None:
    """Show a clump's facts, one per line, without its spheres."""
    moments = ", ".join(f"{moment:.4f}" for moment in facts["inertia_over_mass_mm2"])
    typer.echo(f"spheres {facts['sphere_count']}, bounding radius {facts['bounding_radius_mm']:.3f} mm")
    typer.echo(f"volume {facts['volume_mm3']:.4f} mm3 (overlaps counted once)")
    typer.echo(f"inertia over mass {moments} mm2 (principal)")
    if facts["mass_mg"] is not None:
        typer.echo(f"mass {facts['mass_mg']:.4f} mg")
    if facts["coverage"] is not None:
        typer.echo(f"covers {facts['coverage']:.1%} of the solid, passes it by {facts['overshoot']:.1%}")
        typer.echo(_quality(facts["trials"][-1]))


def print_trial(trial: Trial) -> None:
    """Show a number of spheres as it was tried."""
    messages.print(f"{trial.spheres:3d} spheres: {_quality(asdict(trial))}")


def _quality(trial: Mapping[str, Any]) -> str:
    """Errors of a clump, against its solid."""
    return (
        f"volume {trial['volume_error']:+.1%}, inertia {trial['inertia_error']:.1%} off, surface "
        f"{trial['surface_distance_mm']:.3f} mm ({trial['surface_error']:.1%}) off, "
        f"protrusion {trial['protrusion_mm']:.3f} mm"
    )


def print_measured(simulated: Heap) -> None:
    """Show the angle of a heap, or for a test without heaps its other observables, one per line."""
    if simulated.angle:
        typer.echo(f"{simulated.angle.mean:.2f} +- {simulated.angle.se:.2f} degrees")
        return
    for name, unit in simulated.units.items():
        value = simulated.observed.observables[name]
        typer.echo(f"{name.replace('_', ' ')}: {value:.5g} {'' if unit == '1' else unit}".rstrip())
    if simulated.filling is not None:
        from experiments.measurement.filling import filling_text

        scene = simulated.study.case(simulated.settings, simulated.seed, simulated.scene).scene
        typer.echo(f"filling: {filling_text(scene, simulated.filling)}")


HEAP_COLUMNS = {"left": "left", "right": "right", "mean": "mean", "se": "se"}
DRUM_COLUMNS = {
    "mean": "dynamic angle", "se": "se", "upper_angle": "upper", "lower_angle": "lower", "filling": "filling",
}  # fmt: skip
"""Columns of measured pictures, and their heads."""


def print_angles(rows: Sequence[Mapping[str, Any]], title: str, columns: Mapping[str, str]) -> None:
    """Lay out measured pictures as a table, with their doubts."""
    table = Table(title=title)
    table.add_column("picture", overflow="fold")
    for head in columns.values():
        table.add_column(head, justify="right")
    table.add_column("doubts", overflow="fold")
    for row in rows:
        if row["mean"] is not None:
            values = ["" if row[name] is None else f"{row[name]:.2f}" for name in columns]
            doubts = ", ".join(doubt.partition(":")[0] for doubt in row["doubts"])
            table.add_row(Text(plain(row["picture"])), *values, doubts)
    if table.row_count:
        # Names of files may have brackets, which are no markup.
        Console(markup=False).print(table)


def print_findings(rows: Sequence[Mapping[str, Any]]) -> None:
    """Print how heap files were read, and why angles are doubtful."""
    for row in rows:
        if row["mean"] is not None and row["source"] not in ("photograph", "drum"):
            messages.print(f"Read: {row['picture']}: {row['source']}")
        if row["correction"]:
            messages.print(f"Corrected: {row['picture']}: {row['correction']}")
        for doubt in row["doubts"]:
            messages.print(f"Doubtful: {row['picture']}: {doubt}")
