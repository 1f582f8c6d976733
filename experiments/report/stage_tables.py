"""The tables of every stage, laid out for the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from doe import Design, Factor, Surface, compare_means
from experiments.calibrate.results import (
    Campaign,
    ClimbResult,
    OptimumResult,
    ScreeningResult,
    SelectionResult,
    SurfaceResult,
    VerificationResult,
)
from experiments.report.kit.numbers import fixed, term
from experiments.report.kit.table import Column, Table, make_table
from experiments.report.published import QUALITY, Published

SIGNIFICANT = 0.05
"""Rows of an analysis of variance with p below this are marked."""

QUALITY_NAMES = (
    "R²",
    "R² adjusted",
    "R² predicted",
    "coefficient of variation [%]",
    "adequate precision (above 4 is wanted)",
)

RUN = Column("run", "run", "label")
ANGLE = Column("angle", "angle", "angle", "°")
ERROR_PERCENT = Column("error_percent", "relative error", "ratio", "%")
PAPER_TEST = (Column("paper_F", "paper, F", "ratio"), Column("paper_p", "paper, p", "p"))


def factors_table(
    factors: Sequence[Factor], labels: Mapping[str, str], truth: Mapping[str, float] | None
) -> Table:
    """Lay out what the campaign may vary, and in a twin study the hidden values."""
    frame = pd.DataFrame(
        {
            "factor": [factor.name for factor in factors],
            "label": [labels.get(factor.name, "") for factor in factors],
            "unit": [factor.unit for factor in factors],
            "low": [factor.low for factor in factors],
            "center": [factor.center for factor in factors],
            "high": [factor.high for factor in factors],
        }
    )
    if truth is not None:
        frame["truth"] = frame["factor"].map(truth)
    columns = [
        Column("factor", "factor"),
        Column("label", "parameter"),
        Column("low", "low (−1)", "level"),
        Column("center", "middle (0)", "level"),
        Column("high", "high (+1)", "level"),
        Column("truth", "hidden truth", "level"),
        Column("unit", "unit"),
    ]
    return make_table("factors", frame, columns, "Factors and their levels.")


def heaps_table(name: str, cases: pd.DataFrame, caption: str) -> Table:
    """Lay out replicated heaps of one setting."""
    columns = [
        Column("replicate", "heap", "label"),
        Column("seed", "seed", "label"),
        Column("grain_count", "grains", "count"),
        Column("fill_height_mm", "fill height", "ratio", "mm"),
        Column("solid_fraction", "solid fraction", "share"),
        Column("time_to_rest", "time to rest", "ratio", "s"),
        ANGLE,
        Column("angle_se", "se over views", "angle", "°"),
        Column("status", "status"),
    ]
    if "fill_height" in cases.columns:
        cases = cases.assign(fill_height_mm=1e3 * cases["fill_height"])
    return make_table(name, cases, columns, caption, marks=_failed_marks(cases["angle"]))


def screening_design_table(result: ScreeningResult) -> Table:
    """Lay out the coded design with its response."""
    frame, angles = _with_response(result.design.coded, result.response)
    coded = [Column(name, name, "coded") for name in result.design.coded.columns]
    note = f"Dummy columns, which stand for no factor: {', '.join(result.design.dummies) or 'none'}."
    return make_table(
        "screening-design", frame, [RUN, *coded, *angles], "Screening design (coded) and angles.", note
    )


def effects_table(
    result: ScreeningResult, labels: Mapping[str, str], alpha: float, published: pd.DataFrame | None
) -> Table:
    """Lay out the tests of the effects, strongest first, the paper's F and p beside them."""
    frame = result.screen.table.sort_values("rank")
    frame.insert(0, "label", [labels.get(str(name), "") for name in frame.index])
    if published is not None:
        frame = frame.join(published[["F", "p"]].add_prefix("paper_"))
    columns = [
        Column("rank", "rank", "label"),
        Column("factor", "factor"),
        Column("label", "parameter"),
        Column("effect", "effect", "angle", "°"),
        Column("sum_sq", "sum of squares", "sum"),
        Column("percent", "share", "percent", "%"),
        Column("F", "F", "ratio"),
        Column("t", "t", "ratio"),
        Column("p", "p", "p"),
        *PAPER_TEST,
    ]
    note = f"Marked: p < {alpha:g}. The effect is the change of the mean angle from low to high."
    if published is not None:
        note += " The paper's columns are recomputed from its printed runs."
    return make_table("effects", frame, columns, "Effects of the factors.", note, _p_marks(frame["p"], alpha))


