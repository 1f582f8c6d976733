"""The fit of the five slopes: settings of the grain, and a friction for each wall."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from doe import Sample
from doe.curves.compatible import compatible_points, even_points
from doe.curves.curve_emulator import CurveEmulator
from experiments.evidence.studies.wheat_drums.drum_plan import GRAIN, INCLINED, SHELLS, UPRIGHT, coded
from experiments.studyfile import Study

LEVEL = 0.9
"""Probability that ranges hold."""

OPEN = 0.5
"""A factor stays open where its range is more than this part of what the design explored."""

SETTINGS = (*GRAIN, *(f"mu_{name}" for name in SHELLS))
"""Settings of all five tests: the grain, and the friction of each wall."""


@dataclass(frozen=True, eq=False)
class Slopes:
    """Emulated slopes of the two tests, whose settings are those of one drum: grain, shell, cover."""

    upright: CurveEmulator
    inclined: CurveEmulator

    @classmethod
    def of(cls, study: Study, table: pd.DataFrame) -> Slopes:
        """Fit both to simulated drums: a table with their settings, ``scene`` and ``dynamic_angle``."""
        finished = table[table["dynamic_angle"].notna()]
        rows = {name: finished[finished["scene"] == name] for name in (UPRIGHT, INCLINED)}
        made = {
            name: CurveEmulator.of(coded(study, own), own[["dynamic_angle"]].to_numpy(float))
            for name, own in rows.items()
        }
        return cls(made[UPRIGHT], made[INCLINED])

    def predict(self, settings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Slopes of the five tests at coded `SETTINGS`, and their variances, (points, 5) each [deg, deg2].

        The cover is of the last of the shells' materials; upright, the mean over the shells was measured.
        """
        grain, walls = settings[:, : len(GRAIN)], settings[:, len(GRAIN) :]
        drums = [np.column_stack([grain, wall, walls[:, -1]]) for wall in walls.T]
        upright = [self.upright.predict(drum) for drum in drums]
        inclined = [self.inclined.predict(drum) for drum in drums]
        means = [np.mean([mean for mean, _ in upright], axis=0), *(mean for mean, _ in inclined)]
        variances = [np.mean([own for _, own in upright], axis=0), *(own for _, own in inclined)]
        return np.hstack(means), np.hstack(variances)


@dataclass(frozen=True, eq=False)
class WheatFit:
    """Settings that some of the data are compatible with."""

    slopes: Slopes
    data: dict[str, Sample]
    """All data, by name."""
    settings: np.ndarray
    """Coded `SETTINGS`, as likely as one another."""
    best: np.ndarray
    chi2: float
    """Values at the best settings."""

    def foretold(self, seed: int = 0) -> pd.DataFrame:
        """Compare each datum with what the compatible settings predict: the best, and its range [deg]."""
        means, variances = self.slopes.predict(self.settings)
        drawn = means + np.random.default_rng(seed).normal(size=means.shape) * np.sqrt(variances)
        low, high = np.quantile(drawn, [(1 - LEVEL) / 2, (1 + LEVEL) / 2], axis=0)
        at_best = self.slopes.predict(self.best[None])[0][0]
        rows = zip(self.data.items(), at_best, low, high, strict=True)
        return pd.DataFrame(
            [
                {
                    "test": name,
                    "measured": s.mean,
                    "error": s.sd / np.sqrt(s.n),
                    "best": b,
                    "low": lo,
                    "high": hi,
                }
                for (name, s), b, lo, hi in rows
            ]
        )

    def ranges(self, study: Study) -> pd.DataFrame:
        """Compatible range of each setting, in natural units, and if it stays open."""
        factors = {factor.name: factor for factor in study.factors}
        ends = np.quantile(self.settings, [(1 - LEVEL) / 2, 0.5, (1 + LEVEL) / 2], axis=0)
        rows = []
        for number, name in enumerate(SETTINGS):
            factor = factors.get(name, factors["mu_shell"])
            low, middle, high = (factor.center + factor.half_range * end for end in ends[:, number])
            part = (ends[2, number] - ends[0, number]) / 2.0
            best = factor.center + factor.half_range * self.best[number]
            values = {"best": best, "low": low, "middle": middle, "high": high, "part of the design": part}
            rows.append({"setting": name, **values, "open": "yes" if part > OPEN else "no"})
        return pd.DataFrame(rows)


def fit_slopes(
    slopes: Slopes, data: dict[str, Sample], leave_out: str | None = None, seed: int = 1
) -> WheatFit:
    """Find the settings that the data are compatible with, all of them or all but one."""
    names = list(data)
    counted = np.array([name != leave_out for name in names])
    means = np.array([data[name].mean for name in names])
    errors = np.array([data[name].sd ** 2 / data[name].n for name in names])

    def chi2(settings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        expected, variances = slopes.predict(settings)
        total = (variances + errors)[:, counted]
        return ((expected - means)[:, counted] ** 2 / total).sum(axis=1), np.log(total).sum(axis=1)

    def log_likelihood(settings: np.ndarray) -> np.ndarray:
        inside = (np.abs(settings) <= 1.0).all(axis=1)
        squares, logs = chi2(settings)
        return np.where(inside, -0.5 * (squares + logs), -np.inf)

    rng = np.random.default_rng(seed)
    found = compatible_points(log_likelihood, even_points(len(SETTINGS), rng), rng)
    return WheatFit(slopes, data, found.likely, found.best, float(chi2(found.best[None])[0][0]))
