"""The README's campaign over many seeds."""

from pathlib import Path
from typing import Annotated, Any

import pandas as pd
import typer

from experiments.calibrate import calibrate
from experiments.cases import OwnWorkers, Store, run_cases
from experiments.evidence.record_page import markdown_table, write_page
from experiments.studyfile import load_study

SCALE = "bench"
FOLDER = Path(__file__).parents[1] / "point"
PAGE, TABLE = "pinned.md", "pinned.csv"
MADE = "28 November 2026: 1 to 12 on an AMD EPYC, 13 to 20 on an Intel Xeon, which repeats 1, 6, 8 and 9"
SHARE = 5.0
"""Largest region that is asked for, of what was explored [%]."""
ASKED = {"E": 15.0, "F": 15.0, "G": 30.0}
"""Half of each factor's interval over its value, at most [%]."""


def one_campaign(seed: int, folder: Path, device: str) -> dict[str, Any]:
    """Run the campaign with other seeds, those of the target and of its readings too; return a row."""
    seeds = {"campaign": {"seeds": {"campaign": 2 * seed - 1, "target": 2 * seed}}}
    study, store = load_study(None, SCALE, seeds), Store(folder / "cases")
    workers = OwnWorkers(device=device)
    campaign = calibrate(study, lambda table: run_cases(study, table, store, workers))
    row: dict[str, Any] = {"seed": seed, "outcome": campaign.outcome.value}
    if (optimum := campaign.optimum) is None or optimum.truth is None:
        return row
    row |= {"share": 100.0 * optimum.region.fraction, "truth inside": optimum.truth.compatible}
    for name, ends in optimum.ranges.iterrows():
        truth = optimum.truth.values[str(name)]  # noqa: PD011  (no DataFrame)
        row[f"{name} ±"] = 50.0 * (ends["high"] - ends["low"]) / truth
        row[f"{name} held"] = ends["low"] <= truth <= ends["high"]
        row[f"{name} open"] = ends["low_open"] or ends["high_open"]
    return row


def write_pinned_page() -> Path:
    """Write the page of the kept table."""
    table = pd.read_csv(FOLDER / TABLE)
    within = {name: int((table[f"{name} ±"] <= most).sum()) for name, most in ASKED.items()}
    facts = ", ".join(f"{name} known to {ASKED[name]:g} % in {count}" for name, count in within.items())
    small = int((table["share"] <= SHARE).sum())
    held = ", ".join(f"{name} in {int(table[f'{name} held'].sum())}" for name in ASKED)
    return write_page(
        FOLDER / PAGE,
        "# The README's campaign, seed by seed",
        f"With {len(table)} seeds, each with other heaps and other readings, the compatible region held the "
        f"hidden settings in {int(table['truth inside'].sum())}; {facts}; the interval held the hidden value "
        f"of {held}. Share: of what was explored, at most {SHARE:g} % in {small} "
        f"and at most {table['share'].max():.1f} % in all. ±: half of the 95 % "
        "interval over the hidden value. The command "
        "`python -m experiments.evidence.studies.buckwheat.records.pinned_record` repeats it "
        f"({MADE}).",
        markdown_table(table.round(1)),
    )


def main(
    seeds: Annotated[int, typer.Option(help="Seeds, from 1.")] = 20,
    device: Annotated[str, typer.Option(help="Device that simulates.")] = "cpu",
    out: Annotated[Path, typer.Option(help="Folder of the heaps.")] = Path("out/pinned"),
) -> None:
    """Run the campaigns and write the record."""
    rows = [one_campaign(seed, out / str(seed), device) for seed in range(1, seeds + 1)]
    pd.DataFrame(rows).to_csv(FOLDER / TABLE, index=False)
    print(write_pinned_page())


if __name__ == "__main__":
    typer.run(main)
