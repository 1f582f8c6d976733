"""The sections of the page: which tables and charts each stage of a campaign shows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from experiments.calibrate.results import Campaign
from experiments.report import charts, stage_tables, surfaces
from experiments.report.joint_charts import joint_charts
from experiments.report.published import Published
from experiments.studies.buckwheat.replay.replay_tables import replay_tables
from experiments.report.response_tables import response_tables
from experiments.report.kit.table import Table
from experiments.report.kit.chart import Chart
from experiments.studies.buckwheat.replay.replay import Replay
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
    "replay": "The paper's runs, simulated again",
    "paper": "The paper's numbers",
    "provenance": "Settings and provenance",
}
"""Headings by section."""


@dataclass(frozen=True)
class Section:
    """One section of the page."""

    name: str
    """Its anchor, and the name of the template that fills it."""
    tables: dict[str, Table] = field(default_factory=dict)
    """Tables by the name that the template uses."""
    charts: list[Chart] = field(default_factory=list)
    """Charts in the order of the page."""

    @property
    def title(self) -> str:
        """Heading."""
        return TITLES[self.name]


@dataclass(frozen=True)
class Context:
    """What the sections draw on."""

    campaign: Campaign
    labels: Mapping[str, str]
    """What each factor is, in words."""
    published: Published | None
    """The paper's numbers, where the study is the paper's."""
    responses: tuple[Response, ...] = ()
    """What was to be matched beside the angle."""

    @property
    def truth(self) -> dict[str, float] | None:
        """Hidden factor values of a twin study."""
        return self.campaign.target.truth if self.campaign.target else None


def stage_sections(context: Context) -> list[Section]:
    """Build the sections of the factors, of every stage that was reached, and of several responses."""
    campaign = context.campaign
    factors = stage_tables.factors_table(campaign.factors, context.labels, context.truth)
    sections = [Section("factors", {"levels": factors})]
    for name in campaign.stages:
        sections.append(_STAGES[name](context))
        if name == "optimum":
            sections += _responses(context)
    return sections


def failed_section(campaign: Campaign) -> Section:
    """Build the section of the cases that gave no angle."""
    table = stage_tables.failed_table(campaign)
    return Section("failed", {"cases": table} if table else {})


def replay_sections(replay: Replay | None, campaign: Campaign) -> list[Section]:
    """Build the section on the paper's runs simulated again, where they were."""
    if replay is None:
        return []
    effects = campaign.screening.screen.table if campaign.screening else None
    return [Section("replay", replay_tables(replay, effects), [charts.replay_chart(replay)])]


def paper_sections(published: Published | None) -> list[Section]:
    """Build the section on the paper's own numbers, where the study is the paper's."""
    if published is None:
        return []
    return [Section("paper", {"misprints": stage_tables.misprints_table(published)})]


def _target(context: Context) -> Section:
    target = context.campaign.target
    if target is None or target.cases is None:
        return Section("target")
    caption = "The heaps whose mean is the target."
    return Section("target", {"heaps": stage_tables.heaps_table("target-heaps", target.cases, caption)})


def _noise_floor(context: Context) -> Section:
    result, target = context.campaign.noise_floor, context.campaign.target
    if result is None or target is None:
        return Section("noise_floor")
    table = stage_tables.heaps_table("noise-floor", result.cases, "Replicates at the middle.")
    return Section("noise_floor", {"heaps": table}, [charts.noise_floor_chart(result, target)])


def _screening(context: Context) -> Section:
    result, alpha = context.campaign.screening, context.campaign.settings.selection.alpha
    if result is None:
        return Section("screening")
    published = context.published.screening if context.published else None
    tables = {
        "design": stage_tables.screening_design_table(result),
        "effects": stage_tables.effects_table(result, context.labels, alpha, published),
        "anova": stage_tables.anova_table("screening-anova", result.screen.anova, "Analysis of variance."),
    }
    drawn = [charts.pareto_chart(result.screen, alpha), charts.half_normal_chart(result.screen, alpha)]
    return Section("screening", tables, drawn)


def _selection(context: Context) -> Section:
    result = context.campaign.selection
    return Section("selection", {"reasons": stage_tables.selection_table(result)} if result else {})


def _climb(context: Context) -> Section:
    result, target = context.campaign.climb, context.campaign.target
    if result is None or target is None:
        return Section("climb")
    tables = {"path": stage_tables.climb_table(result)}
    if context.published:
        tables["paper"] = stage_tables.paper_climb_table(context.published.climb)
    return Section("climb", tables, [charts.climb_chart(result, target)])


def _surface(context: Context) -> Section:
    campaign = context.campaign
    result, target = campaign.surface, campaign.target
    if result is None or target is None:
        return Section("surface")
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
    return Section(
        "surface", tables, [*surfaces.surface_charts(result, campaign.optimum, target), *residuals]
    )


def _optimum(context: Context) -> Section:
    campaign = context.campaign
    if campaign.optimum is None or campaign.surface is None:
        return Section("optimum")
    table = stage_tables.ranges_table(campaign.optimum, campaign.surface.design)
    return Section("optimum", {"ranges": table})


def _responses(context: Context) -> list[Section]:
    """Build the section of several responses; none where the angle is alone."""
    campaign = context.campaign
    surface, optimum, target = campaign.surface, campaign.optimum, campaign.target
    if surface is None or optimum is None or target is None or optimum.joint is None:
        return []
    drawn = joint_charts(surface, optimum, target)
    return [Section("responses", response_tables(campaign, context.responses), drawn)]


def _verification(context: Context) -> Section:
    result = context.campaign.verification
    if result is None:
        return Section("verification")
    table = stage_tables.heaps_table("verification-heaps", result.cases, "Fresh heaps at the chosen point.")
    tests = stage_tables.tests_table(result, context.published)
    return Section("verification", {"heaps": table, "tests": tests}, [charts.verification_chart(result)])


_STAGES: dict[str, Callable[[Context], Section]] = {
    "target": _target,
    "noise_floor": _noise_floor,
    "screening": _screening,
    "selection": _selection,
    "climb": _climb,
    "surface": _surface,
    "optimum": _optimum,
    "verification": _verification,
}
