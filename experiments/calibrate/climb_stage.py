"""Stage (d): the path of steepest ascent, until it has crossed the target or turned."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy import stats

from doe import NoiseFloor, Sample, ScreenResult, steepest_path
from experiments.calibrate.cases import (
    Runner,
    StageEnd,
    failure_summary,
    measured,
    plan_cases,
    too_many_failed,
)
from experiments.calibrate.results import (
    ClimbEnd,
    ClimbResult,
    Decision,
    NoiseFloorResult,
    Outcome,
    ScreeningResult,
    TargetResult,
)
from experiments.calibrate.values import (
    fixed_values,
    kept_factors,
    key_of,
    listed,
    named,
    numbered_values,
    quantity,
    reach_limits,
    worded,
)
from experiments.studyfile import Study
from experiments.studyfile.campaign import ClimbSettings, Response

STAGE = "climb"

LEAST_STEPS = 2
"""Steps with a value below which a path has no direction."""


@dataclass(frozen=True)
class _Line:
    """Start and moves of a climb."""

    screen: ScreenResult
    kept: tuple[str, ...]
    start: Mapping[str, float]
    step: float | Mapping[str, float]
    """Coded move of the strongest factor, or natural moves; the screening gives the signs."""
    limits: Mapping[str, tuple[float, float]]

    def walk(self, start: Mapping[str, float], moves: int, descend: bool = False) -> pd.DataFrame:
        """Return the points of a path, the start first: kept factors (natural) and predicted response."""
        limits = {name: self.limits[name] for name in self.kept}
        path = steepest_path(
            self.screen, moves, factors=self.kept, step=self.step, start=start, limits=limits, descend=descend
        )
        # Coding and back may round a value that was clipped at zero to -1e-17, which no physics accepts.
        low, high = (pd.Series({name: limits[name][end] for name in self.kept}) for end in (0, 1))
        return path.natural.clip(low, high, axis=1).assign(predicted=path.predicted)


def climb(
    study: Study,
    screening: ScreeningResult,
    kept: tuple[str, ...],
    noise: NoiseFloorResult,
    target: TargetResult,
    runner: Runner,
) -> ClimbResult:
    """Walk along the leading response's steepest path, every step at once, and on if the target is ahead.

    Factors with a direct reading are held there; where that path does not cross the target, they move too.
    StageEnd where the path has no room, or fewer than two steps gave a value.
    """
    response, held = study.target.leading, _held(study, kept)
    line, rule = _line(study, screening.leading.screen, kept, held)
    path, cases, end = _walk(study, line, noise, target, runner)
    if held and end is not ClimbEnd.CROSSED:
        line, rule = _line(study, screening.leading.screen, kept, {})
        path, cases, end = _walk(study, line, noise, target, runner)
        rule += f" With {', '.join(held)} held at the direct readings it did not cross the target."
    place, crossing = _crossing(path, kept) if end is ClimbEnd.CROSSED else (None, None)
    best = int(path["error"].abs().idxmin())
    # the largest move of each factor between two steps: a bound may have shortened others
    moves = path[list(kept)].diff().iloc[1:]
    step = {name: float(moves[name].iloc[int(moves[name].abs().argmax())]) for name in kept}
    start_and_step = numbered_values("start", line.start) | numbered_values("step", step)
    moves = ", ".join(f"{name} by {move:+.4g}" for name, move in step.items())
    decisions = (
        Decision(STAGE, rule, start_and_step, f"One step moves {moves}."),
        _end_decision(path, cases, end, response, target.leading, crossing, place, best),
    )
    return ClimbResult(cases, kept, path, step, end, crossing, place, best, decisions)


def _walk(
    study: Study, line: _Line, noise: NoiseFloorResult, target: TargetResult, runner: Runner
) -> tuple[pd.DataFrame, pd.DataFrame, ClimbEnd]:
    """Simulate a path in batches; return its steps, its cases and its end."""
    settings, response = study.campaign.climb, study.target.leading
    batches, tables = [_first_points(study, line)], []
    for _ in range(1 + settings.extensions):
        steps = batches[-1][list(line.kept)]
        tables.append(runner(plan_cases(study, STAGE, steps, study.campaign.climb_replicates, [response])))
        points, cases = pd.concat(batches).sort_index(), pd.concat(tables, ignore_index=True)
        path = _path_table(points, cases, response, target.leading.mean)
        end = _end(path, measured(cases, response)[["run", response.observable]], noise.leading, settings)
        more = _further_points(line, path, settings)
        if end is not ClimbEnd.BOUNDED or more.empty:
            break
        batches.append(more)
    return path, cases, end


def require_crossing(study: Study, result: ClimbResult, target: TargetResult) -> None:
    """Go on when the climb crossed the target or the study fixes the centre of the surface; else StageEnd."""
    center = fixed_values(study.campaign.surface.center, result.kept)
    if result.end is ClimbEnd.CROSSED or center is not None:
        return
    response = study.target.leading
    nearest = quantity(result.path.loc[result.best_step, "mean"], response.unit)
    aim = quantity(target.leading.mean, response.unit)
    best = f"{nearest} at best ({worded(study, result.best)}) against {aim}"
    if result.end is ClimbEnd.BOUNDED:
        # The end that the climb was heading for.
        edge, limits = result.path.iloc[0 if result.path["error"].min() > 0.0 else -1], reach_limits(study)
        at_bound = [n for n in result.kept if any(math.isclose(edge[n], bound) for bound in limits[n])]
        where = f"at the bound: {named(study, at_bound)}" if at_bound else "all batches were used up"
        raise StageEnd(
            Outcome.TARGET_NOT_REACHED,
            f"The climb never reached the target: {best}; {where}. Widen the ranges of "
            f"{named(study, result.kept)}, raise climb.reach or climb.extensions, or keep further factors; "
            "if the ranges are physical, the model lacks a mechanism.",
        )
    if result.end is ClimbEnd.TURNED:
        course, advice = "turned before", f"More of {named(study, result.kept)} does not help: keep"
    else:
        course = "does not change beyond the noise and never meets"
        advice = "More cases (climb.replicates, noise_floor.replicates) show smaller changes; else keep"
    raise StageEnd(
        Outcome.PLATEAU,
        f"The {response.name} {course} the target: {best}. {advice} further factors, or look for a mechanism "
        "that the model lacks.",
    )


def _held(study: Study, kept: tuple[str, ...]) -> dict[str, float]:
    """Return the direct readings of kept factors, the most precise of each; none if no factor is left."""
    limits = reach_limits(study)
    ranked = sorted(study.direct, key=lambda one: -math.hypot(one.measured.se, one.model_sd))
    held = {
        one.factor: min(max(one.measured.mean, limits[one.factor][0]), limits[one.factor][1])
        for one in ranked
        if one.factor in kept
    }
    return held if set(held) < set(kept) else {}


def _line(
    study: Study, screen: ScreenResult, kept: tuple[str, ...], held: Mapping[str, float]
) -> tuple[_Line, str]:
    """Return the path to walk, some factors held, and the rule that chose it."""
    settings, limits = study.campaign.climb, reach_limits(study)
    start, step = fixed_values(settings.start, kept), fixed_values(settings.step, kept)
    if start is not None and step is not None:
        rule = "The study fixes start and step of the climb; the screening gives the signs."
        return _Line(screen, kept, start, step, limits), rule
    slopes = screen.coded_coefficients[list(kept)]
    strongest = slopes.drop(list(held)).abs().max()
    if held and not strongest > 0.0:
        return _line(study, screen, kept, {})
    direction = slopes / strongest
    start = {f.name: float(f.to_natural(-direction[f.name])) for f in kept_factors(study, kept)}
    rule = (
        f"The climb follows the line through the middle along the screening effects; {settings.steps} points "
        "take the strongest factor through its range."
    )
    if held:
        rule += f" Held at the direct readings: {listed(held)}."
    # a factor that is held starts at its limits; the step is that of the strongest factor of all
    limits |= {name: (value, value) for name, value in held.items()}
    move = 2.0 / (settings.steps - 1) * float(slopes.abs().max() / strongest)
    return _Line(screen, kept, {**start, **held}, move, limits), rule


def _first_points(study: Study, line: _Line) -> pd.DataFrame:
    points = line.walk(line.start, study.campaign.climb.steps - 1)
    if len(points) < LEAST_STEPS:
        raise StageEnd(
            Outcome.TARGET_NOT_REACHED,
            f"The climb cannot leave its start ({worded(study, line.start)}), which stands at its bounds: "
            "fix another climb.start, or raise climb.reach.",
        )
    return points.set_axis(pd.RangeIndex(1, len(points) + 1, name="step"))


def _further_points(line: _Line, path: pd.DataFrame, settings: ClimbSettings) -> pd.DataFrame:
    """Return the next batch: past the last step when all values are too low, else before the first."""
    descend = bool(path["error"].min() > 0.0)
    edge = path.iloc[0 if descend else -1]
    start = {name: float(edge[name]) for name in line.kept}
    more = line.walk(start, settings.steps, descend).iloc[1:]
    counts = np.arange(1, len(more) + 1)
    labels = path.index[0] - counts if descend else path.index[-1] + counts
    return more.set_axis(pd.Index(labels, name="step"))


def _path_table(points: pd.DataFrame, cases: pd.DataFrame, response: Response, target: float) -> pd.DataFrame:
    """Return the points with what was measured at each; StageEnd where fewer than two gave a value."""
    found = measured(cases, response).groupby("run")[response.observable]
    used = found.agg(["mean", "std", "size"]).reindex(points.index)
    if used["mean"].count() < LEAST_STEPS:
        raise too_many_failed(cases, STAGE, f"needs at least {LEAST_STEPS} measured steps", response)
    path = points.assign(mean=used["mean"], sd=used["std"], n=used["size"].fillna(0).astype(int))
    path["error"] = path["mean"] - target
    path["error_percent"] = 100.0 * path["error"].abs() / abs(target) if target else math.nan
    return path


def _end(path: pd.DataFrame, used: pd.DataFrame, noise: NoiseFloor, settings: ClimbSettings) -> ClimbEnd:
    """Judge a path: crossed, else flat, else turned, else it ends where it is bounded."""
    known = path.dropna(subset="mean")
    error, count = known["error"].to_numpy(), known["n"].to_numpy()
    if _sign_changes(error).size:
        return ClimbEnd.CROSSED
    variance, df = _pooled_variance(used, noise)
    others = len(error) - 1
    between = float((count * (error - np.average(error, weights=count)) ** 2).sum()) / others
    if between <= float(stats.f.isf(settings.alpha, others, df)) * variance:
        return ClimbEnd.FLAT
    gap = np.abs(error)
    best, last = int(gap.argmin()), (others if error[0] < 0.0 else 0)
    # The best of all steps is compared with one other: the level is shared among the comparisons it could be.
    critical = float(stats.t.isf(settings.alpha / others, df))
    if gap[last] - gap[best] > critical * math.sqrt(variance * (1.0 / count[best] + 1.0 / count[last])):
        return ClimbEnd.TURNED
    return ClimbEnd.BOUNDED


def _pooled_variance(used: pd.DataFrame, noise: NoiseFloor) -> tuple[float, float]:
    """Return the variance of one case from the noise floor and the climb's replicates, and its df."""
    run, values = used["run"], used.iloc[:, -1]
    within = values - values.groupby(run).transform("mean")
    df = noise.sample.df + len(used) - run.nunique()
    return (noise.sample.df * noise.sd**2 + float((within**2).sum())) / df, df


