"""Answers of ``dem-warp doe``: texts, tables and plots."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import pandas as pd

import doe
from doe import (
    Category,
    ClimbPath,
    Design,
    DesignError,
    DesignQuality,
    Estimate,
    LinearFit,
    Mixture,
    ScreenResult,
    Surface,
    Wish,
    plots,
)
from experiments.commands.tables.sheet import Sheet, read_mixture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Made = TypeVar("Made")

MOST_TRACES = 3
"""Pairs of factors whose interaction is drawn, the largest effects first."""
RIDGE_RADII = np.linspace(0.0, 1.0, 6)
CLIMB_STEPS = 5


@dataclass
class Answer:
    """The answer of a command, in parts that follow one another on its page."""

    title: str
    texts: list[str] = field(default_factory=list)
    tables: dict[str, tuple[str, pd.DataFrame]] = field(default_factory=dict)
    """Captions and tables, by name."""
    plots: dict[str, tuple[str, Callable[[], Figure]]] = field(default_factory=dict)
    """Captions and what draws the figures, by name."""
    notes: list[str] = field(default_factory=list)

    def add(self, name: str, caption: str, make: Callable[[], pd.DataFrame]) -> None:
        """Add a table, or a note if the statistics have none for this design."""
        if (made := self.made(caption, make)) is not None:
            self.tables[name] = caption, made

    def draw(self, name: str, caption: str, make: Callable[[], Figure]) -> None:
        """Add a plot, which is drawn when the answer is published."""
        self.plots[name] = caption, make

    def made(self, caption: str, make: Callable[[], Made]) -> Made | None:
        """Make a part of the answer; None, and a note, if the statistics have none for this design."""
        try:
            return make()
        except DesignError as error:
            self.notes.append(f"No {caption[0].lower()}{caption[1:].rstrip('.')}: {error}.")
            return None


def run_table(design: Design | Mixture) -> pd.DataFrame:
    """Return the runs in the order of execution, in natural units, with an empty column for the response."""
    if isinstance(design, Mixture):
        return design.shares.loc[design.run_order].rename_axis("run").assign(response="")
    heads = {factor.name: factor.label for factor in design.factors}
    table = design.natural.rename(columns=heads).join(design.coded[list(design.dummies)])
    if design.blocks is not None:
        table.insert(0, "block", design.blocks)
    return table.loc[design.run_order].rename_axis("run").assign(response="")


def describe_design(design: Design | Mixture, model: str, sd: float | None, effect: float | None) -> Answer:
    """Describe a design before its runs: what it can tell apart, and with what power."""
    answer = Answer(repr(design))
    answer.tables["runs"] = "Runs in the order in which to do them.", run_table(design)
    if isinstance(design, Mixture):
        return answer
    answer.notes += design.notes
    if all(not isinstance(f, Category) or len(f.levels) == 2 for f in design.factors):
        answer.add("aliases", "Effects that the design mixes up.", lambda: _alias_table(design))
    caption = "Efficiencies for the model."
    if quality := answer.made(caption, lambda: doe.design_quality(design, model)):
        answer.tables["quality"] = caption, _quality_table(quality)
        caption = "Standard error of the fitted mean, for an error of 1, that shares of the box stay below."
        answer.draw("precision", caption, lambda: plots.precision_plot(quality))
    sizes = (effect,) if effect is not None else (1.0, 2.0) if sd is None else (sd, 2.0 * sd)
    answer.add(
        "power",
        f"Probability that a term is found, for effects of {' and '.join(f'{size:g}' for size in sizes)} "
        f"and a standard deviation of {1.0 if sd is None else sd:g}.",
        lambda: doe.power_table(design, sizes, model=model, sd=1.0 if sd is None else sd),
    )
    return answer


def _alias_table(design: Design) -> pd.DataFrame:
    structure = doe.alias_structure(design)
    if not structure.matrix.size:
        raise DesignError("it mixes up nothing of up to two factors")
    return structure.matrix.rename_axis("effect")


def _quality_table(quality: DesignQuality) -> pd.DataFrame:
    rows = {f"{letter} efficiency": getattr(quality, f"{letter.lower()}_efficiency") for letter in "DAG"}
    rows |= {f"variance inflation of {name}": value for name, value in quality.vif.items()}
    return pd.Series(rows).rename_axis("measure").to_frame("value")


def screen_table(sheet: Sheet, name: str, error: str | None, alpha: float) -> Answer:
    """Screen the factors of a table of two-level runs."""
    design, values = sheet.observed(name)
    result = doe.screen(design, values, error)
    answer = Answer(f"Screening of {name}", [result.summary()])
    answer.tables["effects"] = "Effects, largest first.", result.table.sort_values("rank")
    answer.tables["anova"] = "Analysis of variance.", result.anova
    answer.add("aliases", "Effects that the design mixes up.", lambda: _alias_table(design))
    caption, drawn = "Effects with interactions, tested by Lenth's method.", None
    if not design.dummies:
        drawn = answer.made(caption, lambda: doe.two_level_effects(design, values))
    if drawn:
        answer.tables["interactions"] = caption, drawn.table
        found = drawn.table[["effect", "ratio", "p"]].to_string(float_format="{:.4g}".format)
        answer.texts.append(f"{caption}\n{found}")
    answer.add("climb", "Steepest climb from the center.", lambda: _climb(result))
    answer.draw("pareto", "Effects and the limits of the test.", lambda: plots.pareto_chart(result))
    answer.draw("half_normal", "Half-normal plot.", lambda: plots.half_normal_plot(drawn or result, name))
    _add_means(answer, design, values, name, list(result.table.sort_values("rank").index))
    found = ", ".join(result.significant(alpha)) or "none"
    answer.notes.insert(0, f"Significant at {alpha:g}: {found}.")
    if drawn:
        found = ", ".join(drawn.significant(alpha)) or "none"
        answer.notes.insert(1, f"Significant at {alpha:g} with interactions, by Lenth's method: {found}.")
    return answer


def _climb(result: ScreenResult) -> pd.DataFrame:
    path = doe.steepest_path(result, CLIMB_STEPS)
    return path.natural.assign(predicted=path.predicted).rename_axis("run")


def _add_means(
    answer: Answer, design: Design, values: pd.Series, name: str, ranked: Sequence[str]
) -> None:  # fmt: skip
    """Add the plots of means by level, of single factors and of the largest ones in pairs."""
    answer.draw("main_effects", "Means by level.", lambda: plots.main_effects_plot(design, values, name))
    pairs = [(x, trace) for i, x in enumerate(ranked) for trace in ranked[i + 1 :]][:MOST_TRACES]
    for x, trace in pairs:
        answer.draw(
            f"interaction_{x}_{trace}", f"Means by {x} and {trace}.",
            partial(plots.interaction_plot, design, values, x, trace, name),
        )  # fmt: skip


def climb_runs(sheet: Sheet, name: str, target: float) -> Answer:
    """Show how far each run of a climb is from the target."""
    design, values = sheet.observed(name)
    table = doe.climb_table(design, values, target)
    answer = Answer(f"Climb of {name} to {target:g}")
    answer.tables["climb"] = "Runs of the climb.", table.rename_axis("run")
    answer.notes.append(f"Run {table['error'].abs().idxmin()} is nearest to the target.")
    answer.texts.append(table.to_string())
    none = pd.Series(np.nan, index=design.coded.index)
    path = ClimbPath(design.factors, design.points, predicted=none)
    answer.draw(
        "climb", "Runs and target.", lambda: plots.climb_plot(path, values, target, response_label=name)
    )
    return answer


def compare_columns(both: pd.DataFrame, value_sd: float, reference_sd: float) -> Answer:
    """Compare a column with its reference, the next one, run by run."""
    value, reference = both
    result = doe.agreement(both[value], both[reference], value_sd**2, reference_sd**2)
    rows = {
        "runs": result.runs, "bias": result.bias, "root mean square difference": result.rmse,
        "slope": result.slope, "rank correlation": result.spearman,
    }  # fmt: skip
    if value_sd or reference_sd:
        rows["root mean square difference without noise"] = result.rmse_without_noise
        rows["rank correlation of a perfect model"] = result.spearman_ceiling
    estimates = {
        name: vars(each) if isinstance(each, Estimate) else {"value": each} for name, each in rows.items()
    }
    table = pd.DataFrame.from_dict(estimates, orient="index").rename_axis("measure")
    answer = Answer(f"{value} against {reference}", [table.to_string()])
    answer.tables["agreement"] = f"Agreement of {value} with {reference}, with 95 % intervals.", table
    groups = ["runs"] * len(both)
    answer.draw("agreement", "Run by run.", lambda: plots.agreement_plot(result, groups, value, reference))
    return answer


def fitted(sheet: Sheet, name: str, model: str | list[str], alpha: float, reduced: bool) -> Surface:
    """Fit a response surface to a table of runs, without insignificant terms if it is to be reduced."""
    whole = doe.fit_surface(*sheet.observed(name), model)
    return whole.reduce(alpha) if reduced else whole


def describe_fit(surface: Surface, name: str, alpha: float) -> Answer:
    """Describe a fitted surface: tests, quality, canonical analysis, residuals."""
    answer = Answer(f"Response surface of {name}", [surface.summary()])
    answer.tables["coefficients"] = "Coefficients in coded units.", surface.coefficient_table
    answer.tables["anova"] = "Analysis of variance by term.", surface.anova
    answer.tables["anova_by_order"] = "Analysis of variance by order of the terms.", surface.anova_by_order
    answer.tables["quality"] = "Quality of the fit.", _fit_quality(surface)
    answer.notes.append(
        f"R2 {surface.r2:.4f}, adjusted {surface.r2_adjusted:.4f}, predicted {surface.r2_predicted:.4f}."
    )
    _add_canonical(answer, surface, alpha)
    answer.add("influence", "Influence of each observation.", lambda: doe.influence(surface))
    _add_checks(answer, surface)
    answer.draw("residuals", "Residuals.", lambda: plots.residual_plots(surface))
    _add_surface_plots(answer, surface, name)
    return answer


def _fit_quality(surface: Surface) -> pd.DataFrame:
    names = {
        "r2": "R2", "r2_adjusted": "R2 adjusted", "r2_predicted": "R2 predicted", "press": "PRESS",
        "residual_ms": "residual mean square", "residual_df": "residual degrees of freedom",
        "cv_percent": "coefficient of variation [%]", "adequate_precision": "adequate precision",
    }  # fmt: skip
    rows = {text: getattr(surface, name) for name, text in names.items()}
    rows["p of the lack of fit"] = surface.anova.loc["lack of fit", "p"]
    return pd.Series(rows).rename_axis("measure").to_frame("value")


def _add_canonical(answer: Answer, surface: Surface, alpha: float) -> None:
    """Add the canonical analysis, and the best point at each distance from the center."""
    try:
        analysis = doe.canonical(surface, alpha)
    except DesignError as error:
        answer.notes.append(f"No canonical analysis: {error}.")
        return
    answer.texts.append(str(analysis))
    answer.notes += str(analysis).splitlines()[:1] + list(analysis.notes)
    answer.tables["canonical"] = (
        "Canonical analysis: curvatures along the surface's own axes.",
        (analysis.table.join(analysis.axes.T).rename_axis("axis")),
    )
    point = analysis.stationary
    stationary = pd.DataFrame({"natural": point.natural, "coded": point.coded}).rename_axis("factor")
    answer.tables["stationary"] = f"Stationary point: {point.kind}, {point.mean:.6g}.", stationary
    for descend, text in ((False, "largest"), (True, "smallest")):
        answer.add(
            f"ridge_{text}", f"Ridge path to the {text} response.",
            partial(doe.ridge_path, surface, RIDGE_RADII, descend=descend),
        )  # fmt: skip


def _add_checks(answer: Answer, surface: Surface) -> None:
    """Add what the residuals say about the model."""
    robust = doe.robust_coefficients(surface)
    answer.tables["robust"] = "Coefficients with robust standard errors.", robust.table
    answer.notes += [robust.note] if robust.note else []
    try:
        answer.notes.append(f"Power of the response by Box and Cox: {doe.box_cox(surface).advice}.")
    except DesignError as error:
        answer.notes.append(f"No Box-Cox power: {error}.")


def _add_surface_plots(answer: Answer, surface: Surface, name: str) -> None:
    names = surface.design.names
    center = {factor.name: factor.center for factor in surface.design.factors}
    if len(names) > 1:
        answer.draw("contour", "Contours.", lambda: plots.contour_plot(surface, response_label=name))
        answer.draw("surface", "Surface.", lambda: plots.surface_plot(surface, response_label=name))
    if len(names) == 3:
        answer.draw(
            "cube", "Fitted responses at the corners.", lambda: plots.cube_plot(surface, response_label=name)
        )
    answer.draw(
        "profile", "Profiles through the center.", lambda: plots.profile_plot({name: surface}, center)
    )
    if len(names) == 2:
        answer.draw(
            "stationary_region", "Settings that may be the stationary point.",
            lambda: plots.contour_plot(surface, region=doe.stationary_region(surface), response_label=name),
        )  # fmt: skip


def fit_formula_table(sheet: Sheet, name: str, formula: str) -> Answer:
    """Fit the terms of a formula, in natural units."""
    return _linear_answer(doe.fit_formula(*sheet.observed(name), formula, coded=False), name)


def fit_mixture_table(path: Path, responses: Sequence[str], model: str) -> Answer:
    """Fit Scheffe's polynomial to a table of blends."""
    mixture, values = read_mixture(path, responses)
    return _linear_answer(doe.fit_mixture(mixture, values, model), str(values.name))


