"""The steepest path: along the gradient of a fitted model at its start, or in fixed natural steps."""

import numbers
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from doe import arguments
from doe.design.design import Design, coded_points, numbered, observations
from doe.design.factors import Factor
from doe.errors import DesignError
from doe.response.response_surface import Surface
from doe.screen.screened_effects import ScreenResult

ROUNDING = 1e-12
"""Slope relative to the largest coefficient that counts as a rounding error."""

CLIMB_COLUMNS = {"response", "error", "error_percent"}
"""Columns of the table of a climb besides the factors."""


@dataclass(frozen=True, eq=False)
class ClimbPath(Design):
    """Runs along a steepest path, the first at its start."""

    predicted: pd.Series = field(default_factory=lambda: pd.Series(dtype=float))
    """Response that the model predicts for every run (factors off the path at their centers)."""


def steepest_path(
    fit: ScreenResult | Surface,
    steps: int,
    *,
    factors: Sequence[str] | None = None,
    step: float | Mapping[str, float] = 1.0,
    start: Mapping[str, float] | None = None,
    limits: Mapping[str, tuple[float, float]] | None = None,
    descend: bool = False,
) -> ClimbPath:
    """Return up to ``steps + 1`` runs from a start along the direction in which the response rises.

    Parameters
    ----------
    fit : ScreenResult or Surface
        Model whose gradient at the start, in coded units, gives the direction. Factors off the path are at
        their centers.
    steps : int
        Number of moves; the first run is the start itself. The path of a quadratic ends before the first run
        without a predicted rise.
    factors : names, optional
        Factors that move. Default: all.
    step : float or mapping of positive natural steps by factor
        A number: every factor moves in proportion to its component of the gradient, and the strongest one by
        ``step`` coded units. A mapping: fixed natural steps; the model gives their signs alone.
    start : mapping of natural values by factor, optional
        Default: the factors' centers.
    limits : mapping of (low, high) natural values by factor, optional
        A factor stops at its limit while the others go on; the path ends when all have stopped.
    descend : bool
        Go down instead of up.

    Raises
    ------
    DesignError
        An unknown factor, a step that is not positive, a start outside its limits, no slope, or a first step
        over the top of a quadratic.
    """
    if not isinstance(fit, ScreenResult | Surface):
        raise DesignError(f"fit must be a ScreenResult or a Surface, got {fit!r}")
    steps = arguments.checked_count("steps of a path", steps, most=arguments.MOST)
    chosen = fit.design.names if factors is None else arguments.checked_list("factors", factors)
    moving = [fit.design.factor(name) for name in chosen]
    if not moving:
        raise DesignError("factors must be one or more, got an empty list")
    names = [factor.name for factor in moving]
    start = {} if start is None else arguments.checked_map("start", start)
    limits = {} if limits is None else arguments.checked_map("limits", limits)
    _check_names(names, step=step if isinstance(step, Mapping) else {}, start=start, limits=limits)
    begin = np.array([_start(factor, start) for factor in moving])
    sign = -1.0 if arguments.checked_flag("descend", descend) else 1.0
    slopes = sign * _gradient(fit, moving, begin)
    if not np.abs(slopes).max() > ROUNDING * fit.coded_coefficients.abs().max():
        raise DesignError(f"no direction to climb: the response has no slope in {', '.join(names)}")
    stride = _natural_stride(moving, slopes, step)
    table = numbered(pd.DataFrame(_walk(names, begin, stride, steps, limits), columns=names))
    coded = coded_points(moving, table)
    predicted = _predicted(fit, coded)
    falls = np.flatnonzero(~(sign * np.diff(predicted) > 0.0))
    if len(falls) and isinstance(fit, Surface):
        if falls[0] == 0:
            raise DesignError(
                f"the first step leads over the {'bottom' if descend else 'top'}: from {predicted.iloc[0]:g} "
                f"the surface predicts {predicted.iloc[1]:g}; take a smaller step than {step!r}"
            )
        coded, predicted = coded.iloc[: falls[0] + 1], predicted.iloc[: falls[0] + 1]
    return ClimbPath(tuple(moving), coded, predicted=predicted)


