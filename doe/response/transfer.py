"""A surface in another process: shifted and scaled by a few runs there.

Two simulators of one test, or a simulator and a laboratory, seldom agree, but their responses to the factors
are of one shape: y = t + shift + scale (s(x) - t), with s the surface of the first and t a reference level,
e.g. the target. Shift and scale are estimated by generalized least squares, with the noise of the runs,
estimated by restricted likelihood, and the common error of the surface. That the scale is 1 within a quarter
is prior knowledge (mixed estimation; Theil and Goldberger 1961), so that noise alone cannot make it nearly
zero. Further information of the runs moves the surface within its own errors (best linear unbiased
prediction; Harville 1977, Kennedy and O'Hagan 2001 with a constant scale).
"""

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
from doe.response import region, surface_points
from doe.response.quadratic import QuadraticForm
from doe.response.response_surface import Surface

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
    def residual_df(self) -> float:
        """Degrees of freedom of the noise."""
        return float(len(self.response) - 2)

    def intervals(self, alpha: float = 0.05) -> dict[str, tuple[float, float]]:
        """Return the intervals of ``shift`` and ``scale`` that hold with probability 1 - alpha each."""
        reach = stats.t.isf(0.5 * arguments.checked_level(alpha), self.residual_df) * self._fit.bse
        return {
            name: (float(value - width), float(value + width))
            for name, value, width in zip(("shift", "scale"), self._fit.params, reach, strict=True)
        }

    def evaluate(self, coded: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return mean and standard error in the other process at coded points, (points, factors)."""
        points = arguments.checked_points(coded, len(self.design.names))
        own, common = self._columns(points), self._common(points)
        weighed = np.linalg.solve(self._covariance, np.column_stack([self._leftover, common.T]))
        mean = self.level + own @ self._fit.params + common @ weighed[:, 0]
        gap = own - common @ np.linalg.solve(self._covariance, self._columns(self.points))
        prior = self.weight**2 * _quadratic(self._rows(points), self._surface_covariance)
        variance = prior - np.einsum("ij,ji->i", common, weighed[:, 1:])
        variance += _quadratic(gap, self._fit.normalized_cov_params)
        return mean, np.sqrt(np.maximum(self._fit.scale * variance, 0.0))

    @cached_property
    def quadratic_form(self) -> QuadraticForm:
        """Mean in the other process as a polynomial in coded units."""
        whole = self.source.unselected
        terms = (INTERCEPT, *whole.terms)
        own = dict(zip((INTERCEPT, *self.source.terms), self.source.coded_coefficients, strict=True))
        moved = self.weight * self._surface_covariance @ self._rows(self.points).T
        moved = self.weight * moved @ np.linalg.solve(self._covariance, self._leftover)
        values = [self.scale * own.get(term, 0.0) + more for term, more in zip(terms, moved, strict=True)]
        values[0] += self.level + self.shift - self.scale * self.level
        return QuadraticForm.of(self.design.names, terms[1:], values)

    nearest = surface_points.nearest
    compatible_region = region.compatible_region

    # ---- parts of the model --------------------------------------------------------------------------------

    def _columns(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the columns of shift and scale relative to the level, (points, 2)."""
        columns = model_values(points, self.design.names, self.source.terms)
        values = columns @ self.source.coded_coefficients.to_numpy()
        return np.column_stack([np.ones(len(points)), values - self.level])

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
        return self.weight**2 * self._rows(points) @ self._surface_covariance @ self._rows(self.points).T

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
    return np.append(below, 1.0), np.vstack([columns, [0.0, 1.0]])


def _with_prior_variance(found: Transfer, covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the covariance of those responses."""
    if not np.isfinite(found.scale_sd):
        return covariance
    return block_diag(covariance, found.scale_sd**2)


def _quadratic(rows: NDArray[np.float64], matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return r'Mr of every row r."""
    return np.asarray(np.einsum("ij,jk,ik->i", rows, matrix, rows))


def transfer(
    source: Surface, runs: pd.DataFrame, response: ArrayLike, level: float, scale_sd: float = SCALE_SD
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

    Raises
    ------
    DesignError
        Fewer than four runs, a value that is not finite, or runs with equal values of the surface, which
        cannot separate shift from scale.
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
    if len(points) < LEAST_RUNS:
        raise DesignError(f"runs must be {LEAST_RUNS} or more, got {len(points)}")
    if not (np.isfinite(values).all() and np.isfinite(points).all()):
        raise DesignError("runs and responses must be finite, got NaN or infinity")
    distance = np.abs(arguments.checked_number("the level", level) - values).max()
    if distance > FARTHEST * max(float(np.ptp(values)), float(np.ptp(source.fitted))):
        raise DesignError(f"the level must be among the responses or near them, got {level:g}")
    arguments.checked_df("scale_sd, the standard deviation of the scale,", scale_sd)
    found = Transfer(source, float(level), points, values, 1.0, 1.0, scale_sd)
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


def _inside(
    origin: NDArray[np.float64], direction: NDArray[np.float64], step: float, box: float
) -> NDArray[np.float64]:
    """Return the point a step away, or as far as the box allows."""
    with np.errstate(divide="ignore", invalid="ignore"):
        room = np.where(direction != 0.0, (box - origin * np.sign(direction)) / np.abs(direction), np.inf)
    return origin + min(step, float(room.min())) * direction
