"""Beads of ABS: packing, two piles and a drum predicted from readings of single beads, without a fit.

    python -m experiments.evidence.studies.abs_beads run --out out/abs-beads
    python -m experiments.evidence.studies.abs_beads predict --out out/abs-beads

The first needs a GPU, and neither pandas nor OpenCV; ``--scale bench --device cpu`` has small tests for two
cores. What a folder holds is not simulated again. The second measures the states, and writes the bands.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from scipy.stats import norm, qmc

from experiments.commands.console import clear_errors
from experiments.commands.options import OneDevice
from experiments.evidence.studies.batch import FACTS, measured_cases, simulate_missing
from experiments.evidence.studies.drum_commands import Out, require_run
from experiments.io.files import require_folder, write_text
from experiments.studyfile import Study, load_study

if TYPE_CHECKING:
    import pandas as pd

PREDICTION = "prediction.csv"

READINGS = {
    "mu_gg": (0.35, 0.06, 10),
    "mu_gw": (0.49, 0.08, 10),
    "mu_r_gg": (0.03, 0.01, 1),  # not measured: the reading on steel, with the scatter of one
    "mu_r_gw": (0.03, 0.01, 10),
    "e_gg": (0.87, 0.01, 10),
    "e_gw": (0.72, 0.02, 10),
}
"""Mean, standard deviation and number of readings of each factor; README.md has their source."""

QUANTITIES = {
    "packing": ("packing", "bulk_density", "kg/m3"),
    "pile on 90 mm, of a lifted tube": ("small_tube", "angle", "deg"),
    "pile on 150 mm, of a lifted tube": ("tube", "angle", "deg"),
    "pile on 90 mm, below a funnel": ("small_base", "angle", "deg"),
    "pile on 150 mm, below a funnel": ("target", "angle", "deg"),
    "drum at 3 1/min": ("drum", "dynamic_angle", "deg"),
}
"""Scene, observable and unit of what is predicted."""

MODEL_ERRORS = (0.0, 0.05)
"""Standard deviations of a parameter of the model from that of the real surface, as a part of its value."""

SETS, LEVEL, DRAWS = 40, 0.9, 20_000


def errors(model: float) -> np.ndarray:
    """Return the standard error of each factor, with an error of the model, (factors,)."""
    return np.array([np.hypot(sd / np.sqrt(n), model * mean) for mean, sd, n in READINGS.values()])


def parameter_sets() -> np.ndarray:
    """Draw parameters from the readings with the largest error of the model: a Latin hypercube of normals."""
    cube = qmc.LatinHypercube(len(READINGS), optimization="random-cd", rng=7).random(SETS)
    means = np.array([mean for mean, *_ in READINGS.values()])
    return means + errors(MODEL_ERRORS[-1]) * norm.ppf(cube)


def planned_cases() -> list[dict[str, Any]]:
    """Lay out the cases: all tests of all parameter sets."""
    planned = [(scene, row) for scene, *_ in QUANTITIES.values() for row in parameter_sets().tolist()]
    return [
        {"scene": scene, "seed": 9000 + number, **dict(zip(READINGS, row, strict=True))}
        for number, (scene, row) in enumerate(planned)
    ]


def study_at(scale: str) -> Study:
    """Load the study at a scale."""
    return load_study(Path(__file__).with_name("study.toml"), scale)


def bands(cases: pd.DataFrame) -> pd.DataFrame:
    """Predict one heap, one bed and one drum of each quantity: a row a quantity and error of the model.

    The quantity is linear in the parameters; what is left of the simulated ones, the seed's noise and what
    bends, is that of the measured one too.
    """
    import pandas as pd

    means, rng, rows = np.array([mean for mean, *_ in READINGS.values()]), np.random.default_rng(8), []
    for name, (scene, observable, unit) in QUANTITIES.items():
        found = cases[(cases["scene"] == scene) & cases[observable].notna()]
        terms = np.column_stack([np.ones(len(found)), found[list(READINGS)] - means])
        fit, [rest], *_ = np.linalg.lstsq(terms, found[observable].to_numpy(float))
        variance = rest / (len(found) - terms.shape[1])
        spread = variance * np.linalg.inv(terms.T @ terms)
        for model in MODEL_ERRORS:
            x = np.column_stack([np.ones(DRAWS), errors(model) * rng.normal(size=(DRAWS, len(means)))])
            drawn = np.einsum("ij,ij->i", x, rng.multivariate_normal(fit, spread, DRAWS))
            drawn += rng.normal(0.0, np.sqrt(variance), DRAWS)
            ends = np.quantile(drawn, [(1.0 - LEVEL) / 2.0, 0.5, (1.0 + LEVEL) / 2.0]).round(2)
            rows.append((name, unit, model, *ends, len(found)))
    columns = ["quantity", "unit", "model_error", "low", "middle", "high", "runs"]
    return pd.DataFrame(rows, columns=columns)


app = typer.Typer(help=__doc__, no_args_is_help=True)


@app.command()
def run(
    scale: Annotated[str, typer.Option(help="full or bench.")] = "full",
    device: OneDevice = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes on a CPU.")] = None,
    out: Out = Path("out/abs-beads"),
) -> None:
    """Simulate all tests of all parameter sets at once."""
    with clear_errors("What is stored is not simulated again."):
        require_folder(out)
        simulate_missing(study_at(scale), planned_cases(), out, device, workers)


@app.command()
def predict(out: Out = Path("out/abs-beads")) -> None:
    """Measure the states of a run, and write the bands."""
    with clear_errors():
        require_run(out, FACTS)
        study = study_at(json.loads((out / FACTS).read_text(encoding="utf-8"))["scale"])
        kept = ("status", "reason", *dict.fromkeys(observable for _, observable, _ in QUANTITIES.values()))
        table = bands(measured_cases(study, planned_cases(), out, kept))
        write_text(out / PREDICTION, table.to_csv(index=False))
        print(table.to_string(index=False))


if __name__ == "__main__":
    app()
