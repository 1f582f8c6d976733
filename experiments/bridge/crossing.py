"""Steps of a bridge: runs around the card's point, runs around the corrected point, and fresh runs there.

Half of the runs are placed around the card's point: on it, across the target's contour and along it. They
shift and scale the surface, and the other half are placed alike around the point that the corrected surface
chooses; so the last correction is made from runs close to where it is used, however large the first was.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd

from doe import DesignError, TargetError, Transfer, compare_means, transfer, transfer_points
from experiments.bridge.result import BridgeOutcome, Crossing
from experiments.bridge.source import Source
from experiments.calibrate.values import interval_text, listed, quantity
from experiments.io.errors import InputError

LEAST_RUNS = 6
"""Fewest runs of a bridge: one round around the point is five, and shift, scale and noise are three."""

DEGREES_WITHIN = 0.5
"""Margin of a bridge between angles [deg]."""

BEYOND = (1.0, 1.5, 2.0, 3.0)
"""Boxes in which the corrected point is searched, one after another, relative to the reach of the card's
runs. Beyond 1 the shape of the surface is extrapolated; the second half of the runs is there, too."""

FRESH = 1000
"""Number of the first fresh run."""

Runner = Callable[[pd.DataFrame, str], pd.DataFrame]
"""Simulates a table of cases, under a title, and returns it with status, reason and observables."""


class _EndError(Exception):
    """A bridge ends before its last step."""

    def __init__(self, outcome: BridgeOutcome, reason: str) -> None:
        super().__init__(reason)
        self.outcome, self.reason = outcome, reason


def check_order(source: Source, runs: int, fresh: int, margin: float | None) -> float:
    """Check the numbers of a bridge, and return its margin in the response's unit.

    Raise InputError with too few runs or fresh runs, or a margin that is not positive or must be stated.
    """
    if runs < LEAST_RUNS:
        raise InputError("--runs", f"must be at least {LEAST_RUNS}", runs)
    if fresh < 2:
        raise InputError("--fresh", "must be at least 2", fresh)
    if margin is None and source.unit != "deg":
        raise InputError("--margin", f"must be given for a response in {source.unit}")
    margin = DEGREES_WITHIN if margin is None else margin
    if not (np.isfinite(margin) and margin > 0.0):
        raise InputError("--margin", "must be a positive number", margin)
    return margin


def cross(
    source: Source, runner: Runner, engine: str, runs: int, fresh: int, margin: float, seed: int
) -> Crossing:
    """Correct a card by runs in another solver, and verify the corrected point by fresh ones.

    Parameters
    ----------
    source : Source
    runner
        Simulates in the other solver.
    engine : str
        Its name in words.
    runs, fresh : int
        Runs that the correction is made from, and runs that verify it.
    margin : float
        Difference from the target that does not matter, in the response's unit.
    seed : int
        Root of the seeds of all runs.
    """
    made: list[pd.DataFrame] = []

    def run(points: pd.DataFrame, stage: str, first: int) -> pd.DataFrame:
        numbers = list(range(first, first + len(points)))
        seeds = [int(np.random.SeedSequence([seed, n]).generate_state(1, np.uint32)[0] >> 1) for n in numbers]
        cases = runner(points.assign(stage=stage, run=numbers, seed=seeds), stage)
        made.append(cases)
        return cases

    crossing = Crossing(source, engine, BridgeOutcome.MISSED, "", pd.DataFrame(), margin)
    try:
        crossing = _correct(crossing, run, runs)
        crossing = _verify(crossing, run, fresh)
    except _EndError as end:
        crossing = replace(crossing, outcome=end.outcome, reason=end.reason)
    return replace(crossing, runs=pd.concat(made, ignore_index=True))


def _correct(crossing: Crossing, run: Callable[..., pd.DataFrame], count: int) -> Crossing:
    """Shift and scale the surface, twice, and choose the point of its contour nearest to the card's."""
    source = crossing.source
    reach = float(source.surface.points.abs().to_numpy().max())
    point, extent, table = source.point, reach, pd.DataFrame()
    for turn, share in enumerate((count - count // 2, count // 2)):
        places = transfer_points(source.surface, point, share, extent=extent, turn=turn)
        cases = run(_inside_limits(source, places), "bridge", len(table) + 1)
        table = pd.concat([table, cases], ignore_index=True)
        carried = _fitted(source, table)
        point, extent = _nearest(source, carried, reach)
    coded = [[float(f.to_coded(point[f.name])) for f in source.surface.design.factors]]
    mean, error = carried.evaluate(coded)
    region = carried.compatible_region(source.target, extent=extent)
    return replace(
        crossing,
        carried=carried,
        extent=extent / reach,
        point=point,
        prediction=(float(mean[0]), float(error[0])),
        region=region,
    )


def _inside_limits(source: Source, places: pd.DataFrame) -> pd.DataFrame:
    """Keep runs inside what is physical."""
    limits = source.study.limits
    return pd.DataFrame({str(name): places[name].clip(*limits[str(name)]) for name in places.columns})


def _fitted(source: Source, table: pd.DataFrame) -> Transfer:
    good = table[table["status"] == "finished"].dropna(subset=[source.observable])
    try:
        return transfer(source.surface, good, good[source.observable].to_numpy(), source.target.mean)
    except DesignError as error:
        lost = table.loc[~table.index.isin(good.index), "reason"]
        why = f" The first that failed: {lost.iloc[0]}." if len(lost) else ""
        reason = f"{len(good)} of {len(table)} runs gave the {source.response}: {error}.{why}"
        raise _EndError(BridgeOutcome.TOO_MANY_FAILED_RUNS, reason) from error


def _nearest(source: Source, carried: Transfer, reach: float) -> tuple[dict[str, float], float]:
    """Find the corrected surface's point nearest to the card's, and the box that holds it."""
    missed = ""
    for beyond in BEYOND:
        try:
            found = carried.nearest(source.target.mean, to=source.point, extent=beyond * reach)
        except TargetError as error:
            missed = str(error)
            continue
        point = {str(name): float(value) for name, value in found.items()}
        limits = source.study.limits
        if all(limits[name][0] <= value <= limits[name][1] for name, value in point.items()):
            return point, beyond * reach
        missed = f"the nearest point of its contour, {listed(point)}, is not physical"
    unit = source.unit
    reason = (
        f"There the surface is shifted by {quantity(carried.shift, unit, '+')} and scaled by "
        f"{carried.scale:.3g}, and {missed}. Widen the ranges of the factors, or choose laws nearer to that "
        "solver's, and calibrate again."
    )
    raise _EndError(BridgeOutcome.OUT_OF_REACH, reason)


def _verify(crossing: Crossing, run: Callable[..., pd.DataFrame], count: int) -> Crossing:
    """Run the corrected point with fresh seeds, and compare with the target."""
    source, unit = crossing.source, crossing.source.unit
    cases = run(pd.DataFrame([crossing.point] * count), "verification", FRESH)
    good = cases[cases["status"] == "finished"].dropna(subset=[source.observable])
    try:
        test = compare_means(good[source.observable].to_numpy(), source.target, margin=crossing.margin)
    except DesignError as error:
        reason = f"{len(good)} of {len(cases)} fresh runs gave the {source.response}: {error}."
        raise _EndError(BridgeOutcome.TOO_MANY_FAILED_RUNS, reason) from error
    low, high = test.interval
    met = low <= crossing.margin and high >= -crossing.margin
    verdict = "within" if met else "not within"
    reason = (
        f"{test.a.n} fresh runs in {crossing.engine} gave {quantity(test.a.mean, unit)} against "
        f"{quantity(source.target.mean, unit)}: {quantity(test.difference, unit, '+')}, 95 % interval "
        f"{interval_text(test.interval, unit, '+')}, {verdict} {quantity(crossing.margin, unit)} plus noise"
        f"{'; equivalence is shown' if test.equivalent else ''}."
    )
    outcome = BridgeOutcome.MET if met else BridgeOutcome.MISSED
    return replace(crossing, fresh=test, outcome=outcome, reason=reason)