def anova_table(name: str, anova: pd.DataFrame, caption: str, published: pd.DataFrame | None = None) -> Table:
    """Lay out an analysis of variance, the paper's F and p beside it."""
    if published is not None:
        anova = anova.join(published[["F", "p"]].add_prefix("paper_")).rename_axis("source")
    columns = [
        Column("source", "source", write=term),
        Column("df", "df", "label"),
        Column("sum_sq", "sum of squares", "sum"),
        Column("mean_sq", "mean square", "sum"),
        Column("F", "F", "ratio"),
        Column("p", "p", "p"),
        *PAPER_TEST,
    ]
    return make_table(
        name, anova, columns, caption, f"Marked: p < {SIGNIFICANT}.", _p_marks(anova["p"], SIGNIFICANT)
    )


def selection_table(result: SelectionResult) -> Table:
    """Lay out why each factor was kept or not."""
    frame = result.table.rename_axis("factor").copy()
    frame["kept"] = np.where(frame["kept"], "kept", "left at its middle")
    frame["visible"] = np.where(frame["visible"], "yes", "no")
    columns = [
        Column("factor", "factor"),
        Column("effect", "effect", "angle", "°"),
        Column("p", "p", "p"),
        *(Column(key, f"p, {key[2:]}", "p") for key in frame.columns if key.startswith("p_")),
        Column("visible", "beyond the noise floor"),
        Column("kept", "decision"),
        Column("reason", "reason"),
    ]
    marks = ["strong" if kept else "" for kept in result.table["kept"]]
    return make_table("selection", frame, columns, "Which factors the later stages vary.", marks=marks)


def climb_table(result: ClimbResult) -> Table:
    """Lay out the steps of the climb, the nearest to the target marked."""
    columns = [
        Column("step", "step", "label"),
        *(Column(name, name, "value") for name in result.kept),
        Column("predicted", "predicted", "angle", "°"),
        ANGLE,
        Column("sd", "sd", "angle", "°"),
        Column("n", "heaps", "label"),
        Column("error", "angle − target", "angle", "°"),
        ERROR_PERCENT,
    ]
    marks = ["chosen" if step == result.best_step else "" for step in result.path.index]
    return make_table(
        "climb",
        result.path,
        columns,
        "The climb, step by step.",
        "Marked: the step nearest to the target.",
        marks,
    )


def paper_climb_table(path: pd.DataFrame) -> Table:
    """Lay out the paper's climb."""
    names = [name for name in path.columns if name not in ("angle", "error_percent")]
    columns = [
        Column("step", "step", "label"),
        *(Column(name, name, "value") for name in names),
        ANGLE,
        ERROR_PERCENT,
    ]
    return make_table("paper-climb", path, columns, "The paper's climb.")


def surface_design_table(result: SurfaceResult) -> Table:
    """Lay out the composite design with its response, natural and coded."""
    design = result.design
    natural = design.natural.join(design.points.add_suffix("_coded"))
    frame, angles = _with_response(natural, result.response)
    columns = [
        RUN,
        *(Column(factor.name, factor.name, "value", factor.unit) for factor in design.factors),
        *(Column(f"{name}_coded", f"{name} coded", "coded") for name in design.names),
        *angles,
    ]
    return make_table("surface-design", frame, columns, "Composite design and angles.")


def outside_table(result: SurfaceResult) -> Table | None:
    """Lay out the runs that leave the stated ranges; None when none does."""
    if result.outside.empty:
        return None
    columns = [RUN, Column("factor", "factor")]
    columns += [
        Column(key, head, "level") for key, head in (("value", "value"), ("low", "low"), ("high", "high"))
    ]
    return make_table("outside", result.outside, columns, "Runs outside the factors' stated ranges.")


def coefficients_table(surface: Surface) -> Table:
    """Lay out the coefficients of a surface with their standard errors."""
    frame = pd.DataFrame(
        {
            "natural": surface.coefficients,
            "coded": surface.coded_coefficients,
            "coded_se": surface.fit.bse,
            "p": surface.fit.pvalues,
        }
    ).rename_axis("term")
    columns = [
        Column("term", "term", write=term),
        Column("natural", "natural units", "free", "°"),
        Column("coded", "coded", "sum", "°"),
        Column("coded_se", "se (coded)", "sum", "°"),
        Column("p", "p", "p"),
    ]
    return make_table(
        "coefficients", frame.loc[surface.coefficients.index], columns, "Coefficients of the reduced model."
    )


def quality_table(result: SurfaceResult, published: pd.DataFrame | None) -> Table:
    """Lay out how well both models fit, the paper's beside them."""
    names = dict(zip(QUALITY, QUALITY_NAMES, strict=True))
    models = {"full": result.full, "reduced": result.reduced}
    frame = pd.DataFrame(
        {key: [getattr(model, name) for name in names] for key, model in models.items()}, index=names
    )
    if published is not None:
        frame = frame.join(published.add_prefix("paper_"))
    frame.insert(0, "measure", list(names.values()))
    columns = [
        Column("measure", "measure"),
        Column("full", "full", "share"),
        Column("reduced", "reduced", "share"),
    ]
    columns += [Column(f"paper_{key}", f"paper, {key}", "share") for key in models]
    return make_table("quality", frame, columns, "Quality of the fits.")


