"""The page of a campaign: every stage's tables and charts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from experiments.calibrate.results import STAGES, Campaign, Outcome
from experiments.report.companion import Replay, companion_of
from experiments.report.kit import html
from experiments.report.other_codes import other_codes_chapter
from experiments.report.pictures import HeapPicture
from experiments.report.sections import TITLES, Context, chapter, failed_chapter, stage_chapters
from experiments.report.study_facts import study_facts
from experiments.studyfile import Study

OUTCOMES = {
    Outcome.CALIBRATED: "Calibrated",
    Outcome.NOT_TOLD_APART: "Not told apart",
    Outcome.MISSED: "Target missed",
    Outcome.NO_SIGNIFICANT_FACTOR: "No significant factor",
    Outcome.TARGET_NOT_REACHED: "Target not reached",
    Outcome.PLATEAU: "Plateau before the target",
    Outcome.NO_CONTOUR: "No setting gives the target",
    Outcome.TOO_MANY_FAILED_RUNS: "Too many failed runs",
}
"""Outcomes as headlines."""


def render_page(
    campaign: Campaign,
    study: Study,
    pictures: Sequence[HeapPicture] = (),
    provenance: Mapping[str, Any] | None = None,
    replay: Replay | None = None,
) -> str:
    """Render the report of a campaign as one self-contained HTML page.

    Parameters
    ----------
    campaign, study
        What was run.
    pictures
        Heaps to show.
    provenance
        What made the numbers: names and values, nested as they come.
    replay
        Published runs simulated again, to be shown beside.
    """
    companion = companion_of(study)
    labels = {section.name: section.label for section in study.factor_sections}
    context = Context(campaign, labels, companion.published())
    chapters = stage_chapters(context)
    if campaign.optimum is not None:
        chapters.append(other_codes_chapter(study, campaign.optimum))
    if pictures:
        chapters.append(chapter("heaps"))
    chapters.append(failed_chapter(campaign))
    chapters += replay.chapters(campaign) if replay else ()
    chapters += [*companion.campaign_chapters(campaign), chapter("provenance")]
    drawn_on = {
        "campaign": campaign,
        "study": study,
        "outcome": OUTCOMES[campaign.outcome],
        "calibrated": campaign.outcome is Outcome.CALIBRATED,
        "unreached": [TITLES[name] for name in STAGES if name not in campaign.stages],
        "published": context.published,
        "leading": context.leading,
        "labels": labels,
        "facts": study_facts(study),
        "pictures": pictures,
        "provenance": html.flat(provenance or {}),
        "settings": html.flat(campaign.settings.model_dump()),
        "document": html.flat(study.document),
    }
    return html.render_page("calibration report", study.name, "sections/summary.html.j2", chapters, drawn_on)
