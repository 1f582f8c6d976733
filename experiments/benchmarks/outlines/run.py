"""Hidden frictions looked for on angles, and on outlines of the same heaps: how much smaller is the region?

    python -m experiments.benchmarks.outlines.run --out out/outlines

A composite design is simulated once, and heaps at several hidden settings. Of each hidden setting angles and
outlines are compared with the same surfaces of the second degree, at the same level. What the folder holds
is not simulated again.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from doe import Design, Goal, JointFit, ProfileSample, Sample, central_composite, fit_surface, joint_fit
from doe.factors import Factor
from experiments.benchmarks.results import write_results
from experiments.cases import OwnWorkers, Store, run_cases
from experiments.measurement.observables import ANGLE, OUTLINE
from experiments.studyfile import Study, load_study

STUDY = Path(__file__).with_name("study.toml")
HEIGHTS = [each.column for each in OUTLINE]

CENTER_POINTS, REPLICATES, HEAPS = 6, 3, 10
"""Runs at the design's centre, cases of each run, and heaps of each hidden setting."""

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


def regions(design: Design, cases: pd.DataFrame) -> pd.DataFrame:
    """Compatible regions of every hidden setting, by angle and by outline; a row each."""
    runs = cases[(cases["stage"] == "design") & (cases["status"] == "finished") & cases[ANGLE].notna()]
    used = design.select(runs["run"].tolist())
    heights = runs[HEIGHTS].to_numpy()
    slopes = [fit_surface(used, column).coded_coefficients[design.names].to_numpy() for column in heights.T]
    rows = []
    for number, twin in cases[cases["stage"] == "hidden"].groupby("run"):
        measured = twin[(twin["status"] == "finished") & twin[ANGLE].notna()]
        truth = measured[design.names].iloc[0].to_dict()
        angle = Goal(fit_surface(used, runs[ANGLE].to_numpy()), Sample.of(measured[ANGLE].to_numpy()))
        sample = ProfileSample.of(measured[HEIGHTS].to_numpy())
        outline = {
            f"direction {place}": Goal(fit_surface(used, heights @ mode.weights), mode.target)
            for place, mode in enumerate(sample.canonical(np.array(slopes), len(design.names)), 1)
        }
        for name, found in (("angle", joint_fit({"angle": angle})), ("outline", joint_fit(outline))):
            rows.append({"hidden": number, "by": name, **_row(found, truth, design.factors)})
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


def head(table: pd.DataFrame, command: str) -> str:
    """Sentences above the table."""
    outline = table[table["by"] == "outline"]
    ratios = outline["ratio"]
    spans = table.groupby("by")[[name for name in table if name.startswith("range of ")]].mean()
    told = "; ".join(
        f"{name.removeprefix('range of ')} {spans.loc['angle', name]:.0%} by angle, "
        f"{spans.loc['outline', name]:.0%} by outline"
        for name in spans
    )
    return (
        f"# Outlines and angles of the same heaps\n\n    {command}\n\n"
        f"{HEAPS} heaps of each of {len(outline)} hidden settings, {REPLICATES} of each run of a composite "
        f"design. The region compatible with the outline is {ratios.min():.2f} to {ratios.max():.2f} of that "
        f"of the angle, {ratios.mean():.2f} in the mean. Part of the explored range that each factor keeps, "
        f"in the mean: {told}.\n\nShare: of the region that the design explored. Ratio: over the share of "
        "the angle. Range: part of the explored range of a factor that is compatible."
    )


def main() -> None:
    """Run the benchmark as a command."""
    parser = argparse.ArgumentParser(description="Compare outlines and angles on twin data.")
    parser.add_argument("--study", type=Path, default=STUDY)
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--workers", type=int, help="processes; left out: one a core")
    parser.add_argument("--out", type=Path, required=True)
    chosen = parser.parse_args()
    study = load_study(chosen.study)
    design = central_composite(study.factors, "face", CENTER_POINTS)
    workers = OwnWorkers(chosen.device, chosen.workers)
    cases = run_cases(study, plan(study, design), Store(chosen.out / "cases"), workers)
    table = regions(design, cases)
    lost = cases[(cases["status"] != "finished") | cases[ANGLE].isna()]
    command = "python -m experiments.benchmarks.outlines.run --out OUT"
    said = head(table, command) + (f" {len(lost)} of {len(cases)} heaps were lost." if len(lost) else "")
    print(write_results(chosen.out, "README", [("regions", said, table)]))


if __name__ == "__main__":
    main()