def climb_table(path: Design, response: ArrayLike, target: float) -> pd.DataFrame:
    """Return natural settings, mean response, error against the target and its size in percent, by run.

    A labelled response is read by the path's run labels; the percent of a target of 0 is NaN.
    """
    target = arguments.checked_number("target", target)
    arguments.checked_kind("path", path, Design)
    _, values = observations(path, response)
    taken = sorted(set(path.names) & CLIMB_COLUMNS)
    if taken:
        raise DesignError(f"{taken[0]!r} names a column of the climb's table: give the factor another name")
    table = path.natural.copy()
    table["response"] = values.groupby(level=0, sort=False).mean()
    table["error"] = table["response"] - target
    table["error_percent"] = 100.0 * table["error"].abs() / (abs(target) or np.nan)
    return table


def _start(factor: Factor, start: Mapping[str, float]) -> float:
    return arguments.checked_number(f"the start of {factor.name!r}", start.get(factor.name, factor.center))


def _gradient(
    fit: ScreenResult | Surface, moving: list[Factor], begin: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the coded gradient's components of the moving factors at the start."""
    names = [factor.name for factor in moving]
    if isinstance(fit, ScreenResult):
        return fit.coded_coefficients[names].to_numpy(dtype=np.float64)
    places = [fit.design.names.index(name) for name in names]
    point = np.zeros(len(fit.design.names))
    point[places] = [factor.to_coded(value) for factor, value in zip(moving, begin, strict=True)]
    return fit.quadratic_form.gradient(point)[places]


def _check_names(names: list[str], **mappings: Mapping) -> None:
    for place, mapping in mappings.items():
        unknown = [name for name in mapping if name not in names]
        if unknown:
            raise DesignError(f"{place} names {unknown[0]!r}, which is not on the path of {', '.join(names)}")


def _natural_stride(
    factors: list[Factor], slopes: NDArray, step: float | Mapping[str, float]
) -> NDArray[np.float64]:
    """Return the signed natural move of each factor in one step."""
    if not isinstance(step, Mapping):
        step = arguments.checked_number("step", step, above=0.0)
        return step * slopes / np.abs(slopes).max() * np.array([factor.half_range for factor in factors])
    for factor in factors:
        size = step.get(factor.name)
        if not isinstance(size, numbers.Real) or not (np.isfinite(size) and size > 0.0):
            raise DesignError(
                f"a natural step must be positive and finite for every factor: {factor.name!r} has {size}"
            )
    return np.sign(slopes) * np.array([step[factor.name] for factor in factors])


def _walk(
    names: list[str],
    begin: NDArray[np.float64],
    stride: NDArray[np.float64],
    steps: int,
    limits: Mapping[str, tuple[float, float]],
) -> NDArray[np.float64]:
    """Return the natural points of a path inside the limits, shape (points, factors)."""
    pairs = [
        arguments.real_array(f"the limits of {name!r}", limits.get(name, (-np.inf, np.inf))) for name in names
    ]
    for name, pair in zip(names, pairs, strict=True):
        if pair.shape != (2,):
            raise DesignError(f"the limits of {name!r} must be a low and a high value, got {limits[name]!r}")
    low, high = np.array(pairs).T
    for name, value, bottom, top in zip(names, begin, low, high, strict=True):
        if not bottom <= value <= top:
            raise DesignError(
                f"the start must be inside the limits: {name!r} is {value}, limits {bottom} to {top}"
            )
    points = np.clip(begin + np.arange(steps + 1)[:, None] * stride, low, high)
    moved = np.r_[True, np.any(np.diff(points, axis=0) != 0.0, axis=1)]
    return points[moved]


def _predicted(fit: ScreenResult | Surface, coded: pd.DataFrame) -> pd.Series:
    """Return the model's response along the path; factors off the path are at their centers."""
    everywhere = coded.reindex(columns=fit.design.names, fill_value=0.0)
    if isinstance(fit, Surface):
        mean, _ = fit.evaluate(everywhere)
    else:
        coefficients = fit.coded_coefficients
        mean = coefficients["intercept"] + everywhere.to_numpy() @ coefficients[fit.design.names].to_numpy()
    return pd.Series(mean, index=coded.index, name="predicted")
