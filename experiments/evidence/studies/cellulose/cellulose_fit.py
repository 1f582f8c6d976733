"""The fit of the measured edges: emulators of the simulated ones, generalised least squares, forecasts."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from doe.curves.curve_emulator import CurveEmulator
from doe.curves.curve_fit import CurveFit, MeasuredCurve, fit_curves
from experiments.evidence.studies.cellulose.cellulose_plan import (
    EVERY,
    HELD_BACK,
    MEASURED,
    READING,
    TIED,
    coded,
    factors_of,
    measured,
    natural,
    places,
)
from experiments.evidence.studies.cellulose.drum_edges import area_of_disagreement
from experiments.studyfile import Study

LEVEL = 0.9
"""Probability that bands and ranges hold."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """Fits of the study: walls that roll as they like, and walls that roll as the grains."""

    study: Study
    free: CurveFit
    tied: CurveFit

    @property
    def best(self) -> pd.DataFrame:
        """Best settings with free walls: one row."""
        return natural(self.study, self.free.best)

    def ranges(self, fit: CurveFit) -> pd.DataFrame:
        """Compatible range of each factor, its part of the design, and if it stays open: more than half."""
        ends = np.quantile(fit.settings, [(1 - LEVEL) / 2, 0.5, (1 + LEVEL) / 2], axis=0)
        low, middle, high = (natural(self.study, end).iloc[0] for end in ends)
        part = (ends[2] - ends[0]) / 2.0
        return pd.DataFrame(
            {
                "factor": [factor.name for factor in factors_of(self.study)],
                "best": natural(self.study, fit.best).iloc[0].to_numpy(),
                "low": low.to_numpy(),
                "middle": middle.to_numpy(),
                "high": high.to_numpy(),
                "part of the design": part,
                "open": np.where(part > 0.5, "yes", "no"),
            }
        )

    def correlations(self, fit: CurveFit) -> pd.DataFrame:
        """Correlations of the compatible settings."""
        names = [factor.name for factor in factors_of(self.study)]
        return pd.DataFrame(np.corrcoef(fit.settings.T), names, names)


def calibrate_on(study: Study, table: pd.DataFrame, curves: np.ndarray) -> Calibration:
    """Fit the measured edges with simulated ones [mm], a row a drum."""
    x, emulators = coded(study, table), {}
    for rpm in (*MEASURED, *HELD_BACK):
        rows = np.flatnonzero(table["rpm"] == rpm)
        if len(rows):
            emulators[str(rpm)] = CurveEmulator.of(x[rows], curves[rows])
    across, data = 1e3 * places(), measured_curves()
    free = fit_curves(emulators, across, data, READING, seed=1)
    return Calibration(study, free, fit_curves(emulators, across, data, READING, seed=2, free=TIED))


def measured_curves() -> list[MeasuredCurve]:
    """Measured edges that take part in the fit [mm]."""
    found, across = [], np.round(1e3 * places(), 3)
    for rpm in MEASURED:
        edge = measured_edge(rpm)
        thin = edge.iloc[EVERY // 2 :: EVERY]
        columns = np.searchsorted(across, np.round(thin["x_mm"], 3))
        found.append(MeasuredCurve(str(rpm), float(np.log(rpm)), columns, thin["z50_mm"].to_numpy()))
    return found


def measured_edge(rpm: int) -> pd.DataFrame:
    """Places at which the edge was measured at a speed [mm]."""
    table = measured()
    return table[(table["rpm"] == rpm) & table["z50_mm"].notna()].reset_index(drop=True)


def residuals(rpm: int, curve: np.ndarray) -> np.ndarray:
    """Return simulated less measured edge at every place that was measured [mm]."""
    edge = measured_edge(rpm)
    return np.interp(edge["x_mm"], 1e3 * places(), curve) - edge["z50_mm"].to_numpy()


def residual_table(table: pd.DataFrame, curves: np.ndarray, radius: float) -> pd.DataFrame:
    """Residual of each drum at a measured speed: root mean square, mean and largest [mm], area [mm2]."""
    rows = []
    for number, drum in table[table["rpm"].isin(MEASURED)].iterrows():
        miss, edge = residuals(drum["rpm"], curves[number]), measured_edge(drum["rpm"])
        z = np.interp(edge["x_mm"], 1e3 * places(), curves[number])
        area = area_of_disagreement(
            1e-3 * edge["x_mm"].to_numpy(), 1e-3 * z, 1e-3 * edge["z50_mm"].to_numpy(), radius
        )
        rows.append(
            {
                "stage": drum["stage"],
                "point": drum["point"],
                "rpm": drum["rpm"],
                "rms_mm": float(np.sqrt(np.mean(miss**2))),
                "mean_mm": float(miss.mean()),
                "largest_mm": float(np.abs(miss).max()),
                "area_mm2": 1e6 * area,
            }
        )
    return pd.DataFrame(rows)


def prediction(calibration: Calibration, radius: float) -> pd.DataFrame:
    """Forecast the edges at the speeds that were held back, at every place of the given ones [mm]."""
    x, parts = 1e3 * places(), []
    wall = np.sqrt(np.maximum((1e3 * radius) ** 2 - x**2, 0.0))
    for rpm in HELD_BACK:
        made = calibration.free.forecast(str(rpm), float(np.log(rpm)), LEVEL, seed=rpm)
        ends = {
            name: np.round(np.clip(values, -wall, wall), 3)
            for name, values in (("z_mm", made.expected), ("low", made.low), ("high", made.high))
        }
        parts.append(pd.DataFrame({"rpm": rpm, "x_mm": np.round(x, 3), **ends}))
    return pd.concat(parts, ignore_index=True)
