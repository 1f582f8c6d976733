"""Page of a run of the study: residuals, compatible region, and measured and simulated edges together."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from doe.plots.palette import BLUE, INK, MUTED, VERMILION
from experiments.evidence.page_figures import new_axes, save_figure
from experiments.evidence.record_page import facts_list, markdown_table, wall_times_table, write_page
from experiments.evidence.studies.cellulose.cellulose_campaign import CURVES, FACTS, PREDICTION
from experiments.evidence.studies.cellulose.cellulose_fit import (
    LEVEL,
    Calibration,
    calibrate_on,
    measured_edge,
    residual_table,
)
from experiments.evidence.studies.cellulose.cellulose_heaps import read_curves
from experiments.evidence.studies.cellulose.cellulose_plan import (
    HELD_BACK,
    MEASURED,
    PUBLISHED,
    PUBLISHED_AREA,
    RUNS,
    places,
    study_at,
)
from experiments.evidence.studies.drum_commands import require_run
from experiments.io.files import write_text
from experiments.report.kit.table import Column, Table, make_table
from experiments.studyfile import Study

PAGE = "README.md"


def write_record(folder: Path) -> Path:
    """Write the page of a run, its tables and its pictures, from the tables that the run left."""
    require_run(folder, CURVES, FACTS, PREDICTION)
    table, curves = read_curves(folder / CURVES)
    facts = json.loads((folder / FACTS).read_text(encoding="utf-8"))
    study = study_at(facts["scale"])
    radius = study.case({}, 0).scene.diameter / 2
    calibration = calibrate_on(study, table, curves[0.5])
    residuals = residual_table(table, curves[0.5], radius)
    write_text(folder / "residuals.csv", residuals.to_csv(index=False, float_format="%.4g"))
    check = (table["stage"] == "check").to_numpy()
    shown = {dark: rows[check] for dark, rows in curves.items()}
    for rpm in MEASURED:
        _draw_measured(folder / f"edge-{rpm}.png", rpm, table[check]["rpm"].to_numpy(), shown)
    forecast = pd.read_csv(folder / PREDICTION)
    for rpm in HELD_BACK:
        own = shown[0.5][table[check]["rpm"].to_numpy() == rpm]
        _draw_predicted(folder / f"edge-{rpm}.png", forecast[forecast["rpm"] == rpm], own, radius)
    return write_page(folder / PAGE, *_parts(study, calibration, residuals, forecast, facts))


def _parts(
    study: Study,
    calibration: Calibration,
    residuals: pd.DataFrame,
    forecast: pd.DataFrame,
    facts: dict[str, Any],
) -> list[str]:
    """Parts of the page, in their order."""
    miss = calibration.free.miss
    widths = ", ".join(
        f"{np.mean(own['high'] - own['low']):.2f} mm at {rpm}/min" for rpm, own in forecast.groupby("rpm")
    )
    return [
        f"# {study.name}",
        "Written by `python -m experiments.evidence.studies.cellulose page`; `curves.csv.xz` holds "
        "the averaged edges of all drums, `residuals.csv` how far each one is off, `prediction.csv` the "
        "prediction.",
        study.note,
        "## Measured and simulated surfaces",
        *(f"![Edge at {rpm} revolutions a minute](edge-{rpm}.png)" for rpm in MEASURED),
        "Lines are where the averaged picture is half dark, the pale ones where it is 20 and 80 % dark: "
        "measured, and simulated at the best settings.",
        markdown_table(_residuals(residuals)),
        _beside_the_source(residuals),
        "## Compatible settings",
        _fit_text(calibration),
        markdown_table(_ranges(calibration, "free walls", calibration.free)),
        markdown_table(_ranges(calibration, "walls that roll as the grains", calibration.tied)),
        "Correlations of the compatible settings, free walls:",
        markdown_table(calibration.correlations(calibration.free).round(2).reset_index(names="factor")),
        "## Predicted surfaces",
        f"Nobody has compared them with a measurement yet. The bands hold a measured height with "
        f"{LEVEL:.0%}: compatible settings, error of the emulators, noise of a run, error of reading "
        f"({miss.reading:g} mm), and what the model misses ({miss.sd:.2f} mm over {miss.length:.0f} mm, as "
        f"it does at {' and '.join(map(str, MEASURED))}/min). They are {widths} wide, on average.",
        *(f"![Edge predicted at {rpm} revolutions a minute](edge-{rpm}.png)" for rpm in HELD_BACK),
        "## What made the numbers",
        facts_list({key: value for key, value in facts.items() if key != "failed"}),
        _failures(facts["failed"], RUNS[facts["scale"]].drums),
        wall_times_table(facts, "drums"),
    ]


def _beside_the_source(residuals: pd.DataFrame) -> str:
    """Say at which speeds the areas are smaller than the source's, and if any settings are at all of them."""
    areas = residuals.pivot_table("area_mm2", ["stage", "point"], "rpm")
    smaller = areas < pd.Series(PUBLISHED_AREA)
    best = smaller.loc["check"].all()
    change = ", ".join(f"{'smaller' if best[rpm] else 'larger'} at {rpm}/min" for rpm in MEASURED)
    count = int(smaller.all(axis=1).sum())
    return (
        f"At the best settings the area is {change} than the source's best. Of the {len(areas)} settings "
        f"that were simulated, {count or 'none'} had a smaller one at every one of these speeds."
    )


