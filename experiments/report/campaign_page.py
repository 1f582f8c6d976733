"""The page of a campaign: every stage's tables and charts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from experiments.calibrate.campaign import Campaign
from experiments.calibrate.results import Outcome
from experiments.report.cautions import cautions
from experiments.report.kit import html
from experiments.report.other_codes import other_codes_chapter
from experiments.report.paper_text import pastes
from experiments.report.pictures import HeapPicture
from experiments.report.plan_page import next_test_chapters
from experiments.report.sections import TITLES, Context, chapter, failed_chapter, stage_chapters
from experiments.report.solid import SolidHeap
from experiments.report.stage_tables import fixed_table, values_table
from experiments.report.study_companion import companion_of
from experiments.report.study_facts import study_facts
from experiments.report.verdict import HEADLINES, headline, verdict_sentence
from experiments.studyfile import Study


def render_page(
    campaign: Campaign,
    study: Study,
    pictures: Sequence[HeapPicture] = (),
    provenance: Mapping[str, Any] | None = None,
    solid: SolidHeap | None = None,
) -> str:
    """Render the report of a campaign as one self-contained HTML page.

    It shows pictures of heaps, a heap in three dimensions, and the nested values of the provenance.
    """
    labels = study.labels
    context = Context(campaign, labels)
    chapters = [chapter("heaps")] if pictures or solid else []
    chapters += stage_chapters(context)
    values = fixed = None
    if campaign.optimum is not None:
        values, case = (
            values_table(campaign, campaign.optimum, study),
            study.case(campaign.optimum.settings, 1),
        )
        fixed = fixed_table(study, campaign.optimum, case)
        chapters += [other_codes_chapter(case), chapter("paper_text")]
    chapters += [*next_test_chapters(campaign, study), failed_chapter(campaign)]
    chapters += [*companion_of(study).campaign_chapters(campaign), chapter("provenance")]
    drawn_on = {
        "campaign": campaign,
        "study": study,
        "headline": headline(campaign),
        "sentence": verdict_sentence(campaign),
        "cautions": cautions(campaign, study),
        "values": values,
        "fixed": fixed,
        "pastes": pastes(campaign, study, provenance or {}),
        "solid": solid,
        "calibrated": headline(campaign) == HEADLINES[Outcome.CALIBRATED],
        "unreached": [TITLES[name] for name in campaign.unreached],
        "leading": context.leading,
        "labels": labels,
        "facts": study_facts(study),
        "pictures": pictures,
        "provenance": html.flat(provenance or {}),
        "settings": html.flat(campaign.settings.model_dump()),
        "document": html.flat(study.document),
    }
    return html.render_page("calibration report", study.name, "sections/summary.html.j2", chapters, drawn_on)
