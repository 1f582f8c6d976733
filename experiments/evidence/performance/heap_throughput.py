"""Speed of columns of grains while filling, settled and lifting, compared with what the memory allows.

A sphere-step is one sphere of a grain moved on by one step. Grains of the rain that have yet to be released
are moved on too, but meet nobody: `of free grains` leaves them out. The columns are simulated once and kept
(`--columns`); worlds beyond `--seeds` hold the same columns at other moments.

    python -m experiments.evidence.performance.heap_throughput --scale soft --device cpu
    python -m experiments.evidence.performance.heap_throughput --scale printed --device cuda --worlds 1,128

Every table goes to `--out` as CSV, and all of them to throughput.md, which `performance_record` puts into
README.md.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated

import pandas as pd
import typer

from dem_warp.device import resolve_device
from dem_warp.solver import Solver
from experiments.commands.options import OneDevice
from experiments.evidence.machine import machine
from experiments.evidence.performance.columns import MOMENTS, Columns
from experiments.evidence.performance.result_pages import Part, parse_counts, write_results
from experiments.evidence.performance.roofline import Traffic, copy_bandwidth, step_traffic
from experiments.evidence.performance.timing import Timing, run_in, start, time_steps


def speed_tables(columns: Columns, counts: Sequence[int], steps: int) -> Iterator[list[Part]]:
    """Time every phase with each number of worlds, and count what a settled grain must move.

    All that is known so far is yielded after each number of worlds.
    """
    bandwidth = copy_bandwidth(columns.device)
    text = (
        f"Scale `{columns.scale}` on {machine(columns.device)}. Grains are those of a world. A copy runs at "
        f"{bandwidth / 1e9:.0f} GB/s; `floor` is the time that the least traffic of a step takes at it."
    )
    least = "Least traffic of a step in a settled column: bytes of an element, elements a grain, moves."
    rows, settled = [], pd.DataFrame()
    for count in counts:
        for phase in MOMENTS:
            solver = start(columns.moments(phase, count), columns.device)
            run_in(solver)
            timing, traffic = time_steps(solver, steps), step_traffic(solver)
            if phase == "settled":
                settled = traffic.table
            rows.append({"worlds": count, "phase": phase} | _speed_row(solver, timing, traffic, bandwidth))
        yield [("throughput", text, pd.DataFrame(rows)), ("traffic", least, settled)]


def _speed_row(solver: Solver, timing: Timing, traffic: Traffic, bandwidth: float) -> dict[str, float]:
    layout = solver.layout
    floor = traffic.bytes_per_grain * layout.grain_total / bandwidth
    return {
        "grains": layout.grain_count,
        "free grains": timing.free_spheres / layout.sphere_count / layout.world_count,
        "lanes": solver.lanes,
        "us a step": 1e6 * timing.step_seconds,
        "million sphere-steps/s": layout.sphere_total / timing.step_seconds / 1e6,
        "of free grains": timing.sphere_steps / 1e6,
        "rebuilds per 1000": 1000 * timing.rebuilds,
        "near": traffic.list_length,
        "touching": traffic.touching,
        "B a grain": traffic.bytes_per_grain,
        "floor us": 1e6 * floor,
        "of floor": floor / timing.step_seconds,
    }


def main(
    scale: Annotated[str, typer.Option(help="Scale of the study: bench, soft or printed.")] = "soft",
    device: OneDevice = "cpu",
    worlds: Annotated[str, typer.Option(help="Numbers of worlds to measure, such as 1,12,31,128.")] = "1",
    seeds: Annotated[int, typer.Option(help="Most columns to simulate beforehand.")] = 32,
    steps: Annotated[int, typer.Option(help="Steps of a stretch.")] = 2048,
    columns: Annotated[Path, typer.Option(help="Folder of simulated columns.")] = Path("out/columns"),
    out: Annotated[Path, typer.Option(help="Folder of the results.")] = Path("out/throughput"),
) -> None:
    """Measure, print and write the tables."""
    name, counts = resolve_device(device), parse_counts(worlds)
    prepared = Columns(scale, min(max(counts), seeds), name, columns)
    for parts in speed_tables(prepared, counts, steps):
        page = write_results(out, "throughput", parts)
    print(page.read_text(encoding="utf-8"))


if __name__ == "__main__":
    typer.run(main)