def _linear_answer(linear: LinearFit, name: str) -> Answer:
    answer = Answer(f"Linear model of {name}", [linear.summary()])
    answer.tables["coefficients"] = "Coefficients.", linear.coefficient_table
    answer.add("anova", "Analysis of variance.", lambda: linear.anova)
    answer.add("robust", "Coefficients with robust standard errors.", lambda: linear.robust_table)
    answer.draw("residuals", "Residuals.", lambda: plots.residual_plots(linear))
    return answer


def best_setting(
    surfaces: Mapping[str, Surface], wishes: Mapping[str, Wish | str], extent: float,
    constraints: Sequence[str], seed: int,
) -> Answer:  # fmt: skip
    """Find the best setting of one response or several.

    A wish is "max" or "min", for one response alone, or a `Wish`.
    """
    single = next(iter(wishes.values()))
    search: dict[str, Any] = {"extent": extent, "constraints": list(constraints), "seed": seed}
    if isinstance(single, str):
        find = doe.maximize if single == "max" else doe.minimize
        best = find(next(iter(surfaces.values())), **search)
        scales = None
    else:
        scales = {name: wish for name, wish in wishes.items() if isinstance(wish, Wish)}
        best = doe.most_desirable(surfaces, scales, **search)
    best = replace(best, responses=best.responses.set_axis(list(surfaces)))
    answer = Answer("Best setting", [str(best)])
    setting = pd.DataFrame({"natural": best.natural, "coded": best.coded}).rename_axis("factor")
    answer.tables["setting"] = "The best setting.", setting
    answer.tables["responses"] = "Fitted responses there.", best.responses.rename_axis("response")
    if isinstance(single, Wish) and single.target is not None and len(surfaces) == 1:
        surface, target = next(iter(surfaces.values())), single.target
        answer.add(
            "nearest", "Nearest to the center, of all settings of the target.",
            lambda: surface.nearest(target, extent=extent).rename_axis("factor").to_frame("natural"),
        )  # fmt: skip
        if near := answer.tables.get("nearest"):
            answer.texts.append(f"{near[0]}\n{near[1].to_string()}")
    point = dict(best.natural)
    answer.draw("profile", "Profiles through it.", lambda: plots.profile_plot(surfaces, point, scales))
    if scales and len(best.natural) > 1:
        limits = {name: (wish.low, wish.high) for name, wish in scales.items()}
        answer.draw(
            "overlay", "Settings that keep all limits.",
            lambda: plots.overlay_plot(surfaces, limits, at=point, point=point, extent=extent),
        )  # fmt: skip
    return answer
