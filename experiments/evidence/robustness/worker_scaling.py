"""One worker and two on the same wave: how much faster, and are the bits the same?

    python -m experiments.evidence.robustness.cluster.scaling --cases 12
    python -m experiments.evidence.robustness.cluster.scaling --gpus --scale soft --cases 102
    python -m experiments.evidence.robustness.cluster.scaling --gpus --study STUDY.toml --scale "" --cases 2048
    python -m experiments.evidence.robustness.cluster.scaling --gpus --gpu-workers 1 --gpu-workers 2

The wave is of heaps of one study. On CPUs it runs on this machine's own processes and on workers of Dask,
with one and with two of each; on GPUs with one of them and with two, each with as many workers as is said.
Processes run a case each before, so that they are there and have their kernels. The load of the machine is
part of the answer: on one that others use, two workers get what is left.
"""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer

from dem_warp import Case, CaseResult
from experiments.cases import Resources, Workers, open_workers
from experiments.evidence.performance.result_pages import write_results
from experiments.studyfile import load_study
from experiments.studyfile.cluster_section import ClusterSection


def timed(workers: Workers, cases: Sequence[Case]) -> tuple[float, list[CaseResult]]:
    """Wall time of a wave from its order to its last result, and its results.

    Every worker has run one of the cases before: it is there, and has its kernels. The clock starts with the
    order, and not with the first progress, of which a worker of Dask tells two seconds late.
    """
    workers.simulate(cases[: workers.count])
    started = time.perf_counter()
    results = workers.simulate(cases)
    return time.perf_counter() - started, results


def same_bits(some: Sequence[CaseResult], others: Sequence[CaseResult]) -> bool:
    """Tell that heaps agree in every bit; how often lists were made anew may depend on the company."""
    return all(
        np.array_equal(a.positions, b.positions) and _seen(a) == _seen(b)
        for a, b in zip(some, others, strict=True)
    )


def _seen(result: CaseResult) -> dict[str, float]:
    return {name: value for name, value in result.observables.items() if name != "rebuilds"}


def resources(kind: str, count: int, each: int | None = None) -> Resources:
    """So many workers of a kind, or GPUs with so many workers each."""
    if kind == "GPUs":
        return Resources(None, count, gpu_workers=each)
    section = ClusterSection(workers=count, gpu=False) if kind == "Dask" else None
    return Resources("cpu", count, None, section)


def main(
    cases: Annotated[int, typer.Option(help="Heaps of the wave.")] = 12,
    study: Annotated[Path | None, typer.Option(help="Study of the heaps; left out: the paper's.")] = None,
    scale: Annotated[str, typer.Option(help="Scale of the study; empty: as written.")] = "bench",
    gpus: Annotated[bool, typer.Option("--gpus", help="Use GPUs, not cores.")] = False,
    gpu_workers: Annotated[
        list[int] | None, typer.Option(min=1, help="Workers a GPU, one number after another; as chosen else.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder of the table.")] = Path("out/scaling"),
) -> None:
    """Run the wave on one worker and on two, print each row as it is had, and write the table."""
    loaded = load_study(study, scale or None)
    wave = [loaded.case({}, seed) for seed in range(cases)]
    rows, reference = [], None
    each: list[int | None] = list(gpu_workers) if gpu_workers else [None]
    for kind, per in [("GPUs", n) for n in each] if gpus else [("own processes", None), ("Dask", None)]:
        alone = None
        for count in (1, 2):
            with open_workers(resources(kind, count, per)) as workers:
                seconds, results = timed(workers, wave)
                machine, launched = workers.machine, workers.count
            reference, alone = reference or results, alone or seconds
            bits = "same" if same_bits(results, reference) else "DIFFERENT"
            load = os.getloadavg()[0]
            rows.append((kind, count, launched, seconds, alone / seconds, bits, load))
            print(rows[-1], flush=True)
    columns = ["workers", "number", "processes", "seconds", "times as fast", "bits", "load at the end"]
    table = pd.DataFrame(rows, columns=columns)
    heaps = f"{cases} heaps of {loaded.name}, scale {scale or 'as written'}"
    text = f"{heaps}, on {machine}; the load counts this run too."
    print(write_results(out, "scaling", [("scaling", text, table)]).read_text(encoding="utf-8"))


if __name__ == "__main__":
    typer.run(main)
