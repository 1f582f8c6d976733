"""Page of a run of the study: what the data pin down, step by step, and what they predict of one another."""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from doe.plots.palette import BLUE, INK, VERMILION
from experiments.evidence.page_figures import new_axes, save_figure
from experiments.evidence.record_page import facts_list, markdown_table, wall_times_table, write_page
from experiments.evidence.studies.batch import CASES, FACTS, measured_cases
from experiments.evidence.studies.drum_commands import require_run
from experiments.evidence.studies.wheat.wheat_fit import LEVEL, OPEN, Bench, WheatFit, fit_tests
from experiments.evidence.studies.wheat.wheat_plan import (
    DENSITY,
    HEAP,
    RESPONSES,
    SHELLS,
    data,
    planned_cases,
    study_at,
)
from experiments.report.kit.table import make_table
from experiments.studyfile import Study

PAGE, PICTURE = "README.md", "data.png"

KEPT = ("status", "reason", "grain_count", *dict.fromkeys(RESPONSES.values()))
"""Columns that are kept of what a case gives."""


def write_record(folder: Path) -> Path:
    """Write the page of a run and its picture."""
    require_run(folder, FACTS)
    facts = json.loads((folder / FACTS).read_text(encoding="utf-8"))
    study, measured = study_at(facts["scale"]), data()
    table = measured_cases(study, planned_cases(study, facts["scale"]), folder, KEPT)
    tests, drums = Bench.of(study, table), {*measured} - {HEAP, DENSITY}
    fits = {
        "drums": fit_tests(tests, measured, drums),
        "drums, heap": fit_tests(tests, measured, drums | {HEAP}),
        "heap, density, level": fit_tests(tests, measured, {*measured} - {*SHELLS}),
        "all": fit_tests(tests, measured, {*measured}),
    }
    alone = {name: fit_tests(tests, measured, {*measured} - {name}) for name in measured}
    fits["all but soil"] = alone["soil"]
    others = pd.concat([fit.predictions().loc[[name]] for name, fit in alone.items()])
    _draw(folder / PICTURE, fits["drums"].predictions(), others)
    failed = table[table[list(dict.fromkeys(RESPONSES.values()))].isna().all(axis=1)]
    return write_page(
        folder / PAGE,
        f"# {study.name}",
        f"Written by `python -m experiments.evidence.studies.wheat page` from `{CASES}`.",
        study.note,
        f"{len(table) - len(failed)} of {len(table)} cases gave a value.",
        "## How narrow the settings get",
        f"Ranges hold {LEVEL:.0%} of the settings that the data are compatible with; after each, its part of "
        f"what the design explored. A setting stays open where that is more than {OPEN:g}.",
        _table("settings", _narrowing(study, fits), "Settings of the grain, and the friction of each wall."),
        "## What some data predict of the others",
        f"Ranges hold {LEVEL:.0%} of what is predicted; no error of the model itself is in them.",
        _table(
            "drums", fits["drums"].predictions().drop(index=[*drums]), "Heap and density by the drums alone."
        ),
        _table(
            "inclined",
            fits["heap, density, level"].predictions().loc[[*SHELLS]],
            "The inclined drums by the three others; their shells may have any friction.",
        ),
        _table("others", others, "Each datum by the six others."),
        f"![Data, measured and predicted]({PICTURE})",
        "## Does one set explain all of them?",
        f"At the best settings chi2 is {fits['all'].chi2:.1f} for seven data, and "
        f"{alone['soil'].chi2:.1f} for the six without the drum of soil.",
        _table("all", fits["all"].predictions(), "Each datum by all seven."),
        "## What made the numbers",
        facts_list(facts),
        wall_times_table(facts, "cases"),
    )


def _narrowing(study: Study, fits: Mapping[str, WheatFit]) -> pd.DataFrame:
    """Lay out the ranges of each fit, and count the settings that stay open."""
    columns = {}
    for name, fit in fits.items():
        ranges = fit.ranges(study)
        texts = [f"{row.low:.2f} to {row.high:.2f} ({row.part:.2f})" for row in ranges.itertuples()]
        columns[name] = [*texts, str(int((ranges["part"] > OPEN).sum()))]
    rows = [*fits["all"].ranges(study).index, "open"]
    best = [*(f"{value:.2f}" for value in fits["all"].ranges(study)["best"]), ""]
    return pd.DataFrame({"setting": rows, **columns, "best of all": best}).set_index("setting")


def _table(name: str, frame: pd.DataFrame, caption: str) -> str:
    rows = frame.round(1).reset_index()
    return markdown_table(make_table(name, rows, list(rows), caption))


def _draw(path: Path, by_drums: pd.DataFrame, by_others: pd.DataFrame) -> None:
    figure, axes = new_axes(6.4, 3.8, grid="y")
    angles = by_others.drop(index=DENSITY)
    x = np.arange(len(angles))
    for shift, frame, color, label in (
        (0.15, by_drums.loc[angles.index], BLUE, "by the drums"),
        (0.3, angles, VERMILION, "by the six others"),
    ):
        axes.vlines(x + shift, frame["low"], frame["high"], color=color, linewidth=2.2, label=label)
    axes.errorbar(
        x, angles["measured"], 1.645 * angles["error"], fmt="o", color=INK, markersize=4, label="measured"
    )
    axes.set_xticks(x, angles.index)
    axes.set_ylabel("angle [deg]")
    axes.legend(frameon=False)
    save_figure(figure, path)
