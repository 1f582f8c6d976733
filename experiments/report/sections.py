"""Chapters of a campaign's page: the tables and charts that each stage shows."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from experiments.calibrate.results import Campaign
from experiments.report import charts, stage_tables, surfaces
from experiments.report.joint_charts import joint_charts
from experiments.report.kit.chart import Chart
from experiments.report.kit.html import Chapter
from experiments.report.kit.table import Table
from experiments.report.published import Published
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
    "optimum": "Optimum and compatible region",
    "responses": "Several responses",
    "verification": "Verification",
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
    """What the chapters draw on."""

    campaign: Campaign
    labels: Mapping[str, str]
    """What each factor is, in words."""
    published: Published | None
    """Published numbers of the same study, where there are some."""
    responses: tuple[Response, ...] = ()
    """What was to be matched beside the angle."""

    @property
    def truth(self) -> dict[str, float] | None:
        """Hidden factor values of a twin study."""
        return self.campaign.target.truth if self.campaign.target else None


def stage_chapters(context: Context) -> list[Chapter]:
    """Build the chapters of the factors, of every stage that was reached, and of several responses."""
    campaign = context.campaign
    factors = stage_tables.factors_table(campaign.factors, context.labels, context.truth)
    chapters = [chapter("factors", {"levels": factors})]
    for name in campaign.stages:
        chapters.append(_STAGES[name](context))
        if name == "optimum":
            chapters += _responses(context)
    return chapters


def failed_chapter(campaign: Campaign) -> Chapter:
    """Build the chapter of the cases that gave no angle."""
    table = stage_tables.failed_table(campaign)
    return chapter("failed", {"cases": table} if table else {})


def _target(context: Context) -> Chapter:
    target = context.campaign.target
    if target is None or target.cases is None:
        return chapter("target")
    caption = "The heaps whose mean is the target."
    return chapter("target", {"heaps": stage_tables.heaps_table("target-heaps", target.cases, caption)})


def _noise_floor(context: Context) -> Chapter:
    result, target = context.campaign.noise_floor, context.campaign.target
    if result is None or target is None:
        return chapter("noise_floor")
    table = stage_tables.heaps_table("noise-floor", result.cases, "Replicates at the middle.")
    return chapter("noise_floor", {"heaps": table}, [charts.noise_floor_chart(result, target)])


def _screening(context: Context) -> Chapter:
    result, alpha = context.campaign.screening, context.campaign.settings.selection.alpha
    if result is None:
        return chapter("screening")
    published = context.published.screening if context.published else None
    tables = {
        "design": stage_tables.screening_design_table(result),
        "effects": stage_tables.effects_table(result, context.labels, alpha, published),
        "anova": stage_tables.anova_table("screening-anova", result.screen.anova, "Analysis of variance."),
    }
    drawn = [charts.pareto_chart(result.screen, alpha), charts.half_normal_chart(result.screen, alpha)]
    return chapter("screening", tables, drawn)


def _selection(context: Context) -> Chapter:
    result = context.campaign.selection
    return chapter("selection", {"reasons": stage_tables.selection_table(result)} if result else {})


def _climb(context: Context) -> Chapter:
    result, target = context.campaign.climb, context.campaign.target
    if result is None or target is None:
        return chapter("climb")
    tables = {"path": stage_tables.climb_table(result)}
    if context.published:
        tables["paper"] = stage_tables.paper_climb_table(context.published.climb)
    return chapter("climb", tables, [charts.climb_chart(result, target)])


def _surface(context: Context) -> Chapter:
    campaign = context.campaign
    result, target = campaign.surface, campaign.target
    if result is None or target is None:
        return chapter("surface")
    published = context.published
    same = published is not None and set(published.kept) == set(result.design.names)
    names = tuple(result.design.names)
    paper = {
        model: published.anova(model, names) if published and same else None for model in ("full", "reduced")
    }
    tables = {
        "design": stage_tables.surface_design_table(result),
        "full": stage_tables.anova_table(
            "anova-full", result.full.anova, "Full quadratic model.", paper["full"]
        ),
        "reduced": stage_tables.anova_table(
            "anova-reduced", result.reduced.anova, "Reduced model.", paper["reduced"]
        ),
        "quality": stage_tables.quality_table(result, published.quality if published and same else None),
        "coefficients": stage_tables.coefficients_table(result.reduced),
    }
    outside = stage_tables.outside_table(result)
    if outside:
        tables["outside"] = outside
    residuals = surfaces.residual_charts(result.reduced)
    return chapter(
        "surface", tables, [*surfaces.surface_charts(result, campaign.optimum, target), *residuals]
    )


def _optimum(context: Context) -> Chapter:
    campaign = context.campaign
    if campaign.optimum is None or campaign.surface is None:
        return chapter("optimum")
    table = stage_tables.ranges_table(campaign.optimum, campaign.surface.design)
    return chapter("optimum", {"ranges": table})


def _responses(context: Context) -> list[Chapter]:
    """Build the chapter of several responses; none where the angle is alone."""
    campaign = context.campaign
    surface, optimum, target = campaign.surface, campaign.optimum, campaign.target
    if surface is None or optimum is None or target is None or optimum.joint is None:
        return []
    drawn = joint_charts(surface, optimum, target)
    return [chapter("responses", response_tables(campaign, context.responses), drawn)]


def _verification(context: Context) -> Chapter:
    result = context.campaign.verification
    if result is None:
        return chapter("verification")
    table = stage_tables.heaps_table("verification-heaps", result.cases, "Fresh heaps at the chosen point.")
    tests = stage_tables.tests_table(result, context.published)
    return chapter("verification", {"heaps": table, "tests": tests}, [charts.verification_chart(result)])


_STAGES: dict[str, Callable[[Context], Chapter]] = {
    "target": _target,
    "noise_floor": _noise_floor,
    "screening": _screening,
    "selection": _selection,
    "climb": _climb,
    "surface": _surface,
    "optimum": _optimum,
    "verification": _verification,
}
