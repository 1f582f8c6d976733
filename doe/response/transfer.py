"""A surface in another process: shifted and scaled by a few runs there.

Two simulators of one test, or a simulator and a laboratory, seldom agree, but their responses to the factors
are of one shape: y = t + shift + scale (s(x) - t), with s the surface of the first and t a reference level,
e.g. the target. Shift and scale are estimated by generalized least squares, with the noise of the runs,
estimated by restricted likelihood, and the common error of the surface. That the scale is 1 within a quarter
is prior knowledge (mixed estimation; Theil and Goldberger 1961), so that noise alone cannot make it nearly
zero. With slopes, the difference of the two also changes linearly with each factor. Further information of
the runs moves the surface within its own errors (best linear unbiased prediction; Harville 1977, Kennedy and
O'Hagan 2001 with a constant scale).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy import optimize, stats
from scipy.linalg import block_diag
from statsmodels.regression.linear_model import GLS

from doe import arguments
from doe.design.design import Design, coded_points, coded_setting, natural_points
from doe.design.polynomial_terms import INTERCEPT, model_values
from doe.errors import DesignError
from doe.response import contour as contours
from doe.response import region, surface_points
from doe.response.quadratic import QuadraticForm
from doe.response.response_surface import Surface
from doe.samples.sample import Sample

SCALE_SD = 0.25
"""Prior standard deviation of the scale about 1."""

FARTHEST = 1e4
"""Distance of the level from the responses over their range above which shift and scale are inseparable."""

LEAST_RUNS = 4
"""Least number of runs: with shift and scale estimated they leave a spread."""

ROUNDS = 20
"""Largest number of rounds of estimating the scale, which weighs the surface's own error."""

SETTLED = 1e-3
"""Change of the scale that ends these rounds."""

LOWEST_NOISE = 1e-3
"""Least standard deviation of a run in the search, as a part of the responses' spread."""


LITTLE = 1e-3
"""Information on each coefficient before the first run, which alone could not tell the candidates apart."""

ENDS = (("low", -1.0), ("high", 1.0))
"""Ends of an interval."""


