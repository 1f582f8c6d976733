"""Page of a run of the study: what the data pin down, what they foretell, and the heap."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from doe.plots.palette import BLUE, INK, VERMILION
from experiments.evidence.page_figures import new_axes, save_figure
from experiments.evidence.record_page import facts_list, markdown_table, wall_times_table, write_page
from experiments.evidence.studies.drum_commands import require_run
from experiments.evidence.studies.wheat_drums.drum_campaign import DRUMS, FACTS, HEAPS
from experiments.evidence.studies.wheat_drums.drum_fit import LEVEL, Slopes, WheatFit, fit_slopes
from experiments.evidence.studies.wheat_drums.drum_plan import PUBLISHED_HEAP, data, study_at
from experiments.report.kit.table import make_table
from experiments.studyfile import Study

PAGE, PICTURE = "README.md", "slopes.png"


def fit_of(folder: Path) -> tuple[Study, WheatFit, dict[str, Any]]:
    """Fit all data with the drums of a run; return its study and its facts, too."""
    require_run(folder, FACTS, DRUMS, HEAPS)
    facts = json.loads((folder / FACTS).read_text(encoding="utf-8"))
    study = study_at(facts["scale"])
    return study, fit_slopes(Slopes.of(study, pd.read_csv(folder / DRUMS)), data()), facts


def write_record(folder: Path) -> Path:
    """Write the page of a run and its picture, from the tables that the run left."""
    study, fit, facts = fit_of(folder)
    foretold = fit.foretold()
    left_out = [
        fit_slopes(fit.slopes, fit.data, name).foretold().set_index("test").loc[name] for name in fit.data
    ]
    alone = pd.DataFrame(left_out).rename_axis("test").reset_index()
    _draw(folder / PICTURE, foretold, alone)
    heaps = pd.read_csv(folder / HEAPS)
    return write_page(
        folder / PAGE,
        f"# {study.name}",
        "Written by `python -m experiments.evidence.studies.wheat_drums page` from `drums.csv` and "
        "`heaps.csv`.",
        study.note,
        "## What the five data pin down",
        f"Ranges hold {LEVEL:.0%} of the settings that all five are compatible with. A setting stays open "
        "where its range is more than half of what the design explored.",
        _table("settings", fit.ranges(study), "Settings of the grain, and the friction of each wall."),
        "## Does one set explain all of them?",
        f"At the best settings chi2 is {fit.chi2:.2f} for five data. Six settings can follow five numbers, "
        "so that this alone proves little: each datum is also foretold by the four others.",
        f"![Slopes, measured and foretold]({PICTURE})",
        _table("slopes", foretold, "Slopes [deg] by all five data."),
        _table("alone", _judged(alone), "Each slope [deg] by the four others alone."),
        "## The heap of a lifted tube",
        _heap_text(heaps),
        "## What made the numbers",
        facts_list(facts),
        wall_times_table(facts, "cases"),
    )


def _judged(alone: pd.DataFrame) -> pd.DataFrame:
    """Add if the measured slope lies in what is foretold, its own error allowed for."""
    reach = 1.645 * alone["error"]
    inside = (alone["measured"] >= alone["low"] - reach) & (alone["measured"] <= alone["high"] + reach)
    return alone.assign(agrees=np.where(inside, "yes", "no"))


def _heap_text(heaps: pd.DataFrame) -> str:
    angles = heaps["angle"].dropna()
    if len(angles) < 2:
        return f"{len(angles)} of {len(heaps)} heaps could be measured: nothing is foretold."
    low, high = np.quantile(angles, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    place = "inside" if low <= PUBLISHED_HEAP <= high else "outside"
    place = "inside" if low <= PUBLISHED_HEAP <= high else "outside"
    return (
        f"{len(angles)} of {len(heaps)} heaps of 30 g, each at other compatible settings, stand at "
        f"{angles.mean():.1f} deg on average, {LEVEL:.0%} of them between {low:.1f} and {high:.1f} deg. "
        f"Another laboratory measured {PUBLISHED_HEAP} deg on its own wheat, {place} that range. The "
        "materials of its tube and plate are not known here: each heap stands on one of the four in turn."
    )


def _table(name: str, frame: pd.DataFrame, caption: str) -> str:
    return markdown_table(make_table(name, frame.round(3), list(frame), caption))


def _draw(path: Path, foretold: pd.DataFrame, alone: pd.DataFrame) -> None:
    figure, axes = new_axes(6.4, 3.8, grid="y")
    x = np.arange(len(foretold))
    for shift, frame, color, label in (
        (0.15, foretold, BLUE, "by all five"),
        (0.3, alone, VERMILION, "by the four others"),
    ):
        axes.vlines(x + shift, frame["low"], frame["high"], color=color, linewidth=2.2, label=label)
    axes.errorbar(
        x, foretold["measured"], 1.645 * foretold["error"], fmt="o", color=INK, markersize=4, label="measured"
    )
    axes.set_xticks(x, foretold["test"])
    axes.set_ylabel("slope [deg]")
    axes.legend(frameon=False)
    save_figure(figure, path)
