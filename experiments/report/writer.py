"""The report's files: one page, the results as JSON, the tables as CSV."""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from dem_warp import __version__
from experiments.calibrate.export import jsonable
from experiments.calibrate.results import Campaign
from experiments.files import write_text
from experiments.report.campaign_page import render_page
from experiments.report.companion import Replay
from experiments.report.material_card import write_material_card
from experiments.report.pictures import HeapPicture
from experiments.studyfile import Study

LIBRARIES = ("warp-lang", "numpy", "scipy", "pandas", "statsmodels", "scikit-learn", "opencv-python-headless")
"""Packages whose version may change a number."""


def write_report(
    campaign: Campaign,
    study: Study,
    out_dir: str | Path,
    pictures: Sequence[HeapPicture] = (),
    provenance: Mapping[str, Any] | None = None,
    replay: Replay | None = None,
) -> Path:
    """Write ``report.html``, ``results.json``, ``tables/*.csv``, ``material.toml``, each whole or not at all.

    Parameters
    ----------
    campaign, study
        What was run.
    out_dir
        Folder of the files; it is made when it is missing.
    pictures
        Heaps to show, from `heap_pictures`.
    provenance
        What the caller knows of the run (device, seconds, ...), nested as it comes; versions are added.
    replay
        Published runs simulated again, to be shown beside.

    Returns
    -------
    Path
        The page.
    """
    folder = Path(out_dir)
    made_by = {**(provenance or {}), "versions": library_versions()}
    page = render_page(campaign, study, pictures, made_by, replay)
    frames = campaign.tables() | (replay.tables() if replay else {})
    tables = {name: table.to_csv(index=False) for name, table in frames.items()}
    results = {
        "study": {
            "name": study.name,
            "file": study.file.name,
            "scale": study.scale,
            "document": study.document,
        },
        "campaign": campaign.to_dict(),
        "provenance": jsonable(made_by),
    }
    text = json.dumps(results, indent=1, allow_nan=False, ensure_ascii=False) + "\n"
    for name, table in tables.items():
        write_text(folder / "tables" / f"{name}.csv", table)
    write_text(folder / "results.json", text)
    write_text(folder / "report.html", page)
    write_material_card(campaign, study, folder)
    return folder / "report.html"


def library_versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that the numbers depend on."""
    own = {"dem-warp": __version__, "python": platform.python_version()}
    return own | {name: version(name) for name in LIBRARIES}
