"""The files of a discovery: page, results as JSON, tables as CSV, the study with the mechanism added."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from doe.discrepancy import Discovery, Settings
from experiments.calibrate.export import jsonable
from experiments.files import write_text
from experiments.report.discovery.discovery_page import render_discovery
from experiments.report.discovery.study_file import write_study_files
from experiments.report.discovery.tables import frames
from experiments.report.discovery.terms import Terms
from experiments.report.discovery.verdict import headline, verdict_sentence
from experiments.report.kit.html import Chapter
from experiments.report.pictures import HeapPicture
from experiments.report.writer import library_versions
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
) -> Path:
    """Write ``report.html``, ``results.json``, ``tables/*.csv`` and ``study-with-NAME.toml``.

    Parameters
    ----------
    found
        What the analysis found.
    study
        The study that was analysed.
    terms
        What the names mean.
    settings
        The rules of the analysis.
    folder
        Folder of the files; it is made when it is missing.
    pictures
        Heaps to show side by side.
    provenance
        What the caller knows of the run (device, seconds, ...), nested as it comes; versions are added.
    further
        Chapters that the study's companion adds.

    Returns
    -------
    Path
        The page.
    """
    made_by = {**(provenance or {}), "versions": library_versions()}
    results = {
        "study": {
            "name": study.name,
            "file": study.file.name,
            "scale": study.scale,
            "document": study.document,
        },
        **results_of(found, terms),
        "settings": asdict(settings),
        "provenance": jsonable(made_by),
    }
    text = json.dumps(results, indent=1, allow_nan=False, ensure_ascii=False) + "\n"
    files = [path.name for path in write_study_files(found, study, terms, folder)]
    page = render_discovery(found, study, terms, settings, pictures, files, made_by, further)
    for name, table in frames(found).items():
        write_text(folder / "tables" / f"{name}.csv", table.to_csv(index=False))
    write_text(folder / "results.json", text)
    write_text(folder / "report.html", page)
    return folder / "report.html"


def results_of(found: Discovery, terms: Terms) -> dict[str, Any]:
    """Everything that was found as JSON-able data, with the verdict in words."""
    words = {"headline": headline(found, terms), "sentence": verdict_sentence(found, terms)}
    return {**words, "discovery": jsonable(found)}
