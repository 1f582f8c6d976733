"""Hidden frictions looked for on angles, and on outlines of the same heaps: how much smaller is the region?

    python -m experiments.evidence.accuracy.outlines.outlines_record --out out/outlines

A composite design is simulated once, and heaps at several hidden settings. Of each hidden setting angles and
outlines are compared with the same surfaces of the second degree, at the same level. What the folder holds
is not simulated again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer

from doe import (
    Design,
    Factor,
    Goal,
    JointFit,
    ProfileSample,
    Sample,
    Surface,
    central_composite,
    fit_surface,
    joint_fit,
    scatter_of_views,
)
from experiments.cases import OwnWorkers, Store, run_cases
from experiments.commands.console import clear_errors
from experiments.commands.options import OneDevice
from experiments.evidence.performance.result_pages import write_results
from experiments.io.files import require_folder
from experiments.studyfile import Study, load_study
from experiments.studyfile.observables import ANGLE, OUTLINE

STUDY = Path(__file__).with_name("study.toml")
HEIGHTS = [each.column for each in OUTLINE]

CENTER_POINTS, REPLICATES, HEAPS = 6, 3, 10
"""Runs at the design's centre, cases of each run, and heaps of each hidden setting."""

AIM = 0.25
"""Region compatible with a profile over that of the angle that was hoped for."""

TRIED = (
    "Tried for it: more profiles (20 in place of 8), a covariance shrunk to the scatter of the views, the "
    "directions that factors move most in place of all, and drums that an emulator draws in place of "
    "simulated heaps."
)

HIDDEN = ((0.0, 0.0, 0.0), (0.6, 0.0, -0.5), (-0.5, 0.5, 0.5), (0.0, -0.6, 0.3), (0.5, 0.5, 0.0))
"""Coded hidden settings."""

DESIGN_SEED, TWIN_SEED = 10_000, 50_000


def plan(study: Study, design: Design) -> pd.DataFrame:
    """Lay out all heaps, a row each: those of the design, then those of the hidden settings."""
    rows: list[dict[str, object]] = []
    for run, point in design.natural.iterrows():
        for replicate in range(REPLICATES):
            seed = DESIGN_SEED + len(rows)
            rows.append({"stage": "design", "run": run, "replicate": replicate, "seed": seed, **point})
    for number, coded in enumerate(HIDDEN, 1):
        point = {f.name: float(f.to_natural(x)) for f, x in zip(design.factors, coded, strict=True)}
        for replicate in range(HEAPS):
            seed = TWIN_SEED + 100 * number + replicate
            rows.append({"stage": "hidden", "run": number, "replicate": replicate, "seed": seed, **point})
    return pd.DataFrame(rows)


class Surfaces:
    """Angles and outlines of the design's heaps, and surfaces of the second degree over them.

    The columns ``angle`` and ``columns`` hold both.
    """

    def __init__(
        self, design: Design, cases: pd.DataFrame, angle: str = ANGLE, columns: Sequence[str] = HEIGHTS
    ) -> None:
        runs = cases[(cases["stage"] == "design") & (cases["status"] == "finished") & cases[angle].notna()]
        self.runs, self.names, self.angle, self.columns = runs, design.names, angle, list(columns)
        self.design = design.select(runs["run"].tolist())
        self.heights = runs[self.columns].to_numpy()
        self.slopes = np.array([self.change_of(column) for column in self.heights.T])

    def fit(self, values: np.ndarray) -> Surface:
        """Fit one number of every heap."""
        return fit_surface(self.design, values)

    def change_of(self, values: np.ndarray) -> np.ndarray:
        """Change of a number with every factor, from the middle of its range to an end."""
        return self.fit(values).coded_coefficients[self.names].to_numpy()


def strengths(found: Surfaces) -> pd.DataFrame:
    """Distance by which a factor moves the angle and the outline's directions, over a heap's scatter."""
    groups = [rows for _, rows in found.runs.groupby("run")]
    scatter = np.sqrt(np.mean([rows[found.angle].var() for rows in groups]))
    rows = [
        dict(zip(found.names, found.change_of(found.runs[found.angle].to_numpy()) / scatter, strict=True))
    ]
    covariance = scatter_of_views([group[found.columns].to_numpy() for group in groups])
    if covariance is not None:
        whole = ProfileSample(found.heights.mean(axis=0), covariance, len(found.heights), 0.0)
        for mode in whole.canonical(found.slopes, len(found.names)):
            moved = mode.weights @ found.slopes / mode.target.sd
            rows.append(dict(zip(found.names, moved, strict=True)))
    names = ["angle", *(f"outline, direction {number}" for number in range(1, len(rows)))]
    return pd.DataFrame(rows, index=pd.Index(names, name="measured")).reset_index()


