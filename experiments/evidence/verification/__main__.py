"""Verification of the simulator against its equations: closed forms, published tests, an energy account.

    python -m experiments.evidence.verification
    python -m experiments.evidence.verification --only energy --only rigid-body
    python -m experiments.evidence.verification --only heap-angle --device cuda --out out/gpu

The page of the last recorded run is record/README.md. The exit code is 1 when a row fails.
"""

import time
from pathlib import Path
from typing import Annotated

import typer
import warp as wp

from dem_warp.device import resolve_device
from experiments.commands.options import OneDevice
from experiments.evidence.verification.check import Result
from experiments.evidence.verification.problem_list import HEAVY, PROBLEMS
from experiments.evidence.verification.verification_page import summary, write_result, write_verification

RECORD = Path(__file__).with_name("record")


def run_problem(name: str, device: str, folder: Path) -> Result:
    """Run a problem and write its chapter of the page into a folder."""
    started = time.perf_counter()
    result = PROBLEMS[name](device)
    seconds = time.perf_counter() - started
    machine = f"{wp.get_device(device).name}, Warp {wp.__version__}, {seconds:.0f} s."
    write_result(name, result, machine, folder)
    print(f"{name}: {summary(result.rows)}, {seconds:.0f} s", flush=True)
    return result


def main(
    only: Annotated[
        list[str] | None,
        typer.Option(help=f"A problem to run; may be repeated. By default all but {', '.join(HEAVY)}."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder; by default out/verification for named problems, otherwise the record."),
    ] = None,
    device: OneDevice = "cpu",
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
    folder = out or (Path("out/verification") if only else RECORD)
    names = [name for name in PROBLEMS if (name in only if only else name not in HEAVY)]
    results = [] if page_only else [run_problem(name, resolve_device(device), folder) for name in names]
    rows = [row for result in results for row in result.rows]
    print(f"{summary(rows)}; {write_verification(folder, PROBLEMS)}")
    failed = [row for row in rows if row.passed is False]
    for row in failed:
        print(
            f"failed: {row.problem}, {row.case}, {row.quantity}: error {row.error:.3g} > {row.tolerance:.3g}"
        )
    if failed:
        raise typer.Exit(1)


if __name__ == "__main__":
    typer.run(main)
