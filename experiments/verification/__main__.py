"""Does the simulator do what its equations say: closed forms, published tests, an energy account.

Each family of problems is one file of `problems` and one line of `PROBLEMS`.

    python -m experiments.benchmarks.verification
    python -m experiments.benchmarks.verification --only energy --only rigid-body
    python -m experiments.benchmarks.verification --only heap-angle --device cuda --out out/gpu

The page of the last recorded run is record/verification/README.md. The exit code is 1 when a row fails.
"""

import time
from pathlib import Path
from typing import Annotated

import matplotlib as mpl
import typer
import warp as wp

from dem_warp.device import resolve_device
from experiments.benchmarks.problems.beverloo import beverloo
from experiments.benchmarks.problems.chapter import Chapter, Problem
from experiments.benchmarks.problems.energy import energy
from experiments.benchmarks.problems.friction_and_rolling import friction_and_rolling
from experiments.benchmarks.problems.heap_angle import heap_angle
from experiments.benchmarks.problems.janssen import janssen
from experiments.benchmarks.problems.micro_slip import micro_slip
from experiments.benchmarks.problems.normal_impact import elastic_impact, restitution
from experiments.benchmarks.problems.oblique_impact import oblique_impact, spinning_impact
from experiments.benchmarks.problems.page import summary, write_chapter, write_page
from experiments.benchmarks.problems.rigid_body import rigid_body
from experiments.benchmarks.problems.stability import stability

PROBLEMS: dict[str, Problem] = {
    "elastic-impact": elastic_impact,
    "restitution": restitution,
    "oblique-impact": oblique_impact,
    "micro-slip": micro_slip,
    "spinning-impact": spinning_impact,
    "friction-and-rolling": friction_and_rolling,
    "rigid-body": rigid_body,
    "energy": energy,
    "janssen": janssen,
    "beverloo": beverloo,
    "heap-angle": heap_angle,
    "stability": stability,
}

HEAVY = ("beverloo", "heap-angle", "stability")
"""Problems that run only when they are named: minutes on a GPU, up to hours on two cores."""

RECORD = Path(__file__).with_name("record") / "verification"


def run_problem(name: str, device: str, folder: Path) -> Chapter:
    """Run a problem and write its section of the page into a folder."""
    started = time.perf_counter()
    chapter = PROBLEMS[name](device)
    seconds = time.perf_counter() - started
    machine = f"{wp.get_device(device).name}, Warp {wp.__version__}, {seconds:.0f} s."
    write_chapter(name, chapter, machine, folder)
    print(f"{name}: {summary(chapter.rows)}, {seconds:.0f} s", flush=True)
    return chapter


def main(
    only: Annotated[
        list[str] | None,
        typer.Option(help=f"A problem to run; may be repeated. By default all but {', '.join(HEAVY)}."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder; by default out/verification for named problems, otherwise the record."),
    ] = None,
    device: Annotated[str, typer.Option(help="cpu or cuda.")] = "cpu",
    page_only: Annotated[
        bool, typer.Option("--page-only", help="Run nothing; write the page from the chapters in the folder.")
    ] = False,
) -> None:
    """Run the verification problems and write their page; the heavy ones only when they are named.

    A page keeps the chapters that stand in its folder already, from whatever machine.
    """
    unknown = sorted(set(only or []) - set(PROBLEMS))
    if unknown:
        raise typer.BadParameter(f"a problem is one of {', '.join(PROBLEMS)}, got {', '.join(unknown)}")
    mpl.use("agg")
    folder = out or (Path("out/verification") if only else RECORD)
    names = [name for name in PROBLEMS if (name in only if only else name not in HEAVY)]
    chapters = [] if page_only else [run_problem(name, resolve_device(device), folder) for name in names]
    rows = [row for chapter in chapters for row in chapter.rows]
    print(f"{summary(rows)}; {write_page(folder, PROBLEMS)}")
    failed = [row for row in rows if row.passed is False]
    for row in failed:
        print(
            f"failed: {row.problem}, {row.case}, {row.quantity}: error {row.error:.3g} > {row.tolerance:.3g}"
        )
    if failed:
        raise typer.Exit(1)


if __name__ == "__main__":
    typer.run(main)
