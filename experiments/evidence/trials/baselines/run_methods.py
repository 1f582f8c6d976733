"""Let every method answer trials: those of the benchmark, or measured ones.

    python -m experiments.evidence.trials.baselines.run_methods out/baselines --count 120
    python -m experiments.evidence.trials.baselines.run_methods out/measured TRIALS --bank BANK

TRIALS is a folder of trials or a record with its heaps; what the search found there is not searched again.
Answers are kept as trials end; the same command continues.
"""

import math
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated

import typer

from experiments.commands.console import clear_errors
from experiments.evidence.trials.baselines import benchmark_files
from experiments.evidence.trials.baselines.answers_table import add_answer, answered, file_of
from experiments.evidence.trials.baselines.benchmark_files import load_benchmark
from experiments.evidence.trials.baselines.emulated_world import fresh_runs
from experiments.evidence.trials.baselines.measured_problems import measured_problems
from experiments.evidence.trials.baselines.method_list import installed, methods
from experiments.evidence.trials.baselines.protocol import Method, Problem
from experiments.io.errors import InputError


def emulated_problems(folder: Path, count: int | None) -> Iterator[Problem]:
    """Pose the first trials of a benchmark."""
    benchmark = load_benchmark(folder)
    for trial in benchmark.trials[:count]:
        yield benchmark.problem(trial)


def answer_all(out: Path, problems: Iterator[Problem], wanted: Mapping[str, Method], seconds: float) -> int:
    """Answer trials in turn until all are, or no time is left; count those that were answered in full."""
    deadline = time.monotonic() + seconds
    done = {name: answered(file_of(out, name)) for name in wanted}
    count = 0
    for problem in problems:
        for name, method in wanted.items():
            if time.monotonic() > deadline:
                return count
            if problem.trial not in done[name]:
                started = time.process_time()
                answer = method(problem)
                add_answer(file_of(out, name), problem.trial, answer, time.process_time() - started)
        count += 1
    return count


def chosen(names: str, known: Mapping[str, Method]) -> dict[str, Method]:
    """Pick methods by their names, parted by semicolons; without any all that are installed."""
    wanted = [name.strip() for name in names.split(";") if name.strip()] or list(installed(known))
    for name in wanted:
        if name not in known:
            raise InputError("--methods", f"must be one of {'; '.join(known)}", name)
    return {name: known[name] for name in wanted}


def main(
    out: Annotated[Path, typer.Argument(help="Folder of the answers.")],
    folder: Annotated[
        Path | None, typer.Argument(help="Measured trials, or a record; left out: none.")
    ] = None,
    benchmark: Annotated[Path, typer.Option(help="Folder of the benchmark.")] = benchmark_files.FOLDER,
    bank: Annotated[Path | None, typer.Option(help="Bank of measured trials; left out: its own.")] = None,
    names: Annotated[
        str, typer.Option("--methods", help="Names parted by ';'; left out: all installed.")
    ] = "",
    count: Annotated[int | None, typer.Option(help="Number of trials. Default: all.", min=1)] = None,
    seconds: Annotated[float, typer.Option(help="Begin nothing after this time.")] = math.inf,
) -> None:
    """Let the methods answer what they have not answered."""
    with clear_errors("Resume with the same command."):
        if folder is None:
            problems, wanted = emulated_problems(benchmark, count), chosen(names, methods(fresh_runs))
        else:
            problems, wanted = measured_problems(folder, bank, count), chosen(names, methods(None))
        answers = answer_all(out, problems, wanted, seconds)
        print(f"{answers} trials have an answer of every method: {out}")


if __name__ == "__main__":
    typer.run(main)
