"""Charts of a run as its cases come, made as those of the report."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from doe.plots.palette import BLUE, SERIES, VERMILION
from experiments.calibrate.results import STAGES
from experiments.io.errors import InputError
from experiments.live.journal_notes import ResponseNote, SampleNote
from experiments.live.run_files import inside
from experiments.live.run_state import RunState
from experiments.report.kit.chart import Chart, add_bars, add_line, add_points, add_target, new_figure
from experiments.studyfile.observables import ANGLE, OBSERVABLES

MOST_FACTORS = 4
"""Factors whose values the response is drawn over."""

LAST_OUTCOMES = 5_000
"""Outcomes of a search that are drawn, the last ones."""


def charts_of(state: RunState) -> list[Chart]:
    """Draw the results so far; a chart without data is left out."""
    leading = _Leading.of(state)
    drawn = [
        _course(leading),
        _climb(leading),
        _effects(state),
        *_over_factors(state, leading),
        _outcomes(state.folder),
    ]
    return [chart for chart in drawn if chart is not None]


@dataclass(frozen=True)
class _Leading:
    """The leading response: its column, axis title, target, and the cases that have it."""

    observable: str
    title: str
    target: SampleNote | None
    rows: list[dict[str, Any]]

    @classmethod
    def of(cls, state: RunState) -> _Leading:
        noted = state.run.responses
        first = noted[0] if noted else ResponseNote(name="angle", observable=ANGLE, unit="deg")
        settled = [sample for stage in state.stages for sample in stage.responses.values()]
        title = f"{first.name}{'' if first.unit == '1' else f' [{first.unit}]'}".replace("_", " ")
        rows = [case for case in state.cases.values() if _is_number(case.get(first.observable))]
        return cls(first.observable, title, next(iter(settled), first.measured), rows)

    def figure(self, x: str, legend: bool = True) -> Any:
        """Return an empty figure of the response with its target."""
        figure = new_figure(x, self.title, legend=legend)
        if self.target:
            add_target(figure, self.target.mean, self.target.sd)
        return figure


def _course(leading: _Leading) -> Chart | None:
    """Draw the response of every case in the order in which they ended."""
    if not leading.rows:
        return None
    figure = leading.figure("case, in the order of their ends")
    numbered = list(enumerate(leading.rows, start=1))
    for stage in [*STAGES, None]:
        some = [(number, row) for number, row in numbered if row.get("stage") == stage]
        if some:
            name = str(stage or "case").replace("_", " ")
            color = SERIES[STAGES.index(stage) % len(SERIES)] if stage else BLUE
            x, y = [number for number, _ in some], [row[leading.observable] for _, row in some]
            add_points(figure, x, y, name, color)
    band = "; the green band is the target ± 1 sd" if leading.target else ""
    return Chart("course", f"Every case that has ended{band}.", figure)


def _climb(leading: _Leading) -> Chart | None:
    """Draw the response along the climb."""
    steps: dict[int, list[float]] = {}
    for row in leading.rows:
        if row.get("stage") == "climb" and isinstance(row.get("run"), int):
            steps.setdefault(row["run"], []).append(row[leading.observable])
    if not steps:
        return None
    figure = leading.figure("step of the climb")
    ordered = sorted(steps)
    each = [step for step in ordered for _ in steps[step]]
    values = [value for step in ordered for value in steps[step]]
    add_points(figure, each, values, "case", BLUE, size=7, opacity=0.6)
    means = [float(np.mean(steps[step])) for step in ordered]
    add_line(figure, ordered, means, "mean of the step", VERMILION)
    figure.update_xaxes(dtick=1)
    return Chart("climb", "The climb towards the target, step by step.", figure)


def _effects(state: RunState) -> Chart | None:
    """Draw the effects of the factors, once the screening has ended."""
    screening = next((stage for stage in state.stages if stage.name == "screening"), None)
    table = screening.tables.get("screening_effects") if screening else None
    if table is None:
        return None
    found = [dict(zip(table.columns, row, strict=False)) for row in table.data]
    leading = [row for row in found if row.get("response") == found[0].get("response")]
    bars = [(str(row.get("factor")), row["effect"]) for row in leading if _is_number(row.get("effect"))]
    if not bars:
        return None
    names, effects = zip(*bars, strict=True)
    figure = new_figure("factor", "effect, low to high", legend=False)
    add_bars(figure, list(names), list(effects), "effect", BLUE, "%{x}: %{y:.3g}")
    return Chart("effects", "Change of the response from the low to the high end of each factor.", figure)


def _over_factors(state: RunState, leading: _Leading) -> list[Chart]:
    """Draw the response over each factor that varies."""
    charts: list[Chart] = []
    for name, unit in ((factor.name, factor.unit) for factor in state.run.factors):
        some = [row for row in leading.rows if _is_number(row.get(name))]
        if len({row[name] for row in some}) < 2 or len(charts) == MOST_FACTORS:
            continue
        figure = leading.figure(name if unit in ("1", "") else f"{name} [{unit}]", legend=False)
        x, y = [row[name] for row in some], [row[leading.observable] for row in some]
        add_points(figure, x, y, "case", BLUE, size=7)
        charts.append(Chart(f"over-{name}", f"Every case over {name}.", figure, "low"))
    return charts


def _outcomes(folder: Path) -> Chart | None:
    """Draw how the first observable of a search's outcomes spreads."""
    values = search_values(folder)
    if not len(values):
        return None
    first = OBSERVABLES[0]
    figure = new_figure(f"{first.title} [{first.unit}]", "simulated heaps", legend=False)
    figure.add_histogram(x=values, nbinsx=40, marker={"color": BLUE}, name="heaps")
    return Chart("outcomes", f"The last {len(values)} heaps of the search, by their {first.title}.", figure)


def search_values(folder: Path) -> np.ndarray:
    """Return the first observable of the last outcomes of a search; empty if there are none."""
    try:
        path = inside(folder, "outcomes.sqlite")
        with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True, timeout=1.0)) as file:
            query = "SELECT numbers FROM outcome ORDER BY rowid DESC LIMIT ?"
            rows = [blob for (blob,) in file.execute(query, (LAST_OUTCOMES,)) if isinstance(blob, bytes)]
    except (InputError, sqlite3.Error):
        return np.zeros(0)
    first = [np.frombuffer(blob[:8], "<f8")[0] for blob in rows if len(blob) >= 8]
    return np.array([value for value in first if np.isfinite(value)])


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and bool(np.isfinite(value))
