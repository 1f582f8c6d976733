"""Companions of studies: published numbers, published runs to be simulated again, chapters of their own.

A study file names its companion, ``companion = "NAME"``: the file ``companion.py`` in the folder NAME of
``experiments/studies``, whose `COMPANION` is a `Companion`. It is loaded when a command or a report asks for
it, so that neither knows any study.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import pandas as pd

from dem_warp import CaseResult
from experiments.calibrate.results import Campaign
from experiments.io.errors import StudyError
from experiments.io.texts import nearest_name
from experiments.report.kit.html import Chapter
from experiments.report.published import Published
from experiments.studyfile import Study

if TYPE_CHECKING:
    from doe.discrepancy import Discovery
    from experiments.report.discovery.terms import Terms

STUDIES = Path(__file__).parents[1] / "studies"


class Replay(Protocol):
    """Published runs, simulated again and analysed."""

    @property
    def cases(self) -> pd.DataFrame:
        """The simulated cases, a row each."""

    def tables(self) -> dict[str, pd.DataFrame]:
        """Tables for CSV files, by name."""

    def chapters(self, campaign: Campaign) -> Sequence[Chapter]:
        """Chapters of a report, beside a campaign of our own."""

    def write_record(
        self,
        folder: Path,
        study: Study,
        load: Callable[[str], CaseResult],
        provenance: Mapping[str, Any],
        campaign: Campaign | None,
    ) -> Path:
        """Write the page on the runs into a folder, a campaign of our own beside; return the page.

        `load` finds the result of a case by its ``case_key``, as ``Store.load`` does.
        """


class Companion:
    """Knowledge that a study brings beside its file: none, as far as a subclass does not override it."""

    def published(self) -> Published | None:
        """Numbers published for the study, to be set beside a campaign's; None where there are none."""
        return None

    def planned_runs(self, replicates: int) -> dict[str, pd.DataFrame]:
        """Lay out the published runs, each so many times: by the title of a batch, a row a case."""
        return {}

    def replay(self, cases: pd.DataFrame) -> Replay | None:
        """Analyse the simulated cases of `planned_runs`; None where there are none."""
        return None

    def campaign_chapters(self, campaign: Campaign) -> Sequence[Chapter]:
        """Chapters that close the report of a campaign."""
        return ()

    def discovery_chapters(self, found: Discovery, terms: Terms, data: Path) -> Sequence[Chapter]:
        """Chapters that close the report of a search for a missing effect in the data of a file."""
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
