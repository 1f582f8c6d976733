"""The steepest path: from a first-order model along its gradient, or in fixed natural steps."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from doe.design import Design, numbered, observations
from doe.errors import DesignError
from doe.factors import Factor, coded_points
from doe.screening import ScreenResult
from doe.surface import Surface

ROUNDING = 1e-12
"""Slope relative to the largest coefficient below which it is a rounding error of the fit."""


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
    """Return ``steps + 1`` runs from a start along the direction in which the response rises.

    Parameters
    ----------
    fit : ScreenResult or Surface
        Gives the direction by its linear coded coefficients.
    steps : int
        Number of moves; the first run is the start itself.
    factors : names, optional
        Factors that move; default all.
    step : float or mapping of positive natural steps by factor
        A number: the textbook path, every factor moves in proportion to its coded coefficient, and the
        strongest one by ``step`` coded units. A mapping: fixed natural steps; the model gives their signs
        alone.
    start : mapping of natural values by factor, optional
        Default: the factors' centers.
    limits : mapping of (low, high) natural values by factor, optional
        A factor that reaches its limit stays there while the others go on; the path ends where none moves.
    descend : bool
        Go down instead of up.

    Raises
    ------
    DesignError
        An unknown factor, a step that is not positive, a start outside its limits, no slope at all.
    """
    if steps < 1:
        raise DesignError(f"a path has at least one step, received {steps}")
    moving = [fit.design.factor(name) for name in (factors if factors is not None else fit.design.names)]
    names = [factor.name for factor in moving]
    _check_names(
        names, step=step if isinstance(step, Mapping) else {}, start=start or {}, limits=limits or {}
    )
    coefficients = fit.coded_coefficients
    slopes = coefficients[names].to_numpy() * (-1.0 if descend else 1.0)
    if not np.abs(slopes).max() > ROUNDING * coefficients.abs().max():
        raise DesignError(f"no direction to climb: the response has no slope in {', '.join(names)}")
    stride = _natural_stride(moving, slopes, step)
    begin = np.array([(start or {}).get(factor.name, factor.center) for factor in moving])
    table = numbered(pd.DataFrame(_walk(names, begin, stride, steps, limits or {}), columns=names))
    coded = coded_points(moving, table)
    return ClimbPath(tuple(moving), coded, predicted=_predicted(fit, coded))


def climb_table(path: Design, response: ArrayLike, target: float) -> pd.DataFrame:
    """Return natural settings, mean response, error against the target and its size in percent, by run."""
    _, values = observations(path, response)
    table = path.natural.copy()
    table["response"] = values.groupby(level=0, sort=False).mean()
    table["error"] = table["response"] - target
    table["error_percent"] = 100.0 * table["error"].abs() / abs(target)
    return table


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
        if not (np.isfinite(step) and step > 0.0):
            raise DesignError(f"step must be positive and finite, received {step}")
        return step * slopes / np.abs(slopes).max() * np.array([factor.half_range for factor in factors])
    for factor in factors:
        size = step.get(factor.name)
        if size is None or not (np.isfinite(size) and size > 0.0):
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
    low, high = np.array([limits.get(name, (-np.inf, np.inf)) for name in names], dtype=float).T
    for name, value, bottom, top in zip(names, begin, low, high, strict=True):
        if not bottom <= value <= top:
            raise DesignError(
                f"the start lies inside the limits: {name!r} is {value}, limits {bottom} to {top}"
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