def _sign_changes(error: np.ndarray) -> np.ndarray:
    """Return the positions after which the error changes its sign (or is zero)."""
    return np.flatnonzero(error[:-1] * error[1:] <= 0.0)


def _crossing(path: pd.DataFrame, kept: tuple[str, ...]) -> tuple[float, dict[str, float]]:
    """Return the first place where the path crosses the target, interpolated: fractional step and values."""
    known = path.dropna(subset="mean")
    error = known["error"].to_numpy()
    before = int(_sign_changes(error)[0])
    span = error[before] - error[before + 1]
    share = float(error[before] / span) if span else 0.0
    labels = known.index.to_numpy(dtype=np.float64)
    values = known[list(kept)].to_numpy()
    place = (1.0 - share) * labels[before] + share * labels[before + 1]
    point = (1.0 - share) * values[before] + share * values[before + 1]
    return float(place), dict(zip(kept, point.tolist(), strict=True))


def _end_decision(
    path: pd.DataFrame,
    cases: pd.DataFrame,
    end: ClimbEnd,
    response: Response,
    target: Sample,
    crossing: Mapping[str, float] | None,
    place: float | None,
    best: int,
) -> Decision:
    numbers = {key_of(f"step {step}, mean", response): mean for step, mean in path["mean"].items()}
    numbers |= {key_of("target", response): target.mean, "nearest step": best}
    if crossing is not None:
        numbers |= {"crossing step": place} | numbered_values("crossing", crossing)
        outcome = f"The path crosses the target at {listed(crossing)} (step {place:.2f}, interpolated)."
    else:
        outcome = {
            ClimbEnd.TURNED: "The path turned away before the target.",
            ClimbEnd.FLAT: f"The {response.name} does not change beyond the noise and misses the target.",
            ClimbEnd.BOUNDED: "The path ends before the target.",
        }[end]
    nearest = quantity(path.loc[best, "mean"], response.unit)
    outcome += f" The nearest step is {best} ({nearest}). {failure_summary(cases, response)}"
    aim = f"until its mean {response.name} has crossed the target, turned away, or met its bounds"
    return Decision(STAGE, f"The climb goes on {aim}.", numbers, outcome.strip())
