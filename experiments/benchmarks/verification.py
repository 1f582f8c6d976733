"""Does the simulator do what its equations say: closed forms, published tests, an energy account.

Each family of problems is one file of `problems` and one line of `PROBLEMS`.

    python -m experiments.benchmarks.verification
    python -m experiments.benchmarks.verification --only energy --only rigid-body --out out/verification

The page of the last recorded run is record/verification/README.md. The exit code is 1 when a row fails.
"""

import time
from pathlib import Path
from typing import Annotated

import matplotlib as mpl
import typer
import warp as wp

from dem_warp.device import resolve_device
from experiments.benchmarks.problems.chapter import Chapter, Problem
from experiments.benchmarks.problems.energy import energy
from experiments.benchmarks.problems.friction_and_rolling import friction_and_rolling
from experiments.benchmarks.problems.normal_impact import elastic_impact, restitution
from experiments.benchmarks.problems.oblique_impact import micro_slip, oblique_impact, spinning_impact
from experiments.benchmarks.problems.page import summary, write_page
from experiments.benchmarks.problems.rigid_body import rigid_body

PROBLEMS: dict[str, Problem] = {
    "elastic-impact": elastic_impact,
    "restitution": restitution,
    "oblique-impact": oblique_impact,
    "micro-slip": micro_slip,
    "spinning-impact": spinning_impact,
    "friction-and-rolling": friction_and_rolling,
    "rigid-body": rigid_body,
    "energy": energy,
}

RECORD = Path(__file__).with_name("record") / "verification"


def run_problems(names: list[str], device: str) -> list[Chapter]:
    """Chapters of the named problems, in the order of `PROBLEMS`; all where none is named."""
    chapters = []
    for name, problem in PROBLEMS.items():
        if not names or name in names:
            started = time.perf_counter()
            chapters.append(problem(device))
            seconds = time.perf_counter() - started
            print(f"{name}: {summary(chapters[-1:])}, {seconds:.0f} s", flush=True)
    return chapters


def main(
    only: Annotated[list[str] | None, typer.Option(help="A problem to run; may be repeated.")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder; by default the record, if all is run.")] = None,
    device: Annotated[str, typer.Option(help="cpu or cuda.")] = "cpu",
) -> None:
    """Run the verification problems and write their page."""
    names = only or []
    unknown = sorted(set(names) - set(PROBLEMS))
    if unknown:
        raise typer.BadParameter(f"a problem is one of {', '.join(PROBLEMS)}, got {', '.join(unknown)}")
    mpl.use("agg")
    resolved = resolve_device(device)
    started = time.perf_counter()
    chapters = run_problems(names, resolved)
    seconds = time.perf_counter() - started
    machine = f"Device {wp.get_device(resolved).name}, Warp {wp.__version__}, {seconds:.0f} s."
    page = write_page(chapters, out or (Path("out/verification") if names else RECORD), machine)
    print(f"{summary(chapters)}; {page}")
    for row in (row for chapter in chapters for row in chapter.rows if row.passed is False):
        print(
            f"failed: {row.problem}, {row.case}, {row.quantity}: error {row.error:.3g} > {row.tolerance:.3g}"
        )
    if any(row.passed is False for chapter in chapters for row in chapter.rows):
        raise typer.Exit(1)


if __name__ == "__main__":
    typer.run(main)
