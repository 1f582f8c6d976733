"""Large campaigns from measured speeds: time, cores and disk for many cases on many GPUs.

    python -m experiments.evidence.robustness.cluster.plan --keeps 0.95

The cases are those of the paper's study at scale ``paper``. A launch takes as long as its steps; how long
a step takes with so many grains is read off ``record/throughput-gpu.csv``, lifting. That several GPUs keep a
part of their speed is an assumption, and an option. The documentation shows the page.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer

from experiments.report.kit.markdown import markdown_page, markdown_table

RECORD = Path(__file__).parents[1] / "record"
CAMPAIGN = Path(__file__).parents[2] / "studies" / "buckwheat" / "record" / "provenance.json"
"""Waves of the paper's study on one H200, with their wall times."""

NOT_MEASURED = (
    "What a GPU keeps beside **more than one** other is **not measured yet**. Worlds are independent, and "
    "nothing passes between GPUs but cases and results, so what several GPUs lose they lose to the host, "
    "which deals out, looks after worlds, stores and measures. Two H100s of one host, with two workers each, "
    "were 1.85 times as fast as one with two (2,048 heaps of 400 grains): each kept 92 %. Smaller heaps lose "
    "more: those of the trials, of a hundred grains, ran at 102 a second on two H200s, at 153 on four and at "
    "152 on eight, with a worker each (`experiments/evidence/trials/record`: fourth, fifth, sixth). The heaps planned "
    "here take some 150 times as long each."
)
"""Figure that is missing, and what is known instead."""

CASES, GPUS = (10_000, 1_000_000), (8, 64, 512)


