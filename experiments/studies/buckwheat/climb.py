"""The climb as a script: where does the path through the significant factors meet the target?

START and STEP are the paper's; take yours from the screening. Copy it for your own grain.

    python -m experiments.studies.buckwheat.climb --scale bench --target 27
"""

from pathlib import Path

import numpy as np
import pandas as pd
import typer

from doe import Design, climb_table
from experiments.cases import OwnWorkers, Store, run_cases
from experiments.commands.options import OneDevice
from experiments.studyfile import load_study

START = {"E": 0.30, "F": 0.15}
STEP = {"E": 0.06, "F": 0.10}
POINTS = 6
REPLICATES = 2
FIRST_SEED = 2000


def main(
    scale: str = "bench", target: float = 30.148, out: Path = Path("out/scripts"), device: OneDevice = None
) -> None:
    """Climb and print the angle, and its error against the target, at every point."""
    study = load_study(scale=scale)
    points = pd.DataFrame({name: START[name] + STEP[name] * np.arange(POINTS) for name in START})
    points.index = pd.RangeIndex(1, POINTS + 1, name="point")
    path = Design.from_table(points, [f for f in study.factors if f.name in START], coded=False)

    cases = points.loc[points.index.repeat(REPLICATES)].reset_index(drop=True)
    cases = cases.assign(seed=range(FIRST_SEED, FIRST_SEED + len(cases)))
    cases = run_cases(study, cases, Store(out / "cases"), OwnWorkers(device))
    cases.to_csv(out / f"climb-{scale}.csv", index=False)

    table = climb_table(path, cases["angle"].to_numpy().reshape(POINTS, REPLICATES), target)
    print(table.round(3).to_string())
    print(f"nearest to the target: point {table['error'].abs().idxmin()}")


if __name__ == "__main__":
    typer.run(main)
