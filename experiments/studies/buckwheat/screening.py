"""Screening as a script: which parameters move the repose angle? Copy it for your own grain.

All runs of the Plackett-Burman design are simulated as one batch and stored: a second start costs nothing.

    python -m experiments.studies.buckwheat.screening --scale bench
"""

from pathlib import Path

import typer

from doe import plackett_burman, screen
from experiments.cases import OwnWorkers, Store, run_cases
from experiments.commands.options import OneDevice
from experiments.studyfile import load_study

RUNS = 12  # eight factors and three dummy columns, which are the error
ALPHA = 0.10  # a factor is kept below this p value
FIRST_SEED = 1000


def main(scale: str = "bench", out: Path = Path("out/scripts"), device: OneDevice = None) -> None:
    """Screen the study's factors and print their effects."""
    study = load_study(scale=scale)
    design = plackett_burman(study.factors, runs=RUNS)

    cases = design.natural.assign(seed=range(FIRST_SEED, FIRST_SEED + RUNS))
    cases = run_cases(study, cases, Store(out / "cases"), OwnWorkers(device))
    cases.to_csv(out / f"screening-{scale}.csv")

    effects = screen(design, cases["angle"])
    print(effects.table.round(4).to_string())
    print(f"critical |t|: {effects.critical_t(ALPHA):.3f} on {effects.error_df:.0f} degrees of freedom")
    print(f"kept: {', '.join(effects.significant(ALPHA)) or 'none'}")


if __name__ == "__main__":
    typer.run(main)