@dataclass(frozen=True, eq=False)
class Transfer:
    """A surface in another process; made by ``transfer``. It has contours, optima and regions."""

    source: Surface
    level: float
    """Response that shift and scale are relative to."""
    points: NDArray[np.float64]
    """Coded settings of the runs of the other process, (runs, factors)."""
    response: NDArray[np.float64]
    """Responses of the runs, (runs,)."""
    noise: float
    """Standard deviation of one of them."""
    weight: float
    """Scale that weighs the surface's own error."""
    scale_sd: float = SCALE_SD
    """Prior standard deviation of the scale about 1; infinite: no prior."""
    slopes: bool = False
    """The difference of the processes changes with each factor, too."""
    dropped: tuple[str, ...] = ()
    """Terms that were left out, as of a reduced surface: none."""

    @property
    def design(self) -> Design:
        """Design of the source, whose factors and coding hold."""
        return self.source.design

    @cached_property
    def _fit(self):  # type: ignore[no-untyped-def]  # statsmodels has no types
        return GLS(*_with_prior(self), sigma=_with_prior_variance(self, self._covariance)).fit()

    @property
    def shift(self) -> float:
        """Difference of the processes where the surface has the level."""
        return float(self._fit.params[0])

    @property
    def scale(self) -> float:
        """Change of the other process's response per change of the surface's."""
        return float(self._fit.params[1])

    @property
    def slope_values(self) -> NDArray[np.float64]:
        """Slopes of the difference of the processes, a coded unit; empty without slopes."""
        return np.asarray(self._fit.params[2:])

    @property
    def residual_df(self) -> float:
        """Degrees of freedom of the noise."""
        return float(len(self.response) - self._columns(self.points).shape[1])

    def intervals(self, alpha: float = 0.05) -> dict[str, tuple[float, float]]:
        """Return the intervals of ``shift`` and ``scale`` that hold with probability 1 - alpha each."""
        reach = stats.t.isf(0.5 * arguments.checked_level(alpha), self.residual_df) * self._fit.bse
        return {
            name: (float(value - width), float(value + width))
            for name, value, width in zip(("shift", "scale"), self._fit.params, reach, strict=False)
        }

    def evaluate(self, coded: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return mean and standard error in the other process at coded points, (points, factors)."""
        points = arguments.checked_points(coded, len(self.design.names))
        own, common = self._columns(points), self._common(points)
        mean = self.level + own @ self._fit.params + common @ (self._inverse @ self._leftover)
        gap = own - common @ (self._inverse @ self._columns(self.points))
        prior = self.weight**2 * _quadratic(self._rows(points), self._surface_covariance)
        variance = prior - _quadratic(common, self._inverse)
        variance += _quadratic(gap, self._fit.normalized_cov_params)
        return mean, np.sqrt(np.maximum(self._fit.scale * variance, 0.0))

    @cached_property
    def quadratic_form(self) -> QuadraticForm:
        """Mean in the other process as a polynomial in coded units."""
        whole = self.source.unselected
        terms = (INTERCEPT, *whole.terms)
        own = dict(zip((INTERCEPT, *self.source.terms), self.source.coded_coefficients, strict=True))
        moved = self._moving @ (self._inverse @ self._leftover)
        values = [self.scale * own.get(term, 0.0) + more for term, more in zip(terms, moved, strict=True)]
        values[0] += self.level + self.shift - self.scale * self.level
        for name, slope in zip(self.design.names, self.slope_values, strict=False):
            values[terms.index((name,))] += slope
        return QuadraticForm.of(self.design.names, terms[1:], values)

    @property
    def runs(self) -> pd.DataFrame:
        """Settings of the runs of the other process, natural units."""
        return natural_points(self.design.factors, pd.DataFrame(self.points, columns=self.design.names))

    contour = contours.contour
    nearest = surface_points.nearest
    compatible_region = region.compatible_region

    def agrees(self, point: Mapping[str, float], target: Sample, alpha: float = 0.05) -> bool:
        """Return True if a target does not contradict one setting, natural units."""
        return region.agrees(self, coded_setting("point", point, self.design.factors)[None], target, alpha)

    def predict(self, points: pd.DataFrame | Mapping[str, float], alpha: float = 0.05) -> pd.DataFrame:
        """Predict the response of the other process; columns as of ``Surface.predict``, natural units."""
        table = points if isinstance(points, pd.DataFrame) else pd.DataFrame([points])
        mean, se = self.evaluate(coded_points(self.design.factors, table).to_numpy())
        reach = stats.t.isf(0.5 * arguments.checked_level(alpha), self.residual_df)
        errors = {"confidence": reach * se, "prediction": reach * np.hypot(se, self.noise)}
        ends = {f"{kind}_{end}": mean + sign * error for kind, error in errors.items() for end, sign in ENDS}
        return pd.DataFrame({"mean": mean, "se": se} | ends, index=table.index)

    # ---- parts of the model --------------------------------------------------------------------------------

    def _columns(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the columns of shift, scale relative to the level, and slopes, (points, 2 or more)."""
        columns = model_values(points, self.design.names, self.source.terms)
        values = columns @ self.source.coded_coefficients.to_numpy()
        each = points if self.slopes else points[:, :0]
        return np.column_stack([np.ones(len(points)), values - self.level, each])

    def _rows(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the terms of the model whose errors are the surface's, (points, terms)."""
        return model_values(points, self.design.names, self.source.unselected.terms)

    @cached_property
    def _surface_covariance(self) -> NDArray[np.float64]:
        whole = self.source.unselected
        count = len(whole.terms) + 1
        return whole.fit.cov_params().to_numpy()[:count, :count]

    def _common(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the covariance of the surface's error at points and at the runs, (points, runs)."""
        return self._rows(points) @ self._moving

    @cached_property
    def _moving(self) -> NDArray[np.float64]:
        """Covariance of the surface's coefficients and its error at the runs, (terms, runs)."""
        return self.weight**2 * self._surface_covariance @ self._rows(self.points).T

    @cached_property
    def _inverse(self) -> NDArray[np.float64]:
        """Inverse of the covariance of the runs' responses."""
        return np.asarray(np.linalg.inv(self._covariance))

    @cached_property
    def _covariance(self) -> NDArray[np.float64]:
        """Covariance of the runs' responses about shift and scale."""
        return self.noise**2 * np.eye(len(self.response)) + self._common(self.points)

    @cached_property
    def _leftover(self) -> NDArray[np.float64]:
        return self.response - self.level - self._columns(self.points) @ self._fit.params


def _with_prior(found: Transfer) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return responses and columns of shift and scale, with the prior of the scale as one more run."""
    below, columns = found.response - found.level, found._columns(found.points)
    if not np.isfinite(found.scale_sd):
        return below, columns
    return np.append(below, 1.0), np.vstack([columns, np.eye(columns.shape[1])[1]])


def _with_prior_variance(found: Transfer, covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the covariance of those responses."""
    if not np.isfinite(found.scale_sd):
        return covariance
    return block_diag(covariance, found.scale_sd**2)


def _quadratic(rows: NDArray[np.float64], matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return r'Mr of every row r."""
    return np.asarray(np.einsum("ij,jk,ik->i", rows, matrix, rows))


def transfer(
    source: Surface,
    runs: pd.DataFrame,
    response: ArrayLike,
    level: float,
    scale_sd: float = SCALE_SD,
    slopes: bool = False,
) -> Transfer:
    """Carry a surface over to another process by a few runs there.

    Parameters
    ----------
    runs : DataFrame, one row per run
        A column for each factor, natural units.
    response : array-like, shape (runs,)
    level : float
        Response that shift and scale are relative to: the target. They are then nearly uncorrelated.
    scale_sd : float
        Prior standard deviation of the scale about 1; infinite: no prior.
    slopes : bool
        Let the difference of the processes change linearly with each factor, too.

    Raises
    ------
    DesignError
        Fewer than four runs, with slopes four and one a factor, a value that is not finite, or runs with
        equal values of the surface, which cannot separate shift from scale.
    """
    arguments.checked_kind("source", source, Surface)
    arguments.checked_kind("runs", runs, pd.DataFrame)
    values = arguments.real_array("a response", response)
    missing = [name for name in source.design.names if name not in runs.columns]
    if missing:
        raise DesignError(f"no column for factor {missing[0]!r}; the runs have {list(runs.columns)}")
    natural = {name: arguments.real_array(f"the runs' {name!r}", runs[name]) for name in source.design.names}
    table = coded_points(source.design.factors, pd.DataFrame(natural))
    points = pd.DataFrame(table)[source.design.names].to_numpy(dtype=np.float64)
    if values.shape != (len(points),):
        raise DesignError(f"response must be one number for each of {len(points)} runs, got {values.shape}")
    least = LEAST_RUNS + (points.shape[1] if slopes else 0)
    if len(points) < least:
        raise DesignError(f"runs must be {least} or more, got {len(points)}")
    if not (np.isfinite(values).all() and np.isfinite(points).all()):
        raise DesignError("runs and responses must be finite, got NaN or infinity")
    distance = np.abs(arguments.checked_number("the level", level) - values).max()
    if distance > FARTHEST * max(float(np.ptp(values)), float(np.ptp(source.fitted))):
        raise DesignError(f"the level must be among the responses or near them, got {level:g}")
    arguments.checked_df("scale_sd, the standard deviation of the scale,", scale_sd)
    found = Transfer(source, float(level), points, values, 1.0, 1.0, scale_sd, slopes)
    if np.ptp(found._columns(points)[:, 1]) <= 1e-9 * max(1.0, float(np.ptp(source.fitted))):
        raise DesignError(
            "runs must differ in their values of the surface, to separate shift and scale; all have one value"
        )
    for _ in range(ROUNDS):
        before = found.weight
        found = _with_noise(found)
        found = replace(found, weight=found.scale)
        if abs(found.weight - before) < SETTLED:
            break
    return found


def _with_noise(found: Transfer) -> Transfer:
    """Return the transfer with the noise of the highest restricted likelihood at its weight."""
    spread = float(np.std(found.response, ddof=1))
    if not spread > 0.0:
        raise DesignError("responses must differ, to show their noise; all are the same")
    below, columns = _with_prior(found)
    common = found._common(found.points)

    def lack(log_noise: float) -> float:
        covariance = _with_prior_variance(found, np.exp(2.0 * log_noise) * np.eye(len(common)) + common)
        inverse = np.linalg.inv(covariance)
        normal = columns.T @ inverse @ columns
        left = below - columns @ np.linalg.solve(normal, columns.T @ inverse @ below)
        logs = np.linalg.slogdet(covariance)[1] + np.linalg.slogdet(normal)[1]
        return float(logs + left @ inverse @ left)

    ends = (np.log(LOWEST_NOISE * spread), np.log(3.0 * spread))
    best = optimize.minimize_scalar(lack, bounds=ends, method="bounded", options={"xatol": 1e-6})
    return replace(found, noise=float(np.exp(best.x)))


def transfer_points(
    source: Surface, at: dict[str, float], count: int, step: float = 0.7, extent: float = 1.0, turn: int = 0
) -> pd.DataFrame:
    """Place runs around a point of a surface: there, across its contour, and along it; in natural units.

    Runs across determine the scale, those there and across together the shift; runs along show if the factors
    trade off alike. The order is there, up, down, and to both sides, repeatedly, so that any count is as
    balanced as possible.

    Parameters
    ----------
    at : mapping of natural values by factor
    step, extent : float
        Coded distance of the outer runs, and coded half width of the box of all runs.
    turn : int
        Number of the direction along the contour, if there are more than two factors.
    """
    arguments.checked_kind("source", source, Surface)
    names = source.design.names
    origin = coded_setting("at", at, source.design.factors)
    count, turn = (
        arguments.checked_count("count", count, most=arguments.MOST),
        arguments.checked_count("turn", turn, least=0),
    )
    step, extent = (
        arguments.checked_number("step", step, above=0.0),
        arguments.checked_number("extent", extent, above=0.0),
    )
    slope = source.quadratic_form.gradient(origin)
    if not np.linalg.norm(slope) > 0.0:
        raise DesignError(f"the surface must rise or fall at the point, got {at}")
    across = slope / np.linalg.norm(slope)
    directions = [np.zeros(len(names)), across, -across]
    if len(names) > 1:
        others = np.linalg.svd(across[None])[2][1:]
        along = others[turn % len(others)]
        directions += [along, -along]
    box = max(extent, float(np.abs(origin).max()))
    rows = [_inside(origin, directions[i % len(directions)], step, box) for i in range(count)]
    return natural_points(source.design.factors, pd.DataFrame(rows, columns=names)).reset_index(drop=True)


def spread_points(source: Surface, cells: ArrayLike, count: int, made: ArrayLike) -> NDArray[np.float64]:
    """Choose runs from which a difference that is linear in the factors is best known over some cells.

    One run after another is the point of the source's design that makes the mean variance over the cells
    smallest (I-optimality), then each is exchanged for the best one next to the others. One may come twice.

    Parameters
    ----------
    cells, made : array-like, shape (any number, factors)
        Coded places of interest, and runs that are there already.

    Returns
    -------
    array, shape (count, factors)
    """
    design = arguments.checked_kind("source", source, Surface).design
    whole = design.points.drop_duplicates().to_numpy(dtype=np.float64)
    places, there = (arguments.checked_points(each, whole.shape[1]) for each in (cells, made))
    count = arguments.checked_count("count", count, most=arguments.MOST)
    rows = np.column_stack([np.ones(len(whole)), whole])
    spread = np.column_stack([np.ones(len(places)), places])
    spread = spread.T @ spread / len(places)
    before = np.column_stack([np.ones(len(there)), there])
    known = LITTLE * np.eye(rows.shape[1]) + before.T @ before
    products = np.einsum("ij,ik->ijk", rows, rows)

    def best(known: NDArray[np.float64]) -> int:
        return int(np.trace(np.linalg.solve(known + products, spread), axis1=1, axis2=2).argmin())

    chosen: list[int] = []
    for _ in range(count):
        chosen.append(best(known + products[chosen].sum(axis=0)))
    for place in [*range(count)] * 3:  # then no run changes any more
        others = chosen[:place] + chosen[place + 1 :]
        chosen[place] = best(known + products[others].sum(axis=0))
    return np.asarray(whole[chosen])


def _inside(
    origin: NDArray[np.float64], direction: NDArray[np.float64], step: float, box: float
) -> NDArray[np.float64]:
    """Return the point a step away, or as far as the box allows."""
    with np.errstate(divide="ignore", invalid="ignore"):
        room = np.where(direction != 0.0, (box - origin * np.sign(direction)) / np.abs(direction), np.inf)
    return origin + min(step, float(room.min())) * direction
