"""Record of levels and coverage: `python -m experiments.evidence.accuracy.statistics.statistics_record`."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated

import pandas as pd
import typer

from experiments.evidence.accuracy.statistics.agreements import agreements
from experiments.evidence.accuracy.statistics.alarms import alarms
from experiments.evidence.accuracy.statistics.coverage import AT_LEAST, AT_MOST, SLACK, Figure, figures_table
from experiments.evidence.accuracy.statistics.direct_coverage import direct_readings
from experiments.evidence.accuracy.statistics.fidelity import fidelity
from experiments.evidence.accuracy.statistics.means import means
from experiments.evidence.accuracy.statistics.plans import plans
from experiments.evidence.accuracy.statistics.screenings import screenings
from experiments.evidence.accuracy.statistics.surface_coverage import intervals, joint_fits, surfaces

THEMES: dict[str, Callable[[], Iterator[Figure]]] = {
    "surfaces": surfaces,
    "joint_fits": joint_fits,
    "direct_readings": direct_readings,
    "intervals": intervals,
    "means": means,
    "screenings": screenings,
    "agreements": agreements,
    "plans": plans,
    "fidelity": fidelity,
    "alarms": alarms,
}
"""Parts of the record, each a file of its own."""

TITLES = {
    "surfaces": "Surfaces and their regions",
    "joint_fits": "Joint fits",
    "direct_readings": "Joint fits with direct readings",
    "intervals": "Factors of a joint fit, each by itself",
    "means": "Comparisons of means",
    "screenings": "Screening",
    "agreements": "Agreement",
    "plans": "Plans of tests",
    "fidelity": "Surfaces moved from a cheaper scale",
    "alarms": "Alarms and names of the search",
}

ROUNDING = 1e-9

FOLDER = Path(__file__).with_name("record")
PAGE = "README.md"
COMMAND = "python -m experiments.evidence.accuracy.statistics.statistics_record"


def page(folder: Path = FOLDER) -> str:
    """Write the page of the stored tables as Markdown."""
    parts = [
        "# Levels and coverage",
        "What `doe` states against how often it holds, by simulation (normal errors, fixed seeds). "
        f"`{COMMAND}` repeats the record in some minutes of one core; with `--theme NAME`, one part of it.",
        "*exact*: the stated share within .01 (.94 to .96 for .95, .04 to .06 for .05). *at least*, *at "
        "most*: so the documentation states it, conservative by construction; within .01 on that side. se: "
        "of the share found, by the trials (a trial of a joint fit is a probability, and tells more than a "
        "yes or no). A figure holds that lies in its band, or outside by no more than "
        "two standard errors (`se`). With two measurements (*at least*) no rule is exact: none that is "
        "continuous in the data holds its level for all ratios of two unknown variances (the problem of "
        "Behrens and Fisher; Linnik 1968), and with one degree of freedom the best one found still goes from "
        ".932 to .968 (`doe.samples.two_errors`). n: measurements behind a target. Spread: standard "
        "deviation of a measurement over that of a run. Read: factors measured by themselves, by n "
        "readings each or with a stated error; model: sd of the model's parameter over the standard error of "
        "the readings (drawn on 2026-11-27). Plans, alarms: on 2026-11-28, on two cores; on the "
        "engine, twins of heaps of 150 grains. At most 1: a level that nobody states, for comparison.",
    ]
    for theme, title in TITLES.items():
        table = pd.read_csv(folder / f"{theme}.csv")
        parts += [f"## {title}", _summary(table), _markdown(table)]
    return "\n\n".join(parts) + "\n"


def _summary(table: pd.DataFrame) -> str:
    lines = [
        f"`{figure}`: {group['found'].min():.3f} to {group['found'].max():.3f} for "
        f"{'/'.join(sorted(set(group['promise'])))} {group['stated'].iloc[0]:g} in {len(group)} cases."
        for figure, group in table.groupby("figure", sort=False)
    ]
    missed = int((~table["holds"]).sum())
    lines.append("Every figure holds." if not missed else f"{missed} of {len(table)} figures do not hold.")
    slack = SLACK + ROUNDING
    low = (table["found"] < table["stated"] - slack) & (table["promise"] != AT_MOST)
    high = (table["found"] > table["stated"] + slack) & (table["promise"] != AT_LEAST)
    for row in table[(low | high) & table["holds"]].itertuples():
        lines.append(f"Within two standard errors of its band: {row.figure}, {row.case}.")
    return "  \n".join(lines)


def _markdown(table: pd.DataFrame) -> str:
    rows = [
        f"| {row.figure} | {row.case} | {row.promise} {row.stated:g} | {row.found:.4f} | {row.se:.4f} "
        f"| {row.trials} | {'yes' if row.holds else 'no'} |"
        for row in table.itertuples()
    ]
    head = [
        "| figure | case | stated | found | se | trials | holds |",
        "| --- | --- | --- | ---: | ---: | ---: | --- |",
    ]
    return "\n".join([*head, *rows])


def main(
    theme: Annotated[list[str] | None, typer.Option(help="A part to repeat; default: all.")] = None,
    out: Annotated[Path, typer.Option(help="Folder of the record.")] = FOLDER,
) -> None:
    """Repeat parts of the record and write its page."""
    unknown = [name for name in theme or [] if name not in THEMES]
    if unknown:
        raise typer.BadParameter(f"a theme is one of {', '.join(THEMES)}, got {unknown[0]!r}")
    out.mkdir(parents=True, exist_ok=True)
    for name in theme or THEMES:
        begin = time.perf_counter()
        figures_table(THEMES[name]()).to_csv(out / f"{name}.csv", index=False)
        print(f"{name}: {time.perf_counter() - begin:.0f} s")
    (out / PAGE).write_text(page(out), encoding="utf-8")


if __name__ == "__main__":
    typer.run(main)
