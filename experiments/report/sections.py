"""Chapters of a campaign's page: the tables and charts that each stage shows."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from experiments.calibrate.campaign import Campaign
from experiments.calibrate.fidelity_stage import FidelityResult
from experiments.calibrate.results import (
    ClimbResult,
    NoiseFloorResult,
    ScreeningResult,
    SurfaceResult,
    TargetResult,
    VerificationResult,
)
from experiments.report import stage_charts, stage_tables, surface_charts
from experiments.report.joint_charts import joint_charts
from experiments.report.kit.chart import Chart
from experiments.report.kit.html import Chapter
from experiments.report.kit.table import Table
from experiments.report.response_tables import response_tables
from experiments.studyfile.campaign import Response

TITLES = {
    "factors": "Factors",
    "target": "Target",
    "noise_floor": "Noise floor",
    "screening": "Screening",
    "selection": "Factors kept",
    "climb": "Steepest climb",
    "surface": "Response surface",
    "fidelity": "The surface at this scale",
    "optimum": "Optimum and compatible region",
    "responses": "Several responses",
    "verification": "Verification",
    "other_codes": "The values in the words of each code",
    "paper_text": "For your paper",
    "heaps": "Heaps",
    "failed": "Failed runs",
    "provenance": "Settings and provenance",
}
"""Headings by chapter."""


def chapter(name: str, tables: Mapping[str, Table] | None = None, charts: Sequence[Chart] = ()) -> Chapter:
    """Build the chapter of a stage, or of what belongs to all of them, which a template of its name fills."""
    return Chapter(name, TITLES[name], tables or {}, charts, template=f"sections/{name}.html.j2")


@dataclass(frozen=True)
class Context:
    """Sources of the chapters."""

    campaign: Campaign
    labels: Mapping[str, str]
    """Meaning of each factor, in words."""

    @property
    def leading(self) -> Response:
        """The response that leads the campaign."""
        return self.campaign.responses[0]

    @property
    def target(self) -> TargetResult:
        """Target of a campaign that reached its first stage."""
        if self.campaign.target is None:
            raise ValueError("the campaign ended before its target")
        return self.campaign.target

    @property
    def truth(self) -> dict[str, float] | None:
        """Hidden factor values of a twin study."""
        return self.campaign.target.truth if self.campaign.target else None


def stage_chapters(context: Context) -> list[Chapter]:
    """Build the chapters of the factors, of every stage that was reached, and of several responses."""
    campaign = context.campaign
    factors = stage_tables.factors_table(campaign.factors, context.labels, context.truth)
    chapters = [chapter("factors", {"levels": factors})]
    for name, result in campaign.stages.items():
        chapters.append(_STAGES[name](context, result))
        if name == "optimum":
            chapters += _responses(context)
    return chapters


def failed_chapter(campaign: Campaign) -> Chapter:
    """Build the chapter of the cases that failed or lack a response."""
    table = stage_tables.failed_table(campaign)
    return chapter("failed", {"cases": table} if table else {})


def _target(context: Context, result: TargetResult) -> Chapter:
    campaign, tables = context.campaign, {"target": stage_tables.target_table(context.campaign)}
    if result.cases is not None:
        caption = "The cases whose means are the target."
        table = stage_tables.cases_table("target-cases", result.cases, campaign.responses, caption)
        tables["cases"] = table
    return chapter("target", tables)


def _noise_floor(context: Context, result: NoiseFloorResult) -> Chapter:
    caption, responses = "Replicates at the middle.", context.campaign.responses
    table = stage_tables.cases_table("noise-floor", result.cases, responses, caption)
    chart = stage_charts.noise_floor_chart(result, context.target, context.leading)
    return chapter("noise_floor", {"cases": table}, [chart])


def _screening(context: Context, result: ScreeningResult) -> Chapter:
    alpha = context.campaign.settings.selection.alpha
    screen, response = result.leading.screen, context.leading
    tables = {
        "design": stage_tables.screening_design_table(result, context.campaign.responses),
        "effects": stage_tables.effects_table(screen, response, context.labels, alpha),
        "anova": stage_tables.anova_table("screening-anova", screen.anova, "Analysis of variance."),
    }
    drawn = (stage_charts.pareto_chart, stage_charts.half_normal_chart)
    return chapter("screening", tables, [draw(screen, alpha, response) for draw in drawn])


def _climb(context: Context, result: ClimbResult) -> Chapter:
    tables = {"path": stage_tables.climb_table(result, context.leading)}
    return chapter("climb", tables, [stage_charts.climb_chart(result, context.target, context.leading)])


def _surface(context: Context, result: SurfaceResult) -> Chapter:
    campaign, response = context.campaign, context.leading
    fit, anova_table = result.leading, stage_tables.anova_table
    tables = {
        "design": stage_tables.surface_design_table(result, campaign.responses),
        "full": anova_table("anova-full", fit.full.anova, "Full quadratic model."),
        "reduced": anova_table("anova-reduced", fit.reduced.anova, "Reduced model."),
        "quality": stage_tables.quality_table(fit),
        "coefficients": stage_tables.coefficients_table(fit.reduced, response),
    }
    outside = stage_tables.outside_table(result)
    if outside:
        tables["outside"] = outside
    drawn = surface_charts.surface_charts(result, campaign.optimum, context.target, response)
    return chapter("surface", tables, [*drawn, *surface_charts.residual_charts(fit.reduced, response)])


def _fidelity(context: Context, result: FidelityResult) -> Chapter:
    caption = f"Runs that move the surface of the scale {result.scale}."
    factors = next(iter(result.responses.values())).design.factors
    responses = [one for one in context.campaign.responses if not one.held_out]
    table = stage_tables.cases_table("fidelity", result.cases, responses, caption, factors)
    return chapter("fidelity", {"cases": table})


def _responses(context: Context) -> list[Chapter]:
    campaign = context.campaign
    if campaign.surface is None or campaign.optimum is None or campaign.optimum.joint is None:
        return []
    tables = response_tables(campaign)
    drawn = joint_charts(campaign.surface, campaign.optimum, context.target, campaign.responses)
    return [chapter("responses", tables, drawn)]


def _verification(context: Context, result: VerificationResult) -> Chapter:
    caption, responses = "Fresh cases at the chosen point.", context.campaign.responses
    table = stage_tables.cases_table("verification-cases", result.cases, responses, caption)
    units = {response.name: response.unit for response in responses}
    tests = stage_tables.differences_table({name: result.responses[name] for name in units}, units)
    chart = stage_charts.verification_chart(result, context.leading)
    return chapter("verification", {"cases": table, "tests": tests}, [chart])


_STAGES: dict[str, Callable[[Context, Any], Chapter]] = {
    "target": _target,
    "noise_floor": _noise_floor,
    "screening": _screening,
    "selection": lambda context, result: chapter(
        "selection", {"reasons": stage_tables.selection_table(result, context.leading)}
    ),
    "climb": _climb,
    "surface": _surface,
    "fidelity": _fidelity,
    "optimum": lambda *_: chapter("optimum"),
    "verification": _verification,
}
