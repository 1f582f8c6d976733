"""Fisher information of tests at each setting drawn, and the posterior widths that follow.

The posterior of a setting x has the covariance (P + sum g g' / v)^-1: P of the box explored, g the slopes of
the responses at x, v the variance of fit, repeats, common error and model together. Errors are normal, and
surfaces straight over the widths. Further repeats of a known response share the error of its model.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from doe.response.quadratic import FittedSurface
from doe.samples.two_errors import TwoErrors
from experiments.calibrate.plan.present import Key, Present
from experiments.studyfile.candidate_section import Candidate

NORMAL = 1.959964
"""Standard deviations of a 95 % half width."""

PROMISED = 0.9
"""Share of the settings drawn at which a promised width holds; of chosen tests it is then 80 % or more,
as the surfaces that choose have errors themselves (record of `experiments/evidence/accuracy/statistics`)."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Size:
    """A size of a candidate's test, in words; empty: that of the scene as written."""

    words: str = ""
    growth: float = 1.0
    """Grains, or time if it grows more, over those of the scene as written."""
    grains: int = 0
    work: float = 0.0
    """Steps of all spheres of one case: the smaller of two sizes that buy as much is chosen by it."""
    seconds: float = np.nan
    """Computer time of the surface of this size [s]; NaN where it is unknown."""


@dataclass(frozen=True)
class Variant:
    """A candidate at one size, with one number of repeats."""

    candidate: Candidate
    size: Size
    repeats: int

    @property
    def minutes(self) -> float:
        """Laboratory time [min]."""
        setup, each = self.candidate.minutes
        return setup + each * self.repeats

    @property
    def words(self) -> str:
        """Repeats, test and size."""
        return f"{self.repeats} x {self.candidate.name}" + f" ({self.size.words})" * bool(self.size.words)


@dataclass(frozen=True, eq=False)
class _Local:
    """A surface at the settings drawn; its slopes are per coded unit of what was explored."""

    mean: Array
    se: Array
    slopes: Array

    @classmethod
    def of(cls, surface: FittedSurface, present: Present) -> _Local:
        factors, form = surface.design.factors, surface.quadratic_form
        coded = np.column_stack([f.to_coded(x) for f, x in zip(factors, present.natural.T, strict=True)])
        slopes = form.slopes + 2.0 * coded @ form.matrix
        return cls(*surface.evaluate(coded), slopes * present.half_ranges / [f.half_range for f in factors])

    def information(self, variance: Array) -> Array:
        return np.einsum("ki,kj->kij", self.slopes, self.slopes / variance[:, None])


@dataclass(frozen=True, eq=False)
class Knowledge:
    """Measured responses, and surfaces of what candidates would add.

    Information has the shape (truths, factors, factors).
    """

    present: Present
    surfaces: Mapping[Key, FittedSurface]

    @cached_property
    def _locals(self) -> dict[Key, _Local]:
        known = {key: one.surface for key, one in self.present.known.items()}
        return {key: _Local.of(each, self.present) for key, each in {**self.surfaces, **known}.items()}

    @cached_property
    def base(self) -> Array:
        """Information of the box explored and of all that is known."""
        box = 3.0 / self.present.extent**2 * np.eye(len(self.present.factors))
        return sum(
            (self._known(key) for key in self.present.known), np.tile(box, (len(self.present.truths), 1, 1))
        )

    def _known(self, key: Key) -> Array:
        local, known = self._locals[key], self.present.known[key]
        rest = local.se**2 + known.model.at(local.mean) ** 2
        return local.information(_variance(rest, known.measured.se**2, known.measured.df))

    def is_judged(self, candidate: Candidate) -> bool:
        """Return True if a reading of a candidate has a surface."""
        return any((candidate.scene, each.response.observable) in self._locals for each in candidate.readings)

    def added(self, candidate: Candidate, repeats: int, growth: float = 1.0) -> Array:
        """Return the information that a test adds."""
        found = np.zeros_like(self.base)
        for reading in candidate.readings:
            key = candidate.scene, reading.response.observable
            if key not in self._locals:
                continue
            (local, known), df = (self._locals[key], self.present.known.get(key)), np.inf
            repeated = (
                reading.sd.at(local.mean) ** 2 / (repeats * growth) + reading.common.at(local.mean) ** 2
            )
            rest = local.se**2 / growth + reading.model_sd.at(local.mean) ** 2
            if known is not None:
                rest = local.se**2 + known.model.at(local.mean) ** 2
                repeated = 1.0 / (1.0 / repeated + 1.0 / known.measured.se**2)
                found, df = found - self._known(key), known.measured.df + repeats
            found += local.information(_variance(rest, repeated, df))
        return found

    def relative(self, information: Array) -> Array:
        """Return the 95 % half widths over the values, shape (..., truths, factors)."""
        half, values = self.present.half_ranges, np.abs(self.present.natural)
        deviations = np.sqrt(np.diagonal(np.linalg.inv(information), axis1=-2, axis2=-1))
        return NORMAL * half * deviations / np.maximum(values, 1e-9 * half)

    def promised(self, information: Array) -> Array:
        """Return the relative half widths that hold at 90 % of the settings, shape (..., factors)."""
        return np.quantile(self.relative(information), PROMISED, axis=-2)

    def left(self, information: Array) -> float:
        """Return the median share of the region that is left, by volume."""
        before, after = (np.linalg.slogdet(each)[1] for each in (self.base, information))
        return float(np.exp(np.median(before - after) / 2.0))

    def least_known(self, information: Array) -> tuple[Array, float]:
        """Return the direction that is known worst, coded, and its 95 % half width over what was explored."""
        values, vectors = np.linalg.eigh(np.linalg.inv(information).mean(axis=0))
        vector = vectors[:, -1] * np.sign(vectors[np.abs(vectors[:, -1]).argmax(), -1])
        return vector, float(NORMAL * np.sqrt(values[-1]) / self.present.extent)


def _variance(rest: Array, scatter: float | Array, df: float) -> Array:
    """Add the variance of measurements; few of them widen both as they do the region of a campaign."""
    total = rest + scatter
    return total * (TwoErrors(np.inf, df).critical(scatter / total, 0.05) / NORMAL) ** 2
