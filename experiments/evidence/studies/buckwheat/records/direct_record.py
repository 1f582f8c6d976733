"""Regions with readings of single grains, on the kept surfaces of ``curve_to_point.toml``."""

import json
from datetime import date
from pathlib import Path

import numpy as np
import pandas as pd
from scipy import stats

from doe import FactorSurface, Goal, JointFit, StatedValue, joint_fit
from experiments.calibrate import calibrate
from experiments.calibrate.results import OptimumResult, StageResult
from experiments.evidence.record_page import markdown_table, write_page
from experiments.evidence.studies.buckwheat.records.point_record import (
    CASES,
    FOLDER,
    PROVENANCE,
    STUDY,
    KeptCases,
)
from experiments.report.kit.table import Column, Layout, make_table
from experiments.studyfile import Study, load_study

SCALE, PAGE = "paper", "direct.md"
LEVEL = 0.95

KNOWN: dict[str, tuple[tuple[str, ...], dict[str, float]]] = {
    "angle": (("angle",), {}),
    "angle, density": (("angle", "density"), {}),
    "angle, F ± 0.02": (("angle",), {"F": 0.02}),
    "angle, density, F ± 0.02": (("angle", "density"), {"F": 0.02}),
    "angle, density, F ± 0.02, E ± 0.03": (("angle", "density"), {"F": 0.02, "E": 0.03}),
    "angle, density, F ± 0.01, E ± 0.015": (("angle", "density"), {"F": 0.01, "E": 0.015}),
}
"""Responses, and standard errors of direct readings."""


class _Reached(Exception):  # noqa: N818  (not an error)
    """The campaign has its joint fit; the cases after it are not needed."""


def kept_fit(study: Study, cases: Path) -> JointFit:
    """Repeat the joint fit of a campaign on its kept cases."""
    found: list[JointFit] = []

    def take(name: str, result: StageResult) -> None:
        if isinstance(result, OptimumResult) and result.joint is not None:
            found.append(result.joint)
            raise _Reached

    try:
        calibrate(study, KeptCases(pd.read_csv(cases), str(cases)), take)
    except _Reached:
        return found[0]
    raise ValueError(f"{cases}: the campaign has no joint fit")


def narrowed(joint: JointFit, hidden: dict[str, float]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return what is left, in percent, by what is known: of the compatible region, and of the likelihood.

    The first column is a share of the region explored, the others are half of each factor's range over its
    value. Of the likelihood it is the smallest share with 95 %, and 1.96 standard deviations.
    """
    design, regions, posteriors = next(iter(joint.goals.values())).surface.design, {}, {}
    for known, (responses, errors) in KNOWN.items():
        goals = {name: joint.goals[name] for name in responses}
        for factor, error in errors.items():
            goals[factor] = Goal(FactorSurface(design, factor), StatedValue(hidden[factor], error))
        fit = joint_fit(goals, joint.alpha)
        region = fit.region()
        half = region.ranges.diff(axis=1)["high"] / 2.0
        regions[known] = {"share": region.fraction} | {
            name: half[name] / hidden[name] for name in design.names
        }
        chi2 = np.sum([(found[0] / found[1]) ** 2 for found in fit.misfits.values()], axis=0)
        weight = np.where(fit.explored, np.exp(-0.5 * (chi2 - chi2[fit.explored].min())), 0.0)
        weight /= weight.sum()
        held = np.count_nonzero(np.cumsum(np.sort(weight)[::-1]) < LEVEL) + 1
        posteriors[known] = {"share": held / np.count_nonzero(fit.explored)}
        for name in design.names:
            values = region.natural[name].to_numpy()
            sd = np.sqrt(weight @ (values - weight @ values) ** 2)
            posteriors[known][name] = stats.norm.isf(0.5 - 0.5 * LEVEL) * sd / hidden[name]
    tables = (pd.DataFrame.from_dict(each, orient="index") for each in (regions, posteriors))
    first, second = (100.0 * table.rename_axis("known") for table in tables)
    return first, second


def write_direct_page(folder: Path = FOLDER) -> Path:
    """Write the page."""
    study = load_study(STUDY, SCALE)
    hidden = dict(study.target.twin.truth) if study.target.twin else {}
    tables = narrowed(kept_fit(study, folder / SCALE / CASES), hidden)
    shown: Layout = [Column("known", "known"), Column("share", "share of the region explored", "free", "%")]
    shown += [Column(name, name, "percent", "%") for name in tables[0].columns[1:]]
    captions = ("The compatible region: all responses agree together.", "95 % of the likelihood.")
    made_by = json.loads((folder / SCALE / PROVENANCE).read_text(encoding="utf-8"))
    return write_page(
        folder / PAGE,
        "# What readings of single grains buy",
        "The surfaces of [the further responses](README.md), from the cases kept next to it, with readings "
        "of the frictions at their hidden values; ±: their standard error, no error of the model. E, F, G: "
        "half of what is left over the hidden value. The command "
        "`python -m experiments.evidence.studies.buckwheat.records.direct_record` repeats it in a "
        f"minute of one core; the cases were made on {made_by['date']} ({made_by['commit']}), the page on "
        f"{date.today()}.",
        *(
            markdown_table(make_table("readings", table, shown, caption))
            for table, caption in zip(tables, captions, strict=True)
        ),
    )


if __name__ == "__main__":
    print(write_direct_page())
