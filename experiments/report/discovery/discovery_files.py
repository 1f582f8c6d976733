"""The files of a discovery: page, results as JSON, tables as CSV, the study with the mechanism added."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from doe.discrepancy import Discovery, Settings
from experiments.io.plain_data import jsonable
from experiments.report.discovery.discovery_page import render_discovery
from experiments.report.discovery.discovery_tables import frames
from experiments.report.discovery.discovery_verdict import headline, verdict_sentence
from experiments.report.discovery.study_file import write_study_files
from experiments.report.discovery.terms import Terms
from experiments.report.kit.html import Chapter
from experiments.report.pictures import HeapPicture
from experiments.report.solid import SolidHeap
from experiments.report.writer import PAGE, library_versions, write_files
from experiments.studyfile import Study


def write_discovery(
    found: Discovery,
    study: Study,
    terms: Terms,
    settings: Settings,
    folder: Path,
    pictures: Sequence[HeapPicture] = (),
    provenance: Mapping[str, Any] | None = None,
    further: Sequence[Chapter] = (),
    solid: SolidHeap | None = None,
) -> Path:
    """Write ``report.html``, ``results.json``, ``tables/*.csv`` and ``study-with-NAME.toml``.

    The provenance has the caller's facts about the run, nested; versions are added. Return the page.
    """
    made_by = {**(provenance or {}), "study": study.sha256, "versions": library_versions()}
    files = [path.name for path in write_study_files(found, study, terms, folder)]
    page = render_discovery(found, study, terms, settings, pictures, files, made_by, further, solid)
    results = results_of(found, terms) | {"settings": asdict(settings)}
    write_files(folder, study, page, results, made_by, frames(found))
    return folder / PAGE


def results_of(found: Discovery, terms: Terms) -> dict[str, Any]:
    """Everything that was found as JSON-able data, with the verdict in words."""
    words = {"headline": headline(found, terms), "sentence": verdict_sentence(found, terms)}
    sizes = [pair for one in found.candidates for pair in zip(one.mechanisms, one.sizes, strict=True)]
    ends = sorted({name for name, size in sizes if terms.at_maximum(name, size)})
    return {**words, "not_explored_beyond": {name: terms.mechanisms[name].maximum for name in ends}} | {
        "discovery": jsonable(found)
    }
