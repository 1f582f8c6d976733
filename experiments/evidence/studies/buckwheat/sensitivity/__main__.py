"""The paper's 31 angles under every variant of the study, simulated where they are not there yet.

    python -m experiments.evidence.studies.buckwheat.sensitivity --modulus-scale 10 --out out/sensitivities

Each variant of ``variants.toml`` is one batch of 31 runs, times the replicates; its angles go to NAME.csv. A
variant whose file is there is not run again, and heaps are kept: variants of the estimator take those of the
base. With --variant, several times if you like, only those run.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import pandas as pd
import typer

from experiments.cases import OwnWorkers, Store, run_cases
from experiments.commands.options import OneDevice
from experiments.evidence.studies.buckwheat.sensitivity.sensitivities import Sensitivities
from experiments.evidence.studies.buckwheat.sensitivity.sensitivity_folder import open_settings
from experiments.evidence.studies.buckwheat.sensitivity.variants import BASE, Variant, chosen_variants
from experiments.io.files import write_text

COLUMNS = (
    "stage", "run", "replicate", "published", "seed", "status", "reason", "angle", "angle_se", "grain_count",
    "solid_fraction", "grains_lost", "simulated_time",
)  # fmt: skip
"""Columns that are kept of a case."""


def run_variant(
    variant: Variant, store: Store, settings: dict[str, Any], device: str | None = None
) -> pd.DataFrame:
    """Simulate the 31 runs of a variant as one batch, heaps kept in the store: a row a case, `COLUMNS`.

    The settings are scale, modulus_scale (None: the scale's) and replicates; without a device the engine
    chooses.
    """
    study = variant.load_study(settings["scale"], settings["modulus_scale"])
    cases = run_cases(study, variant.planned_cases(settings["replicates"]), store, OwnWorkers(device))
    return cases.reindex(columns=COLUMNS)


def main(
    variant: Annotated[list[str] | None, typer.Option(help="Name of a variant; left out: all.")] = None,
    scale: Annotated[str, typer.Option(help="Scale of the buckwheat study.")] = "paper",
    modulus_scale: Annotated[
        float | None, typer.Option(min=1.0, help="What the shear modulus is divided by.")
    ] = None,
    replicates: Annotated[int, typer.Option(min=1, help="Heaps of each run.")] = 1,
    device: OneDevice = None,
    out: Annotated[Path, typer.Option(help="Folder of the results.")] = Path("out/sensitivities"),
) -> None:
    """Simulate variants that are not there yet, and print how the angles shift."""
    settings = {"scale": scale, "modulus_scale": modulus_scale, "replicates": replicates}
    wanted = chosen_variants(variant or [])
    open_settings(out, settings)
    for chosen in wanted:
        path = out / f"{chosen.name}.csv"
        if path.is_file():
            continue
        started = time.perf_counter()
        cases = run_variant(chosen, Store(out / "cases"), settings, device)
        write_text(path, cases.to_csv(index=False))
        print(f"{chosen.name}: {len(cases)} cases in {time.perf_counter() - started:.1f} s", flush=True)
    found = Sensitivities.read(out)
    if found is None:
        print(f"nothing to compare yet: the variant {BASE} is missing, or gave too few angles")
        return
    for table in (
        found.shifts.drop(columns=["group", "title", "candidate"]).dropna(how="all"),
        found.effects,
        found.left_out,
    ):
        print(table.round(2).to_string(), end="\n\n")


if __name__ == "__main__":
    typer.run(main)
