"""The report's files: one page, the results as JSON, the tables as CSV."""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pandas as pd

from experiments.calibrate.campaign import Campaign
from experiments.calibrate.plan.choice import TestPlan
from experiments.io.files import write_text
from experiments.io.plain_data import jsonable
from experiments.io.plug_ins import plug_in_versions
from experiments.io.program_version import program_version
from experiments.io.texts import safe_cell
from experiments.report.campaign_page import render_page
from experiments.report.material_card import write_material_card
from experiments.report.pictures import HeapPicture
from experiments.report.plan_page import render_plan
from experiments.report.solid import SolidHeap
from experiments.studyfile import Study

LIBRARIES = ("warp-lang", "numpy", "scipy", "pandas", "statsmodels", "opencv-python-headless")
"""Packages whose version may change a number."""

PAGE = "report.html"


def write_report(
    campaign: Campaign,
    study: Study,
    out_dir: str | Path,
    pictures: Sequence[HeapPicture] = (),
    provenance: Mapping[str, Any] | None = None,
    solid: SolidHeap | None = None,
) -> Path:
    """Write ``report.html``, ``results.json``, ``tables/*.csv``, ``material.toml``, each whole or not at all.

    The provenance has the caller's facts about the run, nested; versions are added. Return the page.
    """
    folder = Path(out_dir)
    made_by = {**(provenance or {}), "study": study.sha256, "versions": library_versions()}
    page = render_page(campaign, study, pictures, made_by, solid)
    write_files(folder, study, page, {"campaign": campaign.to_dict()}, made_by, campaign.tables())
    write_material_card(campaign, study, folder)
    return folder / PAGE


def write_plan(plan: TestPlan, study: Study, folder: Path, provenance: Mapping[str, Any]) -> None:
    """Write ``report.html``, ``results.json`` and ``tables/*.csv`` of a plan of tests."""
    made_by = {**provenance, "study": study.sha256, "versions": library_versions()}
    write_files(
        folder,
        study,
        render_plan(plan, study),
        {"plan": plan.to_dict()},
        made_by,
        {"plan": plan.table.reset_index()},
    )


def write_files(
    folder: Path,
    study: Study,
    page: str,
    results: Mapping[str, Any],
    made_by: Mapping[str, Any],
    tables: Mapping[str, pd.DataFrame],
) -> None:
    """Write a page, its results with the study and the provenance, and its tables."""
    about = {
        "name": study.name,
        "file": study.file.name,
        "scale": study.scale,
        "sha256": study.sha256,
        "document": study.document,
    }
    whole = {"study": about, **results, "provenance": jsonable(made_by)}
    text = json.dumps(whole, indent=1, allow_nan=False, ensure_ascii=False) + "\n"
    for name, table in tables.items():
        texts = table.select_dtypes(exclude="number")
        safe = table.assign(**{each: texts[each].map(safe_cell) for each in texts})
        write_text(folder / "tables" / f"{name}.csv", safe.to_csv(index=False))
    write_text(folder / "results.json", text)
    write_text(folder / PAGE, page)


def library_versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that the numbers depend on, plug-ins too."""
    own = {"dem-warp": program_version(), "python": platform.python_version()}
    return own | {name: version(name) for name in LIBRARIES} | plug_in_versions()