def _fit_text(calibration: Calibration) -> str:
    free, tied = calibration.free, calibration.tied
    return (
        f"Generalised least squares of {free.count} heights, one in ten: chi2 is {free.chi2:.1f} with free "
        f"walls and {tied.chi2:.1f} with walls that roll as the grains, each weighed by its own miss of the "
        f"model ({free.miss.sd:.2f} and {tied.miss.sd:.2f} mm, over {free.miss.length:.0f} and "
        f"{tied.miss.length:.0f} mm). Ranges hold {LEVEL:.0%} of the compatible settings."
    )


def _ranges(calibration: Calibration, title: str, fit: Any) -> Table:
    frame = calibration.ranges(fit)
    return make_table("ranges", frame.round(3), list(frame), f"Compatible settings, {title}.")


def _residuals(residuals: pd.DataFrame) -> Table:
    """Residuals of the check, and of the published point, a row a speed."""
    published = residuals["point"].eq(residuals.loc[residuals["stage"] == "first", "point"].max())
    rows = []
    for title, own in (
        ("best settings", residuals[residuals["stage"] == "check"]),
        ("published settings", residuals[(residuals["stage"] == "first") & published]),
    ):
        for rpm, of_speed in own.groupby("rpm"):
            means = of_speed[["rms_mm", "mean_mm", "largest_mm", "area_mm2"]].mean()
            rows.append({"simulated": title, "rpm": rpm, **means, "source's area": PUBLISHED_AREA[int(rpm)]})
    layout = [
        Column("simulated", "simulated at the"),
        Column("rpm", "speed", "count", "1/min"),
        Column("rms_mm", "root mean square", "ratio", "mm"),
        Column("mean_mm", "mean", "ratio", "mm"),
        Column("largest_mm", "largest", "ratio", "mm"),
        Column("area_mm2", "area of disagreement", "ratio", "mm2"),
        Column("source's area", "source's best", "ratio", "mm2"),
    ]
    settings = f"sliding {PUBLISHED['mu']:g}, rolling {PUBLISHED['mu_r']:g}, fill {PUBLISHED['fill']:g}"
    note = (
        f"The area counts inside r2 < 0.6 R2. The published settings are {settings}, walls as grains; the "
        "source's areas are those of its own simulations."
    )
    return make_table("residuals", pd.DataFrame(rows), layout, "Simulated less measured edge.", note)


def _failures(failed: list[str], drums: int) -> str:
    if not failed:
        return f"All {drums} drums finished."
    return "\n".join([f"{len(failed)} of {drums} drums did not finish:", *(f"- {one}" for one in failed)])


def _draw_measured(path: Path, rpm: int, speeds: np.ndarray, curves: dict[float, np.ndarray]) -> None:
    figure, axes = new_axes(6.4, 5.2)
    edge, x = measured_edge(rpm), 1e3 * places()
    for dark, own in curves.items():
        main = dark == 0.5
        style: dict[str, Any] = {"linewidth": 1.8 if main else 0.8, "alpha": 1.0 if main else 0.5}
        name = f"z{100 * dark:.0f}_mm"
        axes.plot(edge["x_mm"], edge[name], color=INK, label="measured" if main else None, **style)
        mean = own[speeds == rpm].mean(axis=0)
        inside = (x >= edge["x_mm"].min()) & (x <= edge["x_mm"].max())
        axes.plot(x[inside], mean[inside], color=BLUE, label="simulated" if main else None, **style)
    _finish(axes, f"{rpm} revolutions a minute")
    save_figure(figure, path)


def _draw_predicted(path: Path, forecast: pd.DataFrame, simulated: np.ndarray, radius: float) -> None:
    figure, axes = new_axes(6.4, 5.2)
    x = forecast["x_mm"]
    axes.fill_between(
        x, forecast["low"], forecast["high"], color=VERMILION, alpha=0.2, label=f"{LEVEL:.0%} band"
    )
    axes.plot(x, forecast["z_mm"], color=VERMILION, linewidth=1.8, label="predicted")
    for number, curve in enumerate(simulated):
        label = "simulated at the best settings" if number == 0 else None
        axes.plot(x, curve, color=BLUE, linewidth=0.8, label=label)
    turn = np.linspace(0.0, 2.0 * np.pi, 361)
    axes.plot(1e3 * radius * np.cos(turn), 1e3 * radius * np.sin(turn), color=MUTED, linewidth=0.8)
    # the bed below its surface is empty in the picture
    _finish(axes, f"{int(forecast['rpm'].iloc[0])} revolutions a minute, not measured here", (0.5, 0.14))
    save_figure(figure, path)


def _finish(axes: Any, title: str, legend: tuple[float, float] | None = None) -> None:
    axes.set_aspect("equal")
    axes.set_xlabel("x [mm], to the right")
    axes.set_ylabel("height above the axis [mm]")
    axes.set_title(title)
    if legend is None:
        axes.legend(frameon=False)
    else:
        axes.legend(frameon=False, fontsize="small", loc="lower center", bbox_to_anchor=legend)
