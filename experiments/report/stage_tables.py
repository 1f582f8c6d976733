"""The tables of every stage, laid out for the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from dem_warp import Case
from doe import Comparison, Factor, ScreenResult, Surface
from experiments.calibrate.campaign import Campaign
from experiments.calibrate.results import (
    ClimbResult,
    FittedResponse,
    OptimumResult,
    ScreeningResult,
    SelectionResult,
    SurfaceResult,
    failed,
)
from experiments.export.sizes import sizes_text
from experiments.io.toml_files import leaves
from experiments.report.kit.numbers import open_end, unit_sign
from experiments.report.kit.sentences import say
from experiments.report.kit.table import Column, Layout, Table, columns, make_table
from experiments.studyfile import Study
from experiments.studyfile.campaign import TARGET_SCENE, Response
from experiments.studyfile.factor_section import with_factor_values

SIGNIFICANT = 0.05
"""Rows of an analysis of variance with p below this are marked."""

ERROR_PERCENT = Column("error_percent", "relative error", "ratio", "%")
ENTERED = ("grain", "wall", "walls", "contact", "mechanism")
"""Sections of a study whose values a person enters in another code."""

QUALITY = {
    "r2": "R²",
    "r2_adjusted": "R² adjusted",
    "r2_predicted": "R² predicted",
    "cv_percent": "coefficient of variation [%]",
    "adequate_precision": "adequate precision (above 4 is wanted)",
}
"""Measures of a fit by their names in ``Surface``."""


def response_column(response: Response, key: str, head: str = "") -> Column:
    """Lay out a column of a response's values; without a head, it is the response's name."""
    kind = "angle" if response.unit == "deg" else "free"
    return Column(key, head or response.name, kind, unit_sign(response.unit))


def factors_table(
    factors: Sequence[Factor], labels: Mapping[str, str], truth: Mapping[str, float] | None
) -> Table:
    """Lay out what the campaign may vary, and in a twin study the hidden values."""
    levels = {f.name: {"low": f.low, "center": f.center, "high": f.high, "unit": f.unit} for f in factors}
    frame = pd.DataFrame.from_dict(levels, orient="index").rename_axis("factor")
    frame["label"] = [labels.get(name, "") for name in frame.index]
    if truth is not None:
        frame["truth"] = pd.Series(truth)
    heads = columns("level", low="low (−1)", center="middle (0)", high="high (+1)", truth="hidden truth")
    shown: Layout = ["factor", Column("label", "parameter"), *heads, "unit"]
    return make_table("factors", frame, shown, "Factors and their levels.")


def target_table(campaign: Campaign) -> Table:
    """Lay out what is to be matched; empty rows before the target is known."""
    samples = campaign.target.responses if campaign.target else {}
    rows = [
        {
            "response": response.name,
            "scene": "own" if response.scene == TARGET_SCENE else response.scene,
            "unit": unit_sign(response.unit),
            "role": "held out" if response.held_out else "fitted",
            "target_se": samples[response.name].se,
        }
        | vars(samples[response.name])
        for response in campaign.responses
        if response.name in samples
    ]
    rows += [
        {
            "response": direct.name,
            "scene": f"direct, {direct.by}",
            "unit": unit_sign(direct.unit),
            "role": "fitted",
            "target_se": direct.measured.se,
        }
        | vars(direct.measured)
        for direct in campaign.direct
    ]
    heads = columns("free", mean="mean", sd="standard deviation")
    shown: Layout = ["response", "scene", "role", "unit", *heads, "n"]
    shown.append(Column("target_se", "standard error", "free"))
    note = "Scene: the study's own, or a further one by its name. The first response leads the climb."
    return make_table("target", pd.DataFrame(rows), shown, "What is to be matched.", note)


def cases_table(
    name: str,
    cases: pd.DataFrame,
    responses: Sequence[Response],
    caption: str,
    factors: Sequence[Factor] = (),
) -> Table:
    """Lay out replicated cases of one setting, or of settings of some factors."""
    measured = {response.observable: response for response in responses}
    several = len(cases["scene"].unique()) > 1
    facts = (
        Column("grain_count", "grains", "count"),
        Column("fill_height", "fill height", "free", "m"),
        Column("solid_fraction", "solid fraction", "share"),
        Column("time_to_rest", "time to rest", "ratio", "s"),
    )
    shown: Layout = [
        *(["scene"] if several else []),
        *columns("label", replicate="case", seed="seed"),
        *(Column(factor.name, factor.name, "value", factor.unit) for factor in factors),
        *(column for column in facts if column.key not in measured),
        *(response_column(response, key) for key, response in measured.items()),
        *columns("angle", "°", angle_se="se of the angle over views"),
        "status",
    ]
    lost = cases.index.isin(failed(cases, responses).index)
    return make_table(name, cases, shown, caption, marks=["failed" if each else "" for each in lost])


def screening_design_table(result: ScreeningResult, responses: Sequence[Response]) -> Table:
    """Lay out the coded design with its responses."""
    values = {name: found.measured for name, found in result.responses.items()}
    frame, measured = _with_responses(result.design.coded, values, responses)
    coded = [Column(name, name, "coded") for name in result.design.coded.columns]
    note = f"Dummy columns, which belong to no factor: {', '.join(result.design.dummies) or 'none'}."
    caption = "Screening design (coded) and responses."
    return make_table("screening-design", frame, ["run", *coded, *measured], caption, note)


def effects_table(screen: ScreenResult, response: Response, labels: Mapping[str, str], alpha: float) -> Table:
    """Lay out the tests of the effects, strongest first."""
    frame = screen.table.sort_values("rank")
    frame.insert(0, "label", [labels.get(str(name), "") for name in frame.index])
    effect, share = response_column(response, "effect", "effect"), Column("percent", "share", "percent", "%")
    parameter = Column("label", "parameter")
    shown: Layout = ["rank", "factor", parameter, effect, "sum_sq", share, "F", "t", "p"]
    note = f"Marked: p < {alpha:g}. The effect is the change of the mean {response.name} from low to high."
    caption = f"Effects of the factors on the {response.name}."
    return make_table("effects", frame, shown, caption, note, p_marks(frame["p"], alpha))


def anova_table(name: str, anova: pd.DataFrame, caption: str) -> Table:
    """Lay out an analysis of variance."""
    shown: Layout = ["source", "df", "sum_sq", "mean_sq", "F", "p"]
    note, marks = f"Marked: p < {SIGNIFICANT}.", p_marks(anova["p"])
    return make_table(name, anova, shown, caption, note, marks)


def selection_table(result: SelectionResult, response: Response) -> Table:
    """Lay out why each factor was kept or not."""
    frame = result.table.rename_axis("factor").copy()
    frame["kept"] = np.where(frame["kept"], "kept", "left at its middle")
    frame["visible"] = np.where(frame["visible"], "yes", "no")
    shown: Layout = [
        "factor",
        response_column(response, "effect", "effect"),
        "p",
        *(Column(key, f"p, {key[2:]}", "p") for key in frame.columns if key.startswith("p_")),
        *columns(visible="beyond the noise floor", kept="decision", reason="reason"),
    ]
    marks = ["strong" if kept else "" for kept in result.table["kept"]]
    return make_table("selection", frame, shown, "Which factors the later stages vary.", marks=marks)


def climb_table(result: ClimbResult, response: Response) -> Table:
    """Lay out the steps of the climb, the nearest to the target marked."""
    shown: Layout = [
        "step",
        *(Column(name, name, "value") for name in result.kept),
        response_column(response, "predicted", "predicted"),
        response_column(response, "mean"),
        response_column(response, "sd", "sd"),
        Column("n", "cases", "label"),
        response_column(response, "error", f"{response.name} − target"),
        ERROR_PERCENT,
    ]
    marks = ["chosen" if step == result.best_step else "" for step in result.path.index]
    note = "Marked: the step nearest to the target."
    return make_table("climb", result.path, shown, "The climb, step by step.", note, marks)


def surface_design_table(result: SurfaceResult, responses: Sequence[Response]) -> Table:
    """Lay out the composite design with its responses, natural and coded."""
    design = result.design
    natural = design.natural.join(design.points.add_suffix("_coded"))
    values = {name: found.measured for name, found in result.responses.items()}
    frame, measured = _with_responses(natural, values, responses)
    values_of = [Column(factor.name, factor.name, "value", factor.unit) for factor in design.factors]
    coded = [Column(f"{name}_coded", f"{name} coded", "coded") for name in design.names]
    shown: Layout = ["run", *values_of, *coded, *measured]
    return make_table("surface-design", frame, shown, "Composite design and responses.")


def outside_table(result: SurfaceResult) -> Table | None:
    """Lay out the runs that leave the stated ranges; None when none does."""
    if result.outside.empty:
        return None
    shown: Layout = ["run", "factor", *columns("level", value="value", low="low", high="high")]
    return make_table("outside", result.outside, shown, "Runs outside the factors' stated ranges.")


def coefficients_table(surface: Surface, response: Response) -> Table:
    """Lay out the coefficients of a surface with their standard errors."""
    sign = unit_sign(response.unit)
    frame = pd.DataFrame(
        {
            "coded": surface.coded_coefficients,
            "coded_se": surface.fit.bse,
            "p": surface.fit.pvalues,
        }
    ).rename_axis("term")
    coded = columns("sum", sign, coded="coded", coded_se="se (coded)")
    shown: Layout = ["term", *coded, "p"]
    frame = frame.loc[surface.coefficients.index]
    return make_table("coefficients", frame, shown, "Coefficients of the reduced model.")


def quality_of(models: Mapping[str, Surface]) -> pd.DataFrame:
    """Calculate the measures of fits, one column a model."""
    values = {model: [getattr(fit, name) for name in QUALITY] for model, fit in models.items()}
    return pd.DataFrame(values, index=list(QUALITY)).assign(measure=pd.Series(QUALITY))


def quality_table(result: FittedResponse) -> Table:
    """Lay out how well both models fit."""
    frame = quality_of({"full": result.full, "reduced": result.reduced})
    shown: Layout = ["measure", *columns("share", full="full", reduced="reduced")]
    return make_table("quality", frame, shown, "Quality of the fits.")


def values_table(campaign: Campaign, optimum: OptimumResult, study: Study) -> Table:
    """Lay out the value of every factor, with the values that are as good where it was calibrated."""
    ranges, chosen = optimum.ranges, optimum.point
    frame = pd.DataFrame(
        {
            "label": study.labels,
            "value": optimum.settings,
            "unit": {factor.name: factor.unit for factor in campaign.factors},
            "low": ranges["low"],
            "high": ranges["high"],
            "how": {name: _how(name, optimum, study) for name in optimum.settings},
        }
    ).rename_axis("factor")
    for end in ("low", "high"):
        frame[f"{end} around"] = ranges[f"{end}_open"].map({True: open_end(end), False: "{}"})
        frame[f"{end} around"] = frame[f"{end} around"].fillna("{}")
    frame = frame.loc[[*chosen, *(name for name in optimum.settings if name not in chosen)]]
    shown: Layout = [
        *columns(label="parameter", factor="symbol"),
        Column("value", "value", "level"),
        "unit",
        Column("low", "as good from", "free", around="low around"),
        Column("high", "to", "free", around="high around"),
        Column("how", "how it was found"),
    ]
    marks = ["chosen" if name in chosen else "" for name in frame.index]
    caption = "Calibrated values (marked), and those that every case shared."
    level = f"{100.0 * campaign.settings.optimum.confidence:.3g}"
    note = say("note.intervals", level=level) if optimum.joint else say("note.values")
    return make_table("values", frame, shown, caption, note if len(chosen) > 1 else "", marks)


def fixed_table(study: Study, optimum: OptimumResult, case: Case[Any]) -> Table:
    """Lay out all else that a code must be given: what the study fixes, with the modulus as simulated."""
    chosen = with_factor_values(study.document, study.factor_sections, optimum.settings)
    varied = {place for section in study.factor_sections for place in section.parameter}
    moduli = {"grain": case.grain_material.shear_modulus, "wall": study.wall.shear_modulus}
    rows = [
        {"what": place.replace(".", ", ").replace("_", " "), "value": str(value), "note": ""}
        for place, value in leaves({key: chosen[key] for key in ENTERED if key in chosen})
        if place not in varied and not place.endswith("shear_modulus") and not place.startswith("grain.size_")
    ]
    rows.append({"what": "grain, sizes", "value": sizes_text(case.grains), "note": ""})
    scale = study.numerics.modulus_scale
    for name, modulus in moduli.items():
        note = f"as simulated: divided by {scale:g}; keep it" if name == "grain" and scale != 1.0 else ""
        rows.append({"what": f"{name}, shear modulus", "value": f"{modulus:.12g} Pa", "note": note})
    rows.append({"what": "contact laws", "value": study.solver.laws.name, "note": "see what was simulated"})
    heads = columns(what="what the study fixes", value="value", note="note")
    return make_table("fixed-values", pd.DataFrame(rows), heads, "All else that the values hold with.")


def _how(name: str, optimum: OptimumResult, study: Study) -> str:
    how = "calibrated" if name in optimum.point else "middle of its range"
    how += ", left open" if name in optimum.unidentified else ""
    scale, sections = study.numerics.modulus_scale, {each.name: each for each in study.factor_sections}
    softened = scale != 1.0 and "grain.shear_modulus" in sections[name].parameter
    return how + (f"; enter it divided by {scale:g}, as simulated" if softened else "")


def differences_table(
    tests: Mapping[str, Comparison], units: Mapping[str, str], name: str = "tests"
) -> Table:
    """Lay out tests of the difference from a target; tests and units are by response."""
    rows = [
        {"response": response, "unit": unit_sign(units[response]), **comparison_facts(test)}
        for response, test in tests.items()
    ]
    level = f"{100.0 * (1.0 - next(iter(tests.values())).alpha):.3g} %"
    kind = "angle" if {units[response] for response in tests} == {"deg"} else "free"
    shown: Layout = [
        *("response", "unit"),
        *columns(kind, mean="mean", sd="sd"),
        "n",
        *columns(kind, difference="less target", low=f"{level} from", high="to"),
        "t",
        *columns("level", df="df"),
        *columns("p", p="p, no difference"),
        *columns(kind, margin="margin ±"),
        *columns("p", equivalence_p="p, equivalent within it"),
        *columns(kind, smallest_margin="smallest margin shown"),
    ]
    caption, note = "Tests of the difference from the target.", say("note.differences")
    return make_table(name, pd.DataFrame(rows), shown, caption, note)


def comparison_facts(test: Comparison) -> dict[str, float | None]:
    """Numbers of a comparison of two means, by name; mean, sd and n are those of the first sample."""
    low, high = test.interval
    names = ("difference", "t", "df", "p", "margin", "equivalence_p", "smallest_margin")
    return vars(test.a) | {"low": low, "high": high} | {name: getattr(test, name) for name in names}


def failed_table(campaign: Campaign) -> Table | None:
    """Lay out the cases that failed or lack a response; None when none does."""
    lost = campaign.failed_cases
    if lost.empty:
        return None
    several = len(campaign.scene_costs) > 1
    shown: Layout = ["stage", *(["scene"] if several else []), "run", "replicate", "seed", "status", "reason"]
    caption = f"{len(lost)} of {len(campaign.cases)} cases failed, or lack a response."
    return make_table("failed", lost, shown, caption)


def _with_responses(
    settings: pd.DataFrame, values: Mapping[str, np.ndarray], responses: Sequence[Response]
) -> tuple[pd.DataFrame, list[Column]]:
    """Add responses to a design's settings: one column each, or one a replicate."""
    added: dict[str, np.ndarray] = {}
    heads = []
    for response in (one for one in responses if one.name in values):
        replicates = values[response.name].reshape(len(settings), -1)
        for i, column in enumerate(replicates.T, start=1):
            head = response.name if replicates.shape[1] == 1 else f"{response.name} {i}"
            added[f"response {head}"] = column
            heads.append(response_column(response, f"response {head}", head))
    return settings.assign(**added).rename_axis("run"), heads


def p_marks(p: pd.Series, alpha: float = SIGNIFICANT) -> list[str]:
    """Return the marks of rows whose p value is below a level."""
    return ["strong" if value < alpha else "" for value in p]
