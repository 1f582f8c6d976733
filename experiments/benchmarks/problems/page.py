"""The page of the verification: tables, plots with their data, and one Markdown text to be read in one go."""

import csv
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import NullLocator

from experiments.benchmarks.problems.chapter import Chapter, Curve, Plot, Row

COLOURS = (
    "#0072B2",
    "#D55E00",
    "#00795a",
    "#b0578d",
    "#E69F00",
    "#56B4E9",
    "#5d6673",
    "#1c2430",
    "#8c6d31",
    "#a05195",
    "#999999",
)
"""Okabe and Ito's palette and some more, which colour-blind readers tell apart."""

VERDICTS = {True: "pass", False: "**FAIL**", None: "stated"}
COLUMNS = (
    "problem",
    "case",
    "quantity",
    "reference",
    "expected",
    "simulated",
    "error",
    "relative",
    "tolerance",
    "verdict",
)

HEADING = "| case | quantity | reference | expected | simulated | error | tolerance | verdict |"

INTRODUCTION = """# Verification

Written by `python -m experiments.benchmarks.verification`; the same rows are in `rows.csv`, and every plot
has its data beside it. An error is relative (in %) or in the unit of the quantity. A row passes when its
error is within its tolerance; a row that is only *stated* has none. "Production precision" has poses in
float64 and forces in float32.
"""


def write_page(chapters: Sequence[Chapter], folder: Path, machine: str) -> Path:
    """Write table, plots, data and page into a folder; the page's path.

    Parameters
    ----------
    chapters
        What was run.
    folder
        Made if missing; files of the same names are written over.
    machine
        What it ran on, in words.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for chapter in chapters:
        for plot in chapter.plots:
            _draw(plot, folder / f"{plot.name}.png")
            _write_data(plot, folder / f"{plot.name}.csv")
    _write_rows(chapters, folder / "rows.csv")
    page = folder / "README.md"
    page.write_text(_page(chapters, machine), encoding="utf-8")
    return page


def summary(chapters: Sequence[Chapter]) -> str:
    """Line that says how many rows passed, failed and were stated."""
    verdicts = [row.passed for chapter in chapters for row in chapter.rows]
    passed, failed, stated = (verdicts.count(verdict) for verdict in (True, False, None))
    return f"{passed} rows pass, {failed} fail, {stated} are stated without a tolerance"


def _page(chapters: Sequence[Chapter], machine: str) -> str:
    parts = [INTRODUCTION, f"**{summary(chapters)}.** {machine}\n", _contents(chapters)]
    for chapter in chapters:
        parts += [
            f"## {chapter.title}\n",
            chapter.text.strip() + "\n",
            _pictures(chapter.plots),
            _table(chapter.rows),
        ]
    return "\n".join(part for part in parts if part)


def _contents(chapters: Sequence[Chapter]) -> str:
    lines = ["| chapter | pass | fail | stated |", "|---|---|---|---|"]
    for chapter in chapters:
        verdicts = [row.passed for row in chapter.rows]
        counts = " | ".join(str(verdicts.count(v)) for v in (True, False, None))
        anchor = chapter.title.lower().replace(" ", "-")
        lines.append(f"| [{chapter.title}](#{anchor}) | {counts} |")
    return "\n".join(lines) + "\n"


def _pictures(plots: Sequence[Plot]) -> str:
    return "\n".join(f"![{plot.title}]({plot.name}.png)" for plot in plots) + "\n" if plots else ""


def _table(rows: Sequence[Row]) -> str:
    """One table a problem, in the order in which they first come."""
    lines: list[str] = []
    for problem in dict.fromkeys(row.problem for row in rows):
        lines += ["", f"**{problem}**", "", HEADING, "|---" * HEADING.count(" | ") + "|---|"]
        lines += [_line(row) for row in rows if row.problem == problem]
    return "\n".join(lines) + "\n"


def _line(row: Row) -> str:
    numbers = (f"{row.expected:.6g}", f"{row.simulated:.6g}", _error(row.error, row.relative))
    tolerance = "" if row.tolerance is None else _error(row.tolerance, row.relative)
    cells = (row.case, row.quantity, row.reference, *numbers, tolerance, VERDICTS[row.passed])
    return "| " + " | ".join(cells) + " |"


def _error(value: float, relative: bool) -> str:
    return f"{100.0 * value:.2g} %" if relative else f"{value:.2g}"


def _write_rows(chapters: Sequence[Chapter], path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("chapter", *COLUMNS))
        for chapter in chapters:
            for row in chapter.rows:
                verdict = VERDICTS[row.passed].strip("*").lower()
                writer.writerow((chapter.title, *(getattr(row, name) for name in COLUMNS[:-1]), verdict))


def _write_data(plot: Plot, path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("curve", plot.x, plot.y))
        for curve in plot.curves:
            writer.writerows(
                (curve.label, f"{x:.7g}", f"{y:.7g}") for x, y in zip(curve.x, curve.y, strict=True)
            )


def _draw(plot: Plot, path: Path) -> None:
    figure, axes = plt.subplots(figsize=(7.2, 4.2), layout="constrained")
    for k, curve in enumerate(plot.curves):
        _draw_curve(axes, curve, COLOURS[(k if curve.colour is None else curve.colour) % len(COLOURS)])
    if plot.logarithmic:
        axes.set(xscale="log", yscale="log")
        ticks = np.unique(np.concatenate([curve.x for curve in plot.curves]))
        axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        axes.xaxis.set_minor_locator(NullLocator())
    axes.set(title=plot.title, xlabel=plot.x, ylabel=plot.y)
    axes.grid(color="#eceff3")
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(fontsize="small", frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.savefig(path, dpi=110, metadata={"Software": None})
    plt.close(figure)


def _draw_curve(axes: plt.Axes, curve: Curve, colour: str) -> None:
    x, y = np.asarray(curve.x), np.asarray(curve.y)
    if curve.style == "points":
        axes.plot(x, y, "o", color=colour, markersize=4, label=curve.label)
    else:
        axes.plot(
            x, y, "--" if curve.style == "dashed" else "-", color=colour, linewidth=1.5, label=curve.label
        )