def regions(found: Surfaces, cases: pd.DataFrame, factors: tuple[Factor, ...]) -> pd.DataFrame:
    """Compatible regions of every hidden setting, by angle and by outline; a row each."""
    rows = []
    for number, twin in cases[cases["stage"] == "hidden"].groupby("run"):
        measured = twin[(twin["status"] == "finished") & twin[found.angle].notna()]
        truth = measured[found.names].iloc[0].to_dict()
        seen = Sample.of(measured[found.angle].to_numpy())
        angle = Goal(found.fit(found.runs[found.angle].to_numpy()), seen)
        sample = ProfileSample.of(measured[found.columns].to_numpy())
        outline = {
            f"direction {place}": Goal(found.fit(found.heights @ mode.weights), mode.target)
            for place, mode in enumerate(sample.canonical(found.slopes, len(found.names)), 1)
        }
        for name, fitted in (("angle", joint_fit({"angle": angle})), ("outline", joint_fit(outline))):
            rows.append({"hidden": number, "by": name, **_row(fitted, truth, factors)})
    table = pd.DataFrame(rows)
    alone = table[table["by"] == "angle"].set_index("hidden")["share"]
    return table.assign(ratio=table["share"] / table["hidden"].map(alone))


def _row(found: JointFit, truth: Mapping[str, float], factors: tuple[Factor, ...]) -> dict[str, float | bool]:
    """Share of the region, whether it holds the truth, and the part of its range that each factor keeps."""
    ranges = found.region().ranges
    widths = {
        f"range of {f.name}": (ranges["high"][f.name] - ranges["low"][f.name])
        / (2.0 * found.extent * f.half_range)
        for f in factors
    }
    return {"share": found.share(), "holds the truth": found.agrees(truth), **widths}


def aim_told(ratio: float) -> str:
    """Say if a mean ratio is as small as was hoped for."""
    return f"The aim was a quarter ({AIM}); it is {'reached' if ratio <= AIM else 'not reached'}."


def write(folder: Path, study: Study, design: Design, cases: pd.DataFrame) -> Path:
    """Write the page and its tables."""
    found = Surfaces(design, cases)
    table = regions(found, cases, study.factors)
    ratios = table[table["by"] == "outline"]["ratio"]
    spans = table.groupby("by")[[name for name in table if name.startswith("range of ")]].mean()
    told = "; ".join(
        f"{name.removeprefix('range of ')} {spans.loc['angle', name]:.0%} by angle, "
        f"{spans.loc['outline', name]:.0%} by outline"
        for name in spans
    )
    lost = int(((cases["status"] != "finished") | cases[ANGLE].isna()).sum())
    said = (
        "# Outlines and angles of the same heaps\n\n"
        "    python -m experiments.evidence.accuracy.outlines.outlines_record --out OUT\n\n"
        f"{study.note} {HEAPS} heaps of each of {len(ratios)} hidden settings, {REPLICATES} of each run of a "
        f"composite design; {lost} of {len(cases)} heaps were lost. The region compatible with the outline "
        f"is {ratios.min():.2f} to {ratios.max():.2f} of the angle's, {ratios.mean():.2f} on average.\n\n"
        f"{aim_told(ratios.mean())} {TRIED}\n\n"
        f"Part of the explored range that each factor keeps, in the mean: {told}.\n\nShare: of the region "
        "that the design explored. Ratio: over the share of the angle. Range: part of the explored range of "
        "a factor that is compatible."
    )
    moved = (
        "What moves: the change from the middle of a factor's range to an end, over the scatter of one heap. "
        "The directions of the outline scatter independently; each pins what moves it."
    )
    return write_results(folder, "README", [("regions", said, table), ("strengths", moved, strengths(found))])


def main(
    out: Annotated[Path, typer.Option(help="Folder of the heaps and of the page.")],
    study: Annotated[Path, typer.Option(help="Study of the heaps.")] = STUDY,
    device: OneDevice = "cpu",
    workers: Annotated[int | None, typer.Option(min=1, help="Processes; left out: one a core.")] = None,
) -> None:
    """Compare outlines and angles on twin data."""
    with clear_errors("What is stored is not simulated again."):
        require_folder(out)
        heaps = load_study(study)
        design = central_composite(heaps.factors, "face", CENTER_POINTS)
        cases = run_cases(heaps, plan(heaps, design), Store(out / "cases"), OwnWorkers(device, workers))
        print(write(out, heaps, design, cases))


if __name__ == "__main__":
    typer.run(main)
