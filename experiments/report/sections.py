"""The sections of the page: which tables and charts each stage of a campaign shows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from experiments.calibrate.results import Campaign
from experiments.report import charts, stage_tables, surfaces
from experiments.report.joint_charts import joint_charts
from experiments.report.published import Published
from experiments.report.replay_tables import replay_tables
from experiments.report.response_tables import goals_table, response_tables
from experiments.report.tables import Table
from experiments.report.theme import Chart
from experiments.studies.buckwheat.replay import Replay
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

    @property
    def leading(self) -> Response:
        """The response that leads the campaign."""
        return self.campaign.responses[0]

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
    """Build the section of the cases that failed or lack a response."""
    table = stage_tables.failed_table(campaign)
    return Section("failed", {"cases": table} if table else {})


def replay_sections(replay: Replay | None, campaign: Campaign) -> list[Section]:
    """Build the section on the paper's runs simulated again, where they were."""
    if replay is None:
        return []
    effects = campaign.screening.leading.screen.table if campaign.screening else None
    return [Section("replay", replay_tables(replay, effects), [charts.replay_chart(replay)])]


def paper_sections(published: Published | None) -> list[Section]:
    """Build the section on the paper's own numbers, where the study is the paper's."""
    if published is None:
        return []
    return [Section("paper", {"misprints": stage_tables.misprints_table(published)})]


def _target(context: Context) -> Section:
    campaign = context.campaign
    tables = {"responses": goals_table(campaign)}
    if campaign.target is not None and campaign.target.cases is not None:
        caption = "The cases whose means are the target."
        cases = campaign.target.cases
        tables["cases"] = stage_tables.cases_table("target-cases", cases, campaign.responses, caption)
    return Section("target", tables)


def _noise_floor(context: Context) -> Section:
    campaign = context.campaign
    result, target = campaign.noise_floor, campaign.target
    if result is None or target is None:
        return Section("noise_floor")
    caption = "Replicates at the middle."
    table = stage_tables.cases_table("noise-floor", result.cases, campaign.responses, caption)
    chart = charts.noise_floor_chart(result, target, context.leading)
    return Section("noise_floor", {"cases": table}, [chart])


def _screening(context: Context) -> Section:
    result, alpha = context.campaign.screening, context.campaign.settings.selection.alpha
    if result is None:
        return Section("screening")
    published = context.published.screening if context.published else None
    screen, response = result.leading.screen, context.leading
    tables = {
        "design": stage_tables.screening_design_table(result, context.campaign.responses),
        "effects": stage_tables.effects_table(screen, response, context.labels, alpha, published),
        "anova": stage_tables.anova_table("screening-anova", screen.anova, "Analysis of variance."),
    }
    drawn = [
        charts.pareto_chart(screen, alpha, response),
        charts.half_normal_chart(screen, alpha, response),
    ]
    return Section("screening", tables, drawn)


def _selection(context: Context) -> Section:
    result = context.campaign.selection
    tables = {"reasons": stage_tables.selection_table(result, context.leading)} if result else {}
    return Section("selection", tables)


def _climb(context: Context) -> Section:
    result, target = context.campaign.climb, context.campaign.target
    if result is None or target is None:
        return Section("climb")
    tables = {"path": stage_tables.climb_table(result, context.leading)}
    if context.published:
        tables["paper"] = stage_tables.paper_climb_table(context.published.climb)
    return Section("climb", tables, [charts.climb_chart(result, target, context.leading)])


def _surface(context: Context) -> Section:
    campaign, response = context.campaign, context.leading
    result, target = campaign.surface, campaign.target
    if result is None or target is None:
        return Section("surface")
    published, fit = context.published, result.leading
    same = published is not None and set(published.kept) == set(result.design.names)
    names = tuple(result.design.names)
    paper = {
        model: published.anova(model, names) if published and same else None for model in ("full", "reduced")
    }
    tables = {
        "design": stage_tables.surface_design_table(result, campaign.responses),
        "full": stage_tables.anova_table(
            "anova-full", fit.full.anova, "Full quadratic model.", paper["full"]
        ),
        "reduced": stage_tables.anova_table(
            "anova-reduced", fit.reduced.anova, "Reduced model.", paper["reduced"]
        ),
        "quality": stage_tables.quality_table(fit, published.quality if published and same else None),
        "coefficients": stage_tables.coefficients_table(fit.reduced, response),
    }
    outside = stage_tables.outside_table(result)
    if outside:
        tables["outside"] = outside
    drawn = surfaces.surface_charts(result, campaign.optimum, target, response)
    return Section("surface", tables, [*drawn, *surfaces.residual_charts(fit.reduced, response)])


def _optimum(context: Context) -> Section:
    campaign = context.campaign
    if campaign.optimum is None or campaign.surface is None:
        return Section("optimum")
    table = stage_tables.ranges_table(campaign.optimum, campaign.surface.design)
    return Section("optimum", {"ranges": table})


def _responses(context: Context) -> list[Section]:
    """Build the section of several responses; none where there is one."""
    campaign = context.campaign
    surface, optimum, target = campaign.surface, campaign.optimum, campaign.target
    if surface is None or optimum is None or target is None or optimum.joint is None:
        return []
    tables = response_tables(campaign)
    del tables["responses"]  # it stands with the target
    return [Section("responses", tables, joint_charts(surface, optimum, target, campaign.responses))]


def _verification(context: Context) -> Section:
    campaign = context.campaign
    result, responses = campaign.verification, campaign.responses
    if result is None:
        return Section("verification")
    caption = "Fresh cases at the chosen point."
    table = stage_tables.cases_table("verification-cases", result.cases, responses, caption)
    tests = stage_tables.tests_table(result, responses, context.published)
    chart = charts.verification_chart(result, context.leading)
    return Section("verification", {"cases": table, "tests": tests}, [chart])


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
