"""The paper's 34 runs simulated again: wall times, angles beside the published ones, pictures of three heaps.

The twelve Plackett-Burman runs, the six of the climb, the thirteen of the central composite design and the
three of the verification, each stage as one batch, one seed a run.

    python -m experiments.benchmarks.paper_runs --scale paper --device cuda --out out/paper-runs

Results are in README.md beside this file.
"""

import time
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer
from scipy.stats import spearmanr

from doe import Design
from experiments.cases import Store, heap_picture, measure_heap, run_cases
from experiments.studies.buckwheat import paper
from experiments.study import Study, load_study
from imaging import save_picture

ANGLE = "repose_angle_deg"
OPTIMUM = {"E": 0.482, "F": 0.446}
PICTURES = {"screening 3": 2, "screening 12": 11, "optimum": 31}
FIRST_SEED = 40_000


def published_runs() -> pd.DataFrame:
    """Every simulated run of the paper: stage, run, settings that it changes, published angle [deg]."""
    screening = paper.published("plackett_burman")
    composite = paper.published("central_composite")
    coded = composite[["E_coded", "F_coded"]].set_axis(["E", "F"], axis=1)
    climb = paper.published("steepest_climb")
    angles = paper.verification()
    stages = {
        "screening": (
            Design.from_table(screening.drop(columns=ANGLE), paper.factors()).natural,
            screening[ANGLE],
        ),
        "climb": (climb[["E", "F"]], climb[ANGLE]),
        "composite": (Design.from_table(coded, paper.composite_factors()).natural, composite[ANGLE]),
        "verification": (pd.DataFrame([OPTIMUM] * len(angles)), angles),
    }
    tables = [
        settings.reset_index(drop=True).assign(
            stage=stage, run=range(1, len(settings) + 1), published=np.asarray(published)
        )
        for stage, (settings, published) in stages.items()
    ]
    runs = pd.concat(tables, ignore_index=True)
    return runs.assign(seed=range(FIRST_SEED, FIRST_SEED + len(runs)))


def simulate_stages(study: Study, runs: pd.DataFrame, store: Store, device: str | None) -> pd.DataFrame:
    """Simulate stage by stage, each as one batch; the column `wall` is the stage's wall time [s]."""
    done = []
    for stage, table in runs.groupby("stage", sort=False):
        varied = table.dropna(axis=1, how="all")
        started = time.perf_counter()
        cases = run_cases(study, varied, store, device)
        done.append(cases.assign(wall=time.perf_counter() - started))
        print(f"{stage}: {len(table)} runs in {done[-1]['wall'].iloc[0]:.1f} s", flush=True)
    return pd.concat(done, ignore_index=True)


def agreement(cases: pd.DataFrame) -> pd.DataFrame:
    """How near the angles come to the published ones, by stage and over all stages but the verification."""
    designs = cases[cases["stage"] != "verification"]
    groups = [*cases.groupby("stage", sort=False), ("tables 3, 5 and 6", designs)]
    return pd.DataFrame(
        {
            name: {
                "runs": len(group),
                "rmse": float(np.sqrt(np.mean((group["angle"] - group["published"]) ** 2))),
                "bias": float((group["angle"] - group["published"]).mean()),
                "spearman": float(spearmanr(group["angle"], group["published"]).statistic),
                "wall": float(group["wall"].iloc[0]) if name in set(cases["stage"]) else np.nan,
            }
            for name, group in groups
        }
    ).T


def main(
    scale: Annotated[str, typer.Option(help="Scale of the buckwheat study.")] = "paper",
    device: Annotated[str | None, typer.Option(help="cpu or cuda.")] = None,
    out: Annotated[Path, typer.Option(help="Folder of the results.")] = Path("out/paper-runs"),
) -> None:
    """Simulate the paper's runs and print how they compare."""
    study = load_study(scale=scale)
    store = Store(out / "cases")
    started = time.perf_counter()
    cases = simulate_stages(study, published_runs(), store, device)
    print(f"all {len(cases)} runs in {time.perf_counter() - started:.1f} s")
    columns = ["stage", "run", "published", "angle", "angle_se", "grain_count", "solid_fraction", "status"]
    cases.to_csv(out / "cases.csv", index=False, float_format="%.4f")
    print(cases[columns].round(3).to_string(index=False))
    print(agreement(cases).round(2).to_string())
    for name, row in PICTURES.items():
        heap = store.load(cases["case_key"][row])
        picture = heap_picture(study, heap, measure_heap(study, heap))
        save_picture(out / f"{name.replace(' ', '-')}.png", picture)


if __name__ == "__main__":
    typer.run(main)