def ranges_table(optimum: OptimumResult, design: Design) -> Table:
    """Lay out the chosen point with the values that are as good."""
    ranges = optimum.region.ranges
    frame = pd.DataFrame({"chosen": optimum.point, "low": ranges["low"], "high": ranges["high"]}).rename_axis(
        "factor"
    )
    frame = frame.loc[design.names]
    frame["unit"] = [factor.unit for factor in design.factors]
    frame["pinned"] = ["no" if name in optimum.unidentified else "yes" for name in frame.index]
    if optimum.truth is not None:
        frame["truth"] = pd.Series(optimum.truth.values)
    columns = [
        Column("factor", "factor"),
        Column("chosen", "chosen", "free"),
        Column("low", "compatible from", "free"),
        Column("high", "to", "free"),
        Column("truth", "hidden truth", "free"),
        Column("unit", "unit"),
        Column("pinned", "pinned down by the target"),
    ]
    note = (
        "The factors trade off against one another: not every combination inside these ranges is compatible."
    )
    return make_table("ranges", frame, columns, "Chosen values and compatible ranges.", note)


def tests_table(result: VerificationResult, published: Published | None) -> Table:
    """Lay out the tests of the difference from the target, the paper's heaps beside them."""
    tests = {"this campaign": result.comparison}
    if published is not None:
        tests["the paper"] = compare_means(published.heaps, published.measured, result.margin)
    rows = [
        {
            "heaps": name,
            "mean": test.a.mean,
            "sd": test.a.sd,
            "n": test.a.n,
            "difference": test.difference,
            "low": test.interval[0],
            "high": test.interval[1],
            "t": test.t,
            "df": test.df,
            "p": test.p,
            "equivalence_p": test.equivalence_p,
            "smallest_margin": test.smallest_margin,
        }
        for name, test in tests.items()
    ]
    level = f"{100.0 * (1.0 - result.comparison.alpha):g} %"
    columns = [
        Column("heaps", "heaps"),
        Column("mean", "mean", "angle", "°"),
        Column("sd", "sd", "angle", "°"),
        Column("n", "n", "label"),
        Column("difference", "less target", "angle", "°"),
        Column("low", f"{level} from", "angle", "°"),
        Column("high", "to", "angle", "°"),
        Column("t", "t", "ratio"),
        Column("df", "df", "level"),
        Column("p", "p, no difference", "p"),
        Column("equivalence_p", f"p, equivalent within ± {fixed(result.margin, 2)}°", "p"),
        Column("smallest_margin", "smallest margin shown", "angle", "°"),
    ]
    note = "A large p of no difference is weak evidence with few heaps; equivalence says how near is shown."
    return make_table("tests", pd.DataFrame(rows), columns, "Tests of the difference from the target.", note)


def failed_table(campaign: Campaign) -> Table | None:
    """Lay out the cases that gave no angle; None when all did."""
    failed = campaign.failed_cases
    if failed.empty:
        return None
    several = len(campaign.scene_costs) > 1
    columns = [
        Column("stage", "stage"),
        *([Column("scene", "scene")] if several else []),
        RUN,
        Column("replicate", "replicate", "label"),
        Column("seed", "seed", "label"),
        Column("status", "status"),
        Column("reason", "reason"),
    ]
    gave = "failed, or gave no angle" if several else "gave no angle"
    return make_table("failed", failed, columns, f"{len(failed)} of {len(campaign.cases)} cases {gave}.")


def _with_response(settings: pd.DataFrame, response: np.ndarray) -> tuple[pd.DataFrame, list[Column]]:
    """Add the response to a design's settings: one column, or one a replicate."""
    replicates = response.reshape(len(settings), -1)
    count = replicates.shape[1]
    heads = {"angle" if count == 1 else f"angle_{i + 1}": i for i in range(count)}
    frame = settings.assign(**{key: replicates[:, i] for key, i in heads.items()}).rename_axis("run")
    columns = [
        Column(key, "angle" if count == 1 else f"angle {i + 1}", "angle", "°") for key, i in heads.items()
    ]
    return frame, columns


def _p_marks(p: pd.Series, alpha: float) -> list[str]:
    return ["strong" if value < alpha else "" for value in p]


def _failed_marks(angles: pd.Series) -> list[str]:
    return ["failed" if missing else "" for missing in angles.isna()]
