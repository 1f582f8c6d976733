"""The fit of the seven data: settings of the grain, and a friction for each wall."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from doe.curves.compatible import compatible_points, even_points
from doe.curves.curve_emulator import CurveEmulator
from experiments.evidence.studies.wheat.wheat_plan import GRAIN, RESPONSES, SETTINGS, SHELLS, Datum
from experiments.studyfile import Study

LEVEL = 0.9
"""Probability that ranges hold."""

OPEN = 0.5
"""A setting stays open where its range is more than this part of what the design explored."""


@dataclass(frozen=True, eq=False)
class Bench:
    """Emulated tests of a bench, whose settings are those of one case: grain, wall, and a drum's cover."""

    emulators: Mapping[str, CurveEmulator]
    """Emulator of each scene."""

    @classmethod
    def of(cls, study: Study, table: pd.DataFrame) -> Bench:
        """Fit all to simulated cases: a table with their settings, ``scene`` and what they measure."""
        made = {}
        for scene, response in RESPONSES.items():
            rows = table[(table["scene"] == scene) & table[response].notna()]
            factors = study.factors if response == "dynamic_angle" else study.factors[:-1]
            coded = np.column_stack([(rows[f.name] - f.center) / f.half_range for f in factors])
            made[scene] = CurveEmulator.of(coded, rows[[response]].to_numpy(float))
        return cls(made)

    def predict(self, settings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Predict the data at coded `SETTINGS`, and the variances of the means, (points, data) each.

        The cover is of the last of the shells' materials; level, the mean over the shells was measured. The
        bed of the density is poured into steel.
        """
        grain, walls = settings[:, : len(GRAIN)], settings[:, len(GRAIN) :].T
        shells, tube = walls[: len(SHELLS)], walls[-1]
        drums = [np.column_stack([grain, wall, shells[-1]]) for wall in shells]
        level = [self.emulators["target"].predict(drum) for drum in drums]
        found = [(np.mean([mean for mean, _ in level], axis=0), np.mean([own for _, own in level], axis=0))]
        found += [self.emulators["inclined"].predict(drum) for drum in drums]
        found += [
            self.emulators[scene].predict(np.column_stack([grain, wall]))
            for scene, wall in (("heap", tube), ("bed", shells[SHELLS.index("steel")]))
        ]
        means, variances = zip(*found, strict=True)
        return np.hstack(means), np.hstack(variances)


@dataclass(frozen=True, eq=False)
class WheatFit:
    """Settings that some of the data are compatible with."""

    tests: Bench
    data: Mapping[str, Datum]
    """All data, by name."""
    settings: np.ndarray
    """Coded `SETTINGS`, as likely as one another."""
    best: np.ndarray
    chi2: float
    """Values at the best settings."""

    def predictions(self, seed: int = 0) -> pd.DataFrame:
        """Compare each datum (index ``datum``) with what the settings predict: the best, and its range.

        A mean of ``agrees`` is inside the range, its own error allowed for.
        """
        means, variances = self.tests.predict(self.settings)
        drawn = means + np.random.default_rng(seed).normal(size=means.shape) * np.sqrt(variances)
        low, high = np.quantile(drawn, [(1 - LEVEL) / 2, (1 + LEVEL) / 2], axis=0)
        measured, errors = np.array(list(self.data.values())).T
        inside = (measured >= low - 1.645 * errors) & (measured <= high + 1.645 * errors)
        columns = {"measured": measured, "error": errors, "best": self.tests.predict(self.best[None])[0][0]}
        columns |= {"low": low, "high": high, "agrees": np.where(inside, "yes", "no")}
        return pd.DataFrame(columns, index=pd.Index(self.data, name="datum"))

    def ranges(self, study: Study) -> pd.DataFrame:
        """Compatible range of each setting (index), in natural units, and its part of what was explored."""
        factors = {factor.name: factor for factor in study.factors}
        own = [factors.get(name, factors["mu_wall"]) for name in SETTINGS]
        center, half = np.array([(factor.center, factor.half_range) for factor in own]).T
        low, high = np.quantile(self.settings, [(1 - LEVEL) / 2, (1 + LEVEL) / 2], axis=0)
        values = {"best": center + half * self.best, "low": center + half * low, "high": center + half * high}
        return pd.DataFrame(values | {"part": (high - low) / 2.0}, index=pd.Index(SETTINGS, name="setting"))


def fit_tests(tests: Bench, data: Mapping[str, Datum], used: Collection[str], seed: int = 1) -> WheatFit:
    """Find the settings that some of the data are compatible with."""
    counted = np.array([name in used for name in data])
    measured, errors = np.array(list(data.values())).T

    def chi2(settings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        expected, variances = tests.predict(settings)
        total = (variances + errors**2)[:, counted]
        return ((expected - measured)[:, counted] ** 2 / total).sum(axis=1), np.log(total).sum(axis=1)

    def log_likelihood(settings: np.ndarray) -> np.ndarray:
        inside = (np.abs(settings) <= 1.0).all(axis=1)
        squares, logs = chi2(settings)
        return np.where(inside, -0.5 * (squares + logs), -np.inf)

    rng = np.random.default_rng(seed)
    found = compatible_points(log_likelihood, even_points(len(SETTINGS), rng), rng)
    return WheatFit(tests, data, found.likely, found.best, float(chi2(found.best[None])[0][0]))
