"""Cost of a grain: time of a step and memory, against the grains of a world and the number of worlds.

The scene is a settled bed of reference clumps, some 20 mm deep in a tube as wide as they need; they fall from
a lattice and are timed at rest. Worlds are copies of one bed. The shear modulus is a hundredth of the
study's, the skin that of the real modulus.

    python -m experiments.evidence.performance.grain_cost --device cpu --grains 300,1000,3000 --worlds 1,2
    python -m experiments.evidence.performance.grain_cost --device cuda

Writes cost.csv, cost.png and cost.md to `--out`; `record.py` puts them into README.md.
"""

import gc
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer
import warp as wp

from dem_warp import ClumpShape
from dem_warp.device import resolve_device
from dem_warp.model import ContactCoefficients, WorldSetup
from dem_warp.solver import Solver
from dem_warp.walls import Cylinder, Plane
from doe.plots.palette import BLUE, GRID, VERMILION
from experiments.commands.options import OneDevice
from experiments.evidence.machine import machine
from experiments.evidence.page_figures import new_axes, save_figure
from experiments.evidence.performance.columns import CLUMP, reference_case
from experiments.evidence.performance.result_pages import parse_counts, write_results
from experiments.evidence.performance.roofline import memory_bytes
from experiments.evidence.performance.timing import run_in, time_steps
from experiments.evidence.verification.problems.setups import bodies

DEPTH = 0.020
"""Of a bed at rest, roughly [m]."""

SOLID_FRACTION = 0.46
"""Of a bed at rest, roughly."""

SKIN = 4.0e-4
"""Of the neighbour lists [m]."""

FALL_SPEED = 0.5
"""At the start [m/s]."""

SETTLING = 0.45
"""Simulated time from the lattice to rest [s]."""

STEPS = 1024
"""Of a stretch."""

GRAINS = "300,1000,3000,10000,30000,100000,300000"


def bed(count: int, seed: int = 0) -> WorldSetup:
    """Grains on a lattice over a plate, turned at random, that will settle to a bed."""
    case = reference_case("soft")
    grain, steel = case.grain_material, case.scene.wall_material
    shape = ClumpShape.read(CLUMP)
    reach = shape.bounding_radius
    radius = float(np.sqrt(count * shape.volume / (SOLID_FRACTION * DEPTH * np.pi))) + reach
    positions = _lattice(count, radius - reach, 2.0 * reach)
    top = float(positions[:, 2].max()) + 2.0 * reach
    turned = np.random.default_rng(seed).normal(size=(count, 4))
    fall = (0.0, 0.0, -FALL_SPEED)
    grains = bodies(positions, grain.density, velocities=fall, orientations=turned)
    return WorldSetup(
        grains=grains,
        shapes=(shape,),
        contacts=(
            ContactCoefficients.of_pair(grain, grain, case.grain_grain),
            ContactCoefficients.of_pair(grain, steel, case.grain_wall),
        ),
        walls=((Plane(), 1), (Cylinder((0.0, 0.0, 0.0), radius, top), 1)),
        time_step=case.time_step,
        skin=SKIN,
        speed_limit=20 * float(np.sqrt(FALL_SPEED**2 + 2 * 9.81 * top)),
        domain=((-2 * radius, -2 * radius, -reach), (2 * radius, 2 * radius, top + reach)),
    )


def _lattice(count: int, radius: float, spacing: float) -> np.ndarray:
    """Points of a cubic lattice in an upright cylinder, from the bottom up [m], (count, 3)."""
    across = np.arange(-int(radius / spacing), int(radius / spacing) + 1) * spacing
    x, y = (axis.ravel() for axis in np.meshgrid(across, across))
    inside = x**2 + y**2 <= radius**2
    layer = np.column_stack([x[inside], y[inside]])
    number = np.arange(count)
    return np.column_stack([layer[number % len(layer)], (0.5 + number // len(layer)) * spacing])


def cost_row(grains: int, worlds: int, device: str) -> dict[str, float]:
    """Time and memory of one batch of settled beds."""
    target = wp.get_device(device)
    gc.collect()  # a solver before this one gives its memory back
    wp.synchronize_device(target)
    free = target.free_memory if target.is_cuda else 0
    solver = Solver([bed(grains)] * worlds, device)
    run_in(solver, SETTLING)
    timing = time_steps(solver, STEPS)
    taken = free - target.free_memory if target.is_cuda else np.nan
    total = grains * worlds
    return {
        "grains a world": grains,
        "worlds": worlds,
        "grains": total,
        "us a step": 1e6 * timing.step_seconds,
        "ns a grain and step": 1e9 * timing.step_seconds / total,
        "million sphere-steps/s": timing.sphere_steps / 1e6,
        "rebuilds per 1000": 1000 * timing.rebuilds,
        "kB a grain": memory_bytes(solver) / total / 1e3,
        "kB a grain, driver": taken / total / 1e3,
    }


def draw_cost(table: pd.DataFrame, singles: int, title: str, path: Path) -> None:
    """Plot the cost against the grains of the batch; the table's first `singles` rows are single worlds."""
    figure, axes = new_axes(7.0, 4.2)
    one, many = table.iloc[:singles], table.iloc[singles:]
    axes.loglog(one["grains"], one["ns a grain and step"], "o-", color=BLUE, label="one world")
    label = f"worlds of {many['grains a world'].iloc[0]:.0f} grains"
    axes.loglog(many["grains"], many["ns a grain and step"], "s--", color=VERMILION, label=label)
    axes.set(xlabel="grains of the batch", ylabel="time [ns] a grain and step", title=title)
    decades = np.log10(table["ns a grain and step"])
    axes.set_ylim(10.0 ** np.floor(decades.min()), 10.0 ** np.ceil(decades.max()))
    for axis, form in ((axes.xaxis, "{x:,.0f}"), (axes.yaxis, "{x:g}")):
        axis.set_major_formatter(form)
        axis.set_minor_formatter("")
    axes.grid(which="minor", color=GRID)
    axes.legend(frameon=False)
    save_figure(figure, path, dpi=150)


def main(
    device: OneDevice = "cpu",
    grains: Annotated[str, typer.Option(help="Grains of a single world.")] = GRAINS,
    worlds: Annotated[str, typer.Option(help="Numbers of worlds.")] = "1,2,4,8,16,32,64,128,256,512",
    world_grains: Annotated[int, typer.Option(help="Grains of each of these worlds.")] = 2600,
    out: Annotated[Path, typer.Option(help="Folder of the results.")] = Path("out/cost"),
) -> None:
    """Measure, print and write the table and its plot; what is measured is on disk at once."""
    name, sizes = resolve_device(device), parse_counts(grains)
    text = f"Settled beds of reference clumps on {machine(name)}."
    batches = [(count, 1) for count in sizes] + [(world_grains, count) for count in parse_counts(worlds)]
    rows = []
    for batch in batches:
        rows.append(cost_row(*batch, name))
        page = write_results(out, "cost", [("cost", text, pd.DataFrame(rows))])
    draw_cost(pd.DataFrame(rows), len(sizes), machine(name), out / "cost.png")
    print(page.read_text(encoding="utf-8"))


if __name__ == "__main__":
    typer.run(main)
