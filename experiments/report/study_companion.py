"""Companions of studies: chapters that a study adds to its reports.

A study file names its companion, ``companion = "NAME"``: the file ``companion.py`` in the folder NAME of
``experiments/studies``, whose `COMPANION` is a `Companion`. It is loaded when a report asks for it, so that
no report knows a study.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from experiments.calibrate.campaign import Campaign
from experiments.io.errors import StudyError
from experiments.io.texts import nearest_name
from experiments.report.kit.html import Chapter
from experiments.studyfile import Study

if TYPE_CHECKING:
    from doe.discrepancy import Discovery
    from experiments.report.discovery.terms import Terms

STUDIES = Path(__file__).parents[1] / "studies"


class Companion:
    """Knowledge that a study brings besides its file; subclasses override what they have."""

    def campaign_chapters(self, campaign: Campaign) -> Sequence[Chapter]:
        """Return the chapters that close the report of a campaign."""
        return ()

    def discovery_chapters(self, found: Discovery, terms: Terms, data: Path) -> Sequence[Chapter]:
        """Return the chapters that close the report of a search in the data of a file."""
        return ()


def companion_of(study: Study) -> Companion:
    """Load the companion that a study names.

    Raises
    ------
    StudyError
        When there is no such companion.
    """
    if not study.companion:
        return Companion()
    known = sorted(path.parent.name for path in STUDIES.glob("*/companion.py"))
    if study.companion not in known:
        rule = f"companion: must be a study that has one, {nearest_name(study.companion, known)}"
        raise StudyError(str(study.file), rule, study.companion)
    companion: Companion = import_module(f"experiments.studies.{study.companion}.companion").COMPANION
    return companion
