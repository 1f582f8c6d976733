"""Time of settled columns by kernel: one step, and one rebuild of all neighbour lists.

    python -m experiments.evidence.performance.kernel_times --scale paper --device cuda --worlds 12

Kernels are launched one by one with a pause between, which costs some microseconds each.
"""

import time
from collections import defaultdict
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import pandas as pd
import typer
import warp as wp

from dem_warp.device import resolve_device
from dem_warp.kernels.stale import ALL
from dem_warp.solver import Solver
from experiments.commands.options import OneDevice
from experiments.evidence.machine import machine
from experiments.evidence.performance.columns import Columns
from experiments.evidence.performance.result_pages import write_results
from experiments.evidence.performance.timing import run_in, start

REPEATS = 20


def kernel_times(solver: Solver) -> pd.DataFrame:
    """Mean time of each kernel, every world being rebuilt [ms]."""
    seconds: dict[str, float] = defaultdict(float)
    launches: dict[str, int] = defaultdict(int)
    launch, step = solver._launch, solver._step

    def timed(name: str, act: Callable[..., None], *arguments: Any) -> None:
        wp.synchronize_device(solver.device)
        started = time.perf_counter()
        act(*arguments)
        wp.synchronize_device(solver.device)
        seconds[name] += time.perf_counter() - started
        launches[name] += 1

    def timed_launch(kernel: wp.Kernel, dim: int, inputs: list[Any]) -> None:
        timed(kernel.key.split("__")[-1], launch, kernel, dim, inputs)

    solver._launch = timed_launch  # type: ignore[method-assign]
    solver._step = partial(timed, "step", step)  # type: ignore[method-assign]
    try:
        for _ in range(REPEATS):
            solver.stale.fill_(ALL)
            solver.any_stale.fill_(1)
            solver._cycle(2)
    finally:
        solver._launch, solver._step = launch, step  # type: ignore[method-assign]
    rows = [(name, 1e3 * total / launches[name]) for name, total in seconds.items()]
    return pd.DataFrame(rows, columns=["kernel", "ms"])


def main(
    scale: Annotated[str, typer.Option(help="Scale of the buckwheat study: bench, soft or paper.")] = "soft",
    device: OneDevice = "cpu",
    worlds: Annotated[int, typer.Option(help="Number of worlds.")] = 1,
    columns: Annotated[Path, typer.Option(help="Folder of simulated columns.")] = Path("out/columns"),
    out: Annotated[Path, typer.Option(help="Folder of the results.")] = Path("out/kernels"),
) -> None:
    """Measure, print and write the table."""
    name = resolve_device(device)
    solver = start(Columns(scale, worlds, name, columns).moments("settled", worlds), name)
    run_in(solver)
    text = f"One step, and one rebuild of {worlds} settled columns, by kernel; {machine(name)}."
    page = write_results(out, "kernels", [("kernels", text, kernel_times(solver))])
    print(page.read_text(encoding="utf-8"))


if __name__ == "__main__":
    typer.run(main)
