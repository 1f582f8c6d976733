"""Large campaigns from measured speeds: time, cores and disk for many cases on many GPUs.

    python -m experiments.benchmarks.cluster.plan

The cases are those of the paper's study at scale ``paper``. A launch takes as long as its steps; how long a
step takes with so many worlds is read off ``record/throughput-gpu.csv``, lifting. `docs/howto/cluster.md` has
the table.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd
import typer

from experiments.report.kit.markdown import markdown_table

RECORD = Path(__file__).parents[1] / "record" / "throughput-gpu.csv"

STEPS = 1.3e6
"""Of a heap of the paper's study (`experiments/benchmarks/README.md`)."""

MEASURING = 1.6
"""Time of a core that measuring such a heap takes, eight views of 2,500 clumps [s]."""

STORED = 0.19e6
"""Size of a stored case [bytes]."""

WORLDS = 128
"""Worlds of a launch: FULL_GRAINS of `experiments.cases.workers.batches`, by 2,500 grains."""

CASES, GPUS = (10_000, 1_000_000), (8, 64, 512)


def planned(cases: int, gpus: int, steps: pd.DataFrame) -> dict[str, object]:
    """Row of so many cases on so many GPUs."""
    rounds = math.ceil(cases / (gpus * WORLDS))
    worlds = math.ceil(cases / (gpus * rounds))
    step = float(np.interp(worlds, steps["worlds"], steps["us a step"])) * 1e-6
    seconds = rounds * STEPS * step
    return {
        "cases": f"{cases:,}",
        "GPUs": gpus,
        "worlds a launch": worlds,
        "launches a GPU": rounds,
        "hours": f"{seconds / 3600.0:.2f}",
        "GPU hours": f"{gpus * seconds / 3600.0:,.0f}",
        "heaps a second": f"{cases / seconds:.1f}",
        "cores that measure": math.ceil(cases * MEASURING / seconds),
        "disk, GB": f"{cases * STORED / 1e9:,.1f}",
    }


def table() -> pd.DataFrame:
    """Table of all cases on all GPUs."""
    record = pd.read_csv(RECORD)
    lifting = record[record["phase"] == "lifting"].sort_values("worlds")
    return pd.DataFrame([planned(cases, gpus, lifting) for cases in CASES for gpus in GPUS])


if __name__ == "__main__":
    typer.echo(markdown_table(table()))