@dataclass(frozen=True)
class Assumptions:
    """All that a plan takes as given beside the measured steps."""

    keeps: float = 0.95
    """Part of its speed that a GPU keeps beside others."""
    steps: float = 1.3e6
    """Of a heap, from the first grain to rest (`experiments/evidence/performance/README.md`)."""
    grains: int = 2500
    """Of a heap, each of nine spheres."""
    launch: int = 330_000
    """Grains of a full launch: FULL_GRAINS of `experiments.cases.workers.batches`."""
    start: float = 8.0
    """From the order of a launch to its first step [s]."""
    measuring: float = 1.6
    """Time of a core that measuring such a heap takes, eight views of it [s]."""
    stored: float = 0.19e6
    """Size of a stored case [bytes]."""

    @property
    def worlds(self) -> int:
        """Worlds of a full launch."""
        return max(self.launch // self.grains, 1)


def step_seconds(grains: float) -> float:
    """Wall time of a step of one H200 with so many grains, while the tube is lifted [s].

    What lies between two measured numbers is on a line; beyond the largest, a grain costs the same.
    """
    record = pd.read_csv(RECORD / "throughput-gpu.csv")
    lifting = record[record["phase"] == "lifting"].sort_values("worlds")
    known = (lifting["worlds"] * lifting["free grains"]).to_numpy()
    steps = 1e-6 * lifting["us a step"].to_numpy()
    return float(np.interp(grains, known, steps)) * max(1.0, grains / float(known[-1]))


def launch_seconds(worlds: int, given: Assumptions) -> float:
    """Wall time of a launch on one GPU [s]."""
    return given.start + given.steps * step_seconds(worlds * given.grains)


def planned(cases: int, gpus: int, given: Assumptions) -> dict[str, object]:
    """Row of so many cases on so many GPUs."""
    rounds = math.ceil(cases / (gpus * given.worlds))
    worlds = math.ceil(cases / (gpus * rounds))
    seconds = rounds * launch_seconds(worlds, given) / given.keeps
    return {
        "cases": f"{cases:,}",
        "GPUs": gpus,
        "worlds a launch": worlds,
        "launches a GPU": rounds,
        "hours": f"{seconds / 3600.0:.2f}",
        "GPU hours": f"{gpus * seconds / 3600.0:,.1f}",
        "heaps a second": f"{cases / seconds:.1f}",
        "cores that measure": math.ceil(cases * given.measuring / seconds),
        "disk, GB": f"{cases * given.stored / 1e9:,.1f}",
    }


def table(given: Assumptions, cases: Sequence[int] = CASES, gpus: Sequence[int] = GPUS) -> pd.DataFrame:
    """Table of all cases on all GPUs."""
    return pd.DataFrame([planned(number, count, given) for number in cases for count in gpus])


def check(given: Assumptions) -> pd.DataFrame:
    """Table of the waves that one H200 has run, against the same rule."""
    rows = []
    for wave in json.loads(CAMPAIGN.read_text(encoding="utf-8"))["wall_times"]:
        told = launch_seconds(wave["simulated"], given)
        rows.append((wave["stage"], wave["simulated"], round(told), round(wave["seconds"])))
    found = pd.DataFrame(rows, columns=["wave", "heaps", "told, s", "taken, s"])
    found["told / taken"] = (found["told, s"] / found["taken, s"]).map("{:.2f}".format)
    return found


def page(given: Assumptions, cases: Sequence[int] = CASES, gpus: Sequence[int] = GPUS) -> str:
    """Page of the plan: the table, all that it rests on, and the waves that check its rule."""
    heaps = f"{given.grains:,} grains of nine spheres, {given.steps / 1e6:.2g} million steps"
    # the waves that were run had heaps of their own, on one GPU
    waves = check(Assumptions(start=given.start))
    sums = f"Told {waves['told, s'].sum()} s in all, taken {waves['taken, s'].sum()} s."
    busy = given.measuring * given.worlds * given.keeps / launch_seconds(given.worlds, given)
    return markdown_page(
        "# 10,000 and 1,000,000 cases",
        f"Time, cores and disk for heaps of the paper's study ({heaps}), computed from the speed of "
        "one H200; nothing of this size was run. `python -m experiments.evidence.robustness.cluster.plan` makes this "
        "page, and each assumption below is an option of it.",
        markdown_table(table(given, cases, gpus)),
        "## What it rests on",
        markdown_table(rests_on(given)),
        NOT_MEASURED,
        "The plan leaves out that the stages of a calibration wait for each other, the queues of a cluster, "
        "launches that hold long and short heaps together, and a second worker on each GPU, which halves the "
        "launches.",
        "## The same rule on waves that were run",
        f"One H200, the paper's study (`experiments/evidence/studies/buckwheat/record`). {sums}",
        markdown_table(waves),
        "## What follows",
        "- **Fewer than about 20 worlds a GPU** cost more GPU hours than they save time: a step of 31 worlds "
        "takes eight times as long as a step of one.\n"
        f"- **Measuring** keeps {busy:.1f} cores busy for each GPU, on the machine of the command. With "
        "fewer, heaps wait to be measured and nothing is lost. Views (`[measurement] azimuths`) are what it "
        "costs.\n"
        "- **Disk** fills in the folder of a calibration: put it where there is room for all cases.",
    )


def rests_on(given: Assumptions) -> pd.DataFrame:
    """Table of what a plan rests on."""
    share = f"{100.0 * given.keeps:g} %"
    rows = [
        ("step of a launch", "8.6 us with one world to 268 us with 128", "measured: `throughput-gpu.csv`"),
        ("worlds of a full launch", given.worlds, "`cost-gpu.csv`: with more grains little is won"),
        ("start of a launch", f"{given.start:g} s", "chosen after the waves below"),
        ("measuring a heap, in eight views", f"{given.measuring:g} s of a core", "measured"),
        ("a stored heap", f"{given.stored / 1e6:g} MB", "measured; `discover` keeps 0.5 kB of each"),
        ("speed that a GPU keeps beside others", share, "**assumed**, `--keeps`"),
    ]
    return pd.DataFrame([tuple(map(str, row)) for row in rows], columns=["what", "value", "source"])


def main(
    keeps: Annotated[
        float, typer.Option(min=0.01, max=1.0, help="Part of its speed that a GPU keeps beside others.")
    ] = Assumptions.keeps,
    steps: Annotated[float, typer.Option(min=1.0, help="Steps of a heap.")] = Assumptions.steps,
    grains: Annotated[int, typer.Option(min=1, help="Grains of a heap.")] = Assumptions.grains,
    start: Annotated[float, typer.Option(min=0.0, help="Start of a launch [s].")] = Assumptions.start,
    measuring: Annotated[
        float, typer.Option(min=0.0, help="Time of a core that measuring a heap takes [s].")
    ] = Assumptions.measuring,
    stored: Annotated[float, typer.Option(min=0.0, help="Bytes of a stored heap.")] = Assumptions.stored,
    case: Annotated[list[int] | None, typer.Option(min=1, help="Cases; may be given again.")] = None,
    gpu: Annotated[list[int] | None, typer.Option(min=1, help="GPUs; may be given again.")] = None,
) -> None:
    """Write the page of a plan."""
    given = Assumptions(keeps, steps, grains, start=start, measuring=measuring, stored=stored)
    typer.echo(page(given, case or CASES, gpu or GPUS))


if __name__ == "__main__":
    typer.run(main)
