"""The page of the verification: tables, plots with their data, and one Markdown text to be read in one go."""

import csv
import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import NullLocator

from experiments.benchmarks.problems.chapter import Chapter, Curve, Plot, Row
from experiments.files import write_text

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

Written by `python -m experiments.benchmarks.verification`; the same rows are in `rows.csv`, and every
plot has its data beside it. Every chapter says what it ran on. An error is relative (in %) or in the unit
of the quantity. A row passes when its error is within its tolerance; a row that is only *stated* has
none. "Production precision" has poses in float64 and forces in float32.
"""


@dataclass(frozen=True)
class Section:
    """A chapter as the page has it, its plots drawn already.

    Attributes
    ----------
    title, text : str
    machine : str
        What it ran on, in words.
    rows : tuple of Row
    pictures : tuple of (str, str)
        Stem of each picture's files, and its title.
    """

    title: str
    text: str
    machine: str
    rows: tuple[Row, ...]
    pictures: tuple[tuple[str, str], ...]


def write_chapter(name: str, chapter: Chapter, machine: str, folder: Path) -> None:
    """Write plots, their data and the section of one problem into a folder, for `write_page`.

    Parameters
    ----------
    name
        Of the problem.
    chapter
        What it gave.
    machine
        What it ran on, in words.
    folder
        Made if missing; files of the same names are written over.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for plot in chapter.plots:
        _draw(plot, folder / f"{plot.name}.png")
        _write_data(plot, folder / f"{plot.name}.csv")
    pictures = tuple((plot.name, plot.title) for plot in chapter.plots)
    section = Section(chapter.title, chapter.text, machine, chapter.rows, pictures)
    write_text(_section_file(folder, name), json.dumps(asdict(section), indent=1) + "\n")


def write_page(folder: Path, names: Iterable[str]) -> Path:
    """Write the page and the table of rows from the sections that a folder has.

    Parameters
    ----------
    folder
        Where `write_chapter` wrote, perhaps on several machines.
    names
        Of the problems, in the order of the page; one without a section is left out.

    Returns
    -------
    Path
        The page.
    """
    files = [_section_file(folder, name) for name in names]
    sections = [_read_section(file) for file in files if file.exists()]
    _write_rows(sections, folder / "rows.csv")
    page = folder / "README.md"
    write_text(page, _page(sections))
    return page


def _section_file(folder: Path, name: str) -> Path:
    return folder / f"{name}.json"


def _read_section(path: Path) -> Section:
    values = json.loads(path.read_text(encoding="utf-8"))
    rows = tuple(Row(**row) for row in values.pop("rows"))
    pictures = tuple((stem, title) for stem, title in values.pop("pictures"))
    return Section(rows=rows, pictures=pictures, **values)


def summary(rows: Iterable[Row]) -> str:
    """Line that says how many rows passed, failed and were stated."""
    passed, failed, stated = _counts(rows)
    return f"{passed} rows pass, {failed} fail, {stated} are stated without a tolerance"


def _counts(rows: Iterable[Row]) -> tuple[int, int, int]:
    verdicts = [row.passed for row in rows]
    return verdicts.count(True), verdicts.count(False), verdicts.count(None)


def _page(sections: Sequence[Section]) -> str:
    every = summary(row for section in sections for row in section.rows)
    parts = [INTRODUCTION, f"**{every}.**\n", _contents(sections)]
    for section in sections:
        parts += [
            f"## {section.title}\n",
            section.text.strip() + "\n",
            f"*{section.machine}*\n",
            _pictures(section.pictures),
            _table(section.rows),
        ]
    return "\n".join(part for part in parts if part)


def _contents(sections: Sequence[Section]) -> str:
    lines = ["| chapter | pass | fail | stated | ran on |", "|---|---|---|---|---|"]
    for section in sections:
        counts = " | ".join(str(count) for count in _counts(section.rows))
        anchor = section.title.lower().replace(" ", "-")
        lines.append(f"| [{section.title}](#{anchor}) | {counts} | {section.machine} |")
    return "\n".join(lines) + "\n"


def _pictures(pictures: Sequence[tuple[str, str]]) -> str:
    return "\n".join(f"![{title}]({stem}.png)" for stem, title in pictures) + "\n" if pictures else ""


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


def _write_rows(sections: Sequence[Section], path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("chapter", *COLUMNS))
        for section in sections:
            for row in section.rows:
                verdict = VERDICTS[row.passed].strip("*").lower()
                writer.writerow((section.title, *(getattr(row, name) for name in COLUMNS[:-1]), verdict))


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
