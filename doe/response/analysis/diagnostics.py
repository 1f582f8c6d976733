"""Diagnostics: influential runs, a better scale of the response, unequal spread."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy import optimize, stats

from doe.arguments import checked_kind, checked_level
from doe.design.anova import settings_of
from doe.design.coefficients import coefficient_table
from doe.errors import DesignError
from doe.response.response_surface import Surface

LAMBDAS = (-2.0, 2.0)
"""Range of powers in the search, as in R's ``boxcox``."""

NAMED_POWERS = {-1.0: "1 / y", -0.5: "1 / sqrt(y)", 0.0: "log(y)", 0.5: "sqrt(y)", 1.0: "y as it is"}


@dataclass(frozen=True)
class BoxCox:
    """Power of the response with the most normal and even residuals; made by ``box_cox``."""

    power: float
    low: float
    high: float
    confidence: float

    @property
    def advice(self) -> str:
        """Transformation to use: the customary power inside the interval that is nearest to the best one."""
        if self.low <= 1.0 <= self.high:
            return NAMED_POWERS[1.0]
        inside = [power for power in NAMED_POWERS if self.low <= power <= self.high]
        return (
            NAMED_POWERS[min(inside, key=lambda p: abs(p - self.power))] if inside else f"y^{self.power:.2f}"
        )

    def __str__(self) -> str:
        return (
            f"Best power {self.power:.2f} ({100.0 * self.confidence:.0f} % interval {self.low:.2f} to "
            f"{self.high:.2f}): use {self.advice}."
        )


def influence(surface: Surface) -> pd.DataFrame:
    """Return the influence of each observation on the fit, with a remark where it is large.

    Returns
    -------
    DataFrame, index of the observations
        response, fitted, residual, leverage, studentized (by all runs), deleted (by the other runs: t on one
        degree of freedom less), cook (Technometrics 19, 1977, p. 15), dffits, remark.
    """
    checked_kind("surface", surface, Surface)
    leverage, studentized = surface.leverage, surface.studentized_residuals
    df, count = surface.residual_df, len(surface.fit.params)
    with np.errstate(divide="ignore", invalid="ignore"):
        deleted = studentized * np.sqrt((df - 1.0) / (df - studentized**2))
        odds = leverage / (1.0 - leverage)
        table = pd.DataFrame(
            {
                "response": surface.response,
                "fitted": surface.fitted,
                "residual": surface.residuals,
                "leverage": leverage,
                "studentized": studentized,
                "deleted": deleted,
                "cook": studentized**2 * odds / count,
                "dffits": deleted * np.sqrt(odds),
            }
        )
    return table.assign(remark=[_remark(row, df, count, len(table)) for _, row in table.iterrows()])


def _remark(row: pd.Series, df: float, count: int, runs: int) -> str:
    """Describe an unusual observation; return an empty text for others."""
    remarks = []
    if np.isnan(row["studentized"]) or row["leverage"] > 1.0 - 1e-9:
        return "fitted exactly: only this run determines one of the terms"
    if df > 1.0 and np.abs(row["deleted"]) > stats.t.isf(0.025 / runs, df - 1.0):
        remarks.append("outlier: further off than noise would be in one of 20 such experiments")
    if row["leverage"] > min(2.0 * count / runs, 0.99):
        remarks.append("far from the other runs: its residual says little")
    if row["cook"] > 1.0:
        remarks.append("draws the fit: without it the coefficients change by more than their error")
    return "; ".join(remarks)


def box_cox(surface: Surface, confidence: float = 0.95) -> BoxCox:
    """Return the power of the response under which the same model fits best (Box and Cox 1964).

    It is the maximum of the profile likelihood between -2 and 2; the interval is where the likelihood is
    within half a chi square of it.

    Raises
    ------
    DesignError
        Responses that are not all positive.
    """
    checked_kind("surface", surface, Surface)
    confidence = checked_level(confidence, "confidence")
    response = surface.response.to_numpy()
    if not (response > 0.0).all():
        raise DesignError(f"responses for Box-Cox must be positive, got {response.min():g}: add a constant")
    basis = np.linalg.qr(np.asarray(surface.fit.model.exog))[0]
    scaled = np.log(response / np.exp(np.log(response).mean()))

    def likelihood(power: float) -> float:
        y = np.expm1(power * scaled) / power if abs(power) > 1e-8 else scaled
        left = y - basis @ (basis.T @ y)
        return -0.5 * len(y) * float(np.log(left @ left))

    grid = np.linspace(*LAMBDAS, 81)
    values = np.array([likelihood(power) for power in grid])
    near = grid[values.argmax()]
    bounds = (max(near - 0.05, LAMBDAS[0]), min(near + 0.05, LAMBDAS[1]))
    best = float(
        optimize.minimize_scalar(lambda p: -likelihood(p), bounds=bounds, options={"xatol": 1e-10}).x
    )
    limit = likelihood(best) - 0.5 * float(stats.chi2.ppf(confidence, 1))
    ends = []
    for end in LAMBDAS:
        inside = likelihood(end) >= limit
        ends.append(
            end if inside else float(optimize.brentq(lambda p: likelihood(p) - limit, *sorted((end, best))))
        )
    return BoxCox(best, ends[0], ends[1], confidence)


@dataclass(frozen=True, eq=False)
class RobustTable:
    """Coefficients with standard errors that hold where the spread differs between settings."""

    table: pd.DataFrame
    """estimate, se (HC3), t, p, vif, and ``usual se`` of one common variance."""
    spread_p: float
    """p of Levene's test that replicates spread alike; NaN where too few settings are replicated."""
    note: str
    """Verdict of the replicates, and the standard errors to use."""

    def __str__(self) -> str:
        return f"{self.table.to_string()}\n{self.note}"


def robust_coefficients(surface: Surface) -> RobustTable:
    """Return coefficients with robust standard errors, and the verdict of the replicates on their spread.

    HC3 (MacKinnon and White, J. Econometrics 29, 1985, p. 305) from statsmodels; the replicates' spreads are
    compared by Levene's test about the medians (Brown and Forsythe 1974), in settings of three or more.
    """
    checked_kind("surface", surface, Surface)
    table = coefficient_table(surface.fit, robust=True)
    table["usual se"] = coefficient_table(surface.fit)["se"]
    p, note = _spread(surface)
    return RobustTable(table, p, note)


def _spread(surface: Surface) -> tuple[float, str]:
    setting = settings_of(surface.points)
    response = surface.response.to_numpy()
    samples = [response[setting == number] for number in np.unique(setting)]
    samples = [sample for sample in samples if len(sample) > 2]
    moved = [np.ptp(np.abs(sample - np.median(sample))) > 0.0 for sample in samples]
    if len(samples) < 2 or not any(moved):
        return (
            np.nan,
            "Fewer than two settings have three or more replicates: their spread cannot be compared.",
        )
    p = float(stats.levene(*samples, center="median").pvalue)
    if p < 0.05:
        return p, f"Replicates spread differently between settings (p = {p:.2g}): use the robust errors."
    return p, f"Replicates spread alike between settings (p = {p:.2g}): the usual errors serve."
