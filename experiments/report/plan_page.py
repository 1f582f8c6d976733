"""The page of a plan of tests, and the chapter on the next test of a campaign's report."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from experiments.calibrate.campaign import Campaign
from experiments.calibrate.plan.choice import ASSUMED, TestPlan, make_plan
from experiments.calibrate.plan.knowledge import Size
from experiments.calibrate.plan.present import Present, fit_responses, known_here
from experiments.report.kit.html import Chapter, render_page
from experiments.report.kit.sentences import say
from experiments.report.kit.table import Column, Layout, columns, make_table
from experiments.studyfile import Study


def render_plan(plan: TestPlan, study: Study) -> str:
    """Render the page of a plan."""
    context = {"source": plan.sentence, "notes": plan.notes}
    return render_page("plan of tests", study.name, "statistics/summary.html.j2", [_chapter(plan)], context)


def next_test(campaign: Campaign, study: Study) -> TestPlan | None:
    """Choose among candidates by what a campaign has simulated; None without candidates or a point."""
    surface, target = campaign.surface, campaign.target
    if not study.candidate_sections or surface is None or target is None or campaign.optimum is None:
        return None
    matched = [replace(one, measured=target.responses[one.name]) for one in campaign.responses]
    finals = {(r.scene, r.observable): own.final for r in matched if (own := surface.responses.get(r.name))}
    present = Present.of(surface.design.factors, known_here(finals, matched, campaign.direct, surface.design))
    scenes = set() if campaign.fidelity else set(surface.cases["scene"])  # those of a cheaper scale differ
    read = (one.response for each in study.candidates for one in each.readings)
    new = [one for one in read if one.scene in scenes and (one.scene, one.observable) not in present.known]
    fits = fit_responses(surface.design, surface.cases, new, study.campaign.surface)
    sizes = {each.name: (Size(seconds=0.0),) for each in study.candidates}  # all are simulated already
    return make_plan(present, *fits, study.candidates, sizes, study.campaign.optimum)


def next_test_chapters(campaign: Campaign, study: Study) -> Iterable[Chapter]:
    """Yield the chapter on the next test of a campaign, if its study has candidates."""
    if plan := next_test(campaign, study):
        assumed = [note for note in plan.notes if note.startswith(ASSUMED)]
        doubts = [note for note in plan.notes if note not in assumed]
        yield _chapter(plan, " ".join([plan.sentence, *doubts]), " ".join(assumed))


def _chapter(plan: TestPlan, text: str = "", assumed: str = "") -> Chapter:
    shown: Layout = [
        "tests",
        *columns("count", minutes="laboratory minutes"),
        Column("seconds", "computer time", "free", "s"),
        *columns("percent", "%", **{f.name: f.name for f in plan.present.factors}, left="of the region left"),
        Column("open", "stays open"),
    ]
    caption = "95 % half widths over the values, which hold in 80 % of the cases."
    table = make_table("plan", plan.table, shown, caption, f"{say('note.plan')} {assumed}".strip())
    return Chapter("next_test", "Next test", {"plan": table}, text=text)
