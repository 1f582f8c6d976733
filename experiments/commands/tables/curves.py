"""Calibration on a measured curve: ``dem-warp doe curve``."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from doe import Category, plots
from doe.curves.curve_emulator import CurveEmulator
from doe.curves.curve_fit import MeasuredCurve, fit_curves
from doe.plots.style import canvas, plain
from experiments.commands.tables.answers import Answer
from experiments.commands.tables.sheet import Columns, Sheet, read_columns, read_frame, read_sheet
from experiments.io.errors import InputError
from experiments.io.texts import is_number


def read_curves(path: Path, factors: Sequence[str]) -> Sheet:
    """Read runs whose responses are the columns with a number, a place, as their head."""
    heads = [head for head in read_frame(path)[0].columns if is_number(head)]
    if len(heads) < 2:
        raise InputError(str(path), "needs the heights of a curve in columns whose heads are its places")
    sheet = read_sheet(path, Columns(factors, sorted(heads, key=float)))
    if named := [factor.name for factor in sheet.design.factors if isinstance(factor, Category)]:
        raise InputError(str(path), f"{named[0]}: a curve is fitted over factors with numbers only")
    return sheet


def read_measured(path: Path) -> pd.DataFrame:
    """Read a curve: places and heights, in the first two columns."""
    heads = list(read_frame(path)[0].columns[:2])
    if len(heads) < 2:
        raise InputError(str(path), "needs two columns: places and heights")
    return read_columns(path, heads).set_axis(["place", "measured"], axis=1).sort_values("place")


def fit_curve(
    sheet: Sheet, measured: pd.DataFrame, reading: float, varying: bool, alpha: float, seed: int
) -> Answer:
    """Find the settings whose curve agrees with the measured one, as far as the model can give it."""
    rows = sheet.responses.dropna()
    design, places = sheet.design.select(list(rows.index)), rows.columns.to_numpy(float)
    own = np.flatnonzero((places >= measured["place"].min()) & (places <= measured["place"].max()))
    if not len(own):
        raise InputError(
            "--measured", f"must overlap the places of the runs, {places[0]:g} to {places[-1]:g}"
        )
    seen = np.interp(places[own], measured["place"], measured["measured"])
    emulator = CurveEmulator.of(design.points.to_numpy(), rows.to_numpy(), varying)
    fit = fit_curves({"": emulator}, places, [MeasuredCurve("", 0.0, own, seen)], reading, seed)
    ends = np.quantile(fit.settings, [0.5 * alpha, 1.0 - 0.5 * alpha], axis=0)
    columns = {"best": fit.best, "low": ends[0], "high": ends[1]}
    center, half = np.array([(factor.center, factor.half_range) for factor in design.factors]).T
    settings = pd.DataFrame(
        {name: center + half * coded for name, coded in columns.items()},
        pd.Index([factor.label for factor in design.factors], name="factor"),
    )
    settings["part of the range"] = (ends[1] - ends[0]) / 2.0
    band = fit.forecast("", 0.0, 1.0 - alpha, seed)._asdict()
    curve = pd.DataFrame({"measured": pd.Series(seen, places[own]).reindex(places), **band}, places)
    sure = f"{1.0 - alpha:.0%}"
    answer = Answer("Settings of a curve", [settings.to_string(float_format="{:.4g}".format)])
    answer.tables["settings"] = f"Settings that agree ({sure} of the probability).", settings
    answer.tables["curve"] = f"Measured, and {sure} band of a further one.", curve.rename_axis("place")
    rest = float(np.sqrt(np.mean(fit.residuals(fit.best[None]) ** 2)))
    answer.notes = [
        f"The best settings differ from the measured curve by {rest:.3g} (root mean square).",
        f"The model misses some {fit.miss.sd:.2g}, alike at places up to {fit.miss.length:.2g} apart.",
    ]
    answer.draw("curve", f"Measured curve, and {sure} band of a further one.", partial(_drawn, curve))
    return answer


def _drawn(curve: pd.DataFrame) -> Figure:
    figure, axes = canvas(None, 3.8)
    axes.fill_between(curve.index, curve["low"], curve["high"], color=plots.BLUE, alpha=0.2, linewidth=0.0)
    axes.plot(curve.index, curve["expected"], color=plots.BLUE, label="expected")
    axes.plot(curve.index, curve["measured"], "o", color=plots.VERMILION, label="measured")
    axes.set(xlabel="place", ylabel="height")
    axes.legend(frameon=False)
    plain(axes)
    return figure
