"""Page of the verification: tables, plots with their data, and one Markdown text to be read in one go."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.ticker import NullLocator

from doe.plots.palette import SERIES
from experiments.evidence.page_figures import new_axes, save_figure
from experiments.evidence.record_page import markdown_table, write_page
from experiments.evidence.verification.check import Plot, Result, Row
from experiments.io.files import write_text

VERDICTS = {True: "pass", False: "**FAIL**", None: "stated"}

COLUMNS = (
    "chapter", "problem", "case", "quantity", "reference", "expected", "simulated", "error", "relative",
    "tolerance", "verdict",
)  # fmt: skip
"""Columns of the table of rows."""

STYLES = {"points": "o", "dashed": "--", "line": "-"}
"""Formats of curves."""

INTRODUCTION = """# Verification

Written by `python -m experiments.evidence.verification`; the same rows are in `rows.csv`, and the data of
every plot is in a file of its name. Every chapter says what it ran on. An error is relative (in %) or in the
unit of the quantity. A row passes when its error is within its tolerance; a row that is only *stated* has
none.
"Production precision" has poses in float64 and forces in float32.
"""


@dataclass(frozen=True)
class StoredResult:
    """A problem's result as its folder keeps it, its plots drawn already."""

    title: str
    text: str
    machine: str
    """Machine that it ran on, in words."""
    rows: tuple[Row, ...]
    pictures: tuple[tuple[str, str], ...]
    """Stem of each picture's files, and its title."""

    @classmethod
    def read(cls, path: Path) -> "StoredResult":
        """Read what `write_result` wrote."""
        values = json.loads(path.read_text(encoding="utf-8"))
        rows = tuple(Row(**row) for row in values.pop("rows"))
        pictures = tuple((stem, title) for stem, title in values.pop("pictures"))
        return cls(rows=rows, pictures=pictures, **values)


def write_result(name: str, result: Result, machine: str, folder: Path) -> None:
    """Write rows, plots and their data of one problem into a folder, for `write_verification`.

    The folder is made if missing; files of the same names are written over.
    """
    for plot in result.plots:
        _draw(plot, folder / f"{plot.name}.png")
        curves = [pd.DataFrame({"curve": one.label, plot.x: one.x, plot.y: one.y}) for one in plot.curves]
        data = pd.concat(curves).to_csv(index=False, float_format="%.7g")
        write_text(folder / f"{plot.name}.csv", data)
    pictures = tuple((plot.name, plot.title) for plot in result.plots)
    stored = StoredResult(result.title, result.text, machine, result.rows, pictures)
    write_text(folder / f"{name}.json", json.dumps(asdict(stored), indent=1) + "\n")


def write_verification(folder: Path, names: Iterable[str]) -> Path:
    """Write the page and the table of rows from the results that `write_result` left, and return the page.

    Problems stand in the order of their names; one without a result is left out.
    """
    files = [folder / f"{name}.json" for name in names]
    results = [StoredResult.read(file) for file in files if file.exists()]
    rows = [row for result in results for row in result.rows]
    table = [
        {"chapter": result.title, **asdict(row), "verdict": VERDICTS[row.passed].strip("*").lower()}
        for result in results
        for row in result.rows
    ]
    write_text(folder / "rows.csv", pd.DataFrame(table, columns=COLUMNS).to_csv(index=False))
    parts = [INTRODUCTION, f"**{summary(rows)}.**", _contents(results)]
    for result in results:
        pictures = "\n".join(f"![{title}]({stem}.png)" for stem, title in result.pictures)
        parts += [f"## {result.title}", result.text, f"*{result.machine}*", pictures, *_tables(result.rows)]
    return write_page(folder / "README.md", *parts)


def summary(rows: Iterable[Row]) -> str:
    """Line that says how many rows passed, failed and were stated."""
    passed, failed, stated = _counts(rows)
    return f"{passed} rows pass, {failed} fail, {stated} are stated without a tolerance"


def _counts(rows: Iterable[Row]) -> tuple[int, int, int]:
    verdicts = [row.passed for row in rows]
    return verdicts.count(True), verdicts.count(False), verdicts.count(None)


def _contents(results: Sequence[StoredResult]) -> str:
    rows = []
    for result in results:
        counts = dict(zip(("pass", "fail", "stated"), _counts(result.rows), strict=True))
        anchor = result.title.lower().replace(" ", "-")
        rows.append({"chapter": f"[{result.title}](#{anchor})", **counts, "ran on": result.machine})
    return markdown_table(pd.DataFrame(rows))


def _tables(rows: Sequence[Row]) -> Iterable[str]:
    """Yield heading and table of each problem, in the order in which they first come."""
    for problem in dict.fromkeys(row.problem for row in rows):
        table = pd.DataFrame([_texts(row) for row in rows if row.problem == problem])
        yield from (f"**{problem}**", markdown_table(table))


def _texts(row: Row) -> dict[str, str]:
    return {
        "case": row.case,
        "quantity": row.quantity,
        "reference": row.reference,
        "expected": f"{row.expected:.6g}",
        "simulated": f"{row.simulated:.6g}",
        "error": _error(row.error, row.relative),
        "tolerance": "" if row.tolerance is None else _error(row.tolerance, row.relative),
        "verdict": VERDICTS[row.passed],
    }


def _error(value: float, relative: bool) -> str:
    return f"{100.0 * value:.2g} %" if relative else f"{value:.2g}"


def _draw(plot: Plot, path: Path) -> None:
    figure, axes = new_axes()
    for k, curve in enumerate(plot.curves):
        colour = SERIES[(k if curve.colour is None else curve.colour) % len(SERIES)]
        (line,) = axes.plot(np.asarray(curve.x), np.asarray(curve.y), STYLES[curve.style], label=curve.label)
        line.set(color=colour, markersize=4, linewidth=1.5)
    if plot.logarithmic:
        axes.set(xscale="log", yscale="log")
        ticks = np.unique(np.concatenate([curve.x for curve in plot.curves]))
        axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        axes.xaxis.set_minor_locator(NullLocator())
    axes.set(title=plot.title, xlabel=plot.x, ylabel=plot.y)
    axes.legend(fontsize="small", frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    save_figure(figure, path)
