"""A model to be fitted: the base with some mechanisms, as emulated or as corrected by fresh runs."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from doe.discrepancy.emulation.condition_surfaces import all_terms
from doe.discrepancy.emulation.correction import Correction
from doe.discrepancy.emulation.emulator import Emulator
from doe.discrepancy.fitting.measured_means import Block
from doe.discrepancy.fitting.scatter import Excess, Scatter

STEP = 0.02
"""Half the step of derivatives, in coded units."""


@dataclass(frozen=True, eq=False)
class Shift:
    """Difference of coded parameters between emulator and simulator, common to all conditions."""

    value: np.ndarray
    """Coded difference, (parameters,)."""
    spread: np.ndarray
    """Covariance of its error, (parameters, parameters)."""


@dataclass(frozen=True, eq=False)
class Model:
    """Predictions of the base with some mechanisms."""

    emulator: Emulator
    mechanisms: tuple[str, ...]
    systematic: float
    """Standard deviation that is added to the error of every mean, in units of that of one run."""
    shift: Shift | None = None
    """Error of the emulator's parameters; None for the emulator alone."""
    corrections: Mapping[str, Correction] = field(default_factory=dict)
    """Further corrections by condition; empty for the emulator alone."""
    heading: float = 0.0
    """Azimuth of its directed mechanisms [deg]."""
    views: Mapping[str, float] = field(default_factory=dict)
    """Azimuth of the view by condition [deg]. Default: 0."""

    @cached_property
    def is_directed(self) -> bool:
        """True if it looks different from another azimuth."""
        space = self.emulator.space
        return bool(space.odd) and any(space.mechanism(name).directed for name in self.mechanisms)

    @cached_property
    def odd(self) -> np.ndarray:
        """True for observables that a mirror turns over, (observables,)."""
        return np.isin(self.emulator.observables, self.emulator.space.odd)

    def turn(self, condition: str) -> np.ndarray:
        """Return the share of each observable that is visible under a condition, (observables,)."""
        seen = math.cos(math.radians(self.heading - self.views.get(condition, 0.0)))
        return np.where(self.odd, seen, 1.0)

    @property
    def lower(self) -> np.ndarray:
        """Least coded parameters."""
        return np.array([-1.0] * len(self.emulator.space.factors) + [0.0] * len(self.mechanisms))

    @property
    def upper(self) -> np.ndarray:
        """Largest coded parameters."""
        return np.ones(len(self.lower))

    @property
    def start(self) -> np.ndarray:
        """The middle of the ranges."""
        return (self.lower + self.upper) / 2.0

    def predict(self, x: np.ndarray, condition: str) -> np.ndarray:
        """Return observables at coded parameters (n, parameters), (n, observables)."""
        shifted = x if self.shift is None else x + self.shift.value
        values = self.emulator.surfaces[condition].predict(shifted, self.mechanisms)
        if condition in self.corrections:
            values = values + self.corrections[condition].mean(x)
        # without a direction odd observables are noise, and their mean is zero
        return values * self.turn(condition) if self.is_directed else values

    def run_covariance(self, x: np.ndarray, condition: str) -> np.ndarray:
        """Return the covariance of one run at one row of coded parameters, (observables, observables)."""
        covariance = self.emulator.surfaces[condition].noise_covariance(x, self.mechanisms)
        if condition in self.corrections:
            ratio = self.corrections[condition].noise_ratio
            covariance = ratio[:, None] * covariance * ratio
        if not self.is_directed:
            return covariance
        # odd observables scatter alike from any side; their covariance with the others turns
        turn = self.turn(condition)
        return np.where(self.odd[:, None] & self.odd, covariance, covariance * np.outer(turn, turn))

    def excess(self, x: np.ndarray, scatter: Scatter, runs: Mapping[str, np.ndarray] | None = None) -> Excess:
        """Estimate the scatter of replicates beyond that of runs at one row of coded parameters.

        Known covariances of the runs by condition are not computed again.
        """
        runs = runs or {}
        own = {n: runs[n] if n in runs else self.run_covariance(x, n) for n in scatter.products}
        known = sum(self.emulator.surfaces[name].noise.degrees_of_freedom for name in own)
        return scatter.excess(own, known, len(self.emulator.observables))

    def noise(self, x: np.ndarray, block: Block, excess: Excess | None = None) -> np.ndarray:
        """Return the covariance of the noise of a block's means at one row of coded parameters, (k, k).

        The excess of its replicates is computed at these parameters, unless it is given.
        """
        excess = self.excess(x, block.scatter) if excess is None else excess
        return self.noise_of(self.run_covariance(x, block.condition), block, excess)

    def noise_of(self, run: np.ndarray, block: Block, excess: Excess) -> np.ndarray:
        """Return the covariance of the noise of a block's means from that of one run, (k, k)."""
        freed = self.emulator.surfaces[block.condition].noise.inverse_bias(len(block.columns))
        return block.noise(run, excess) * freed

    def open_error(self, x: np.ndarray, block: Block) -> np.ndarray:
        """Return the covariance that bank and fresh runs leave to the prediction of a block, (k, k)."""
        surfaces = self.emulator.surfaces[block.condition]
        if block.condition in self.corrections:
            error = self.corrections[block.condition].error(x)
        else:
            error = surfaces.error(x, self.mechanisms)
        if self.is_directed:
            turn = self.turn(block.condition)
            error = error * np.outer(turn, turn)
        return np.asarray(error[block.square])

    def slope_chance(self, x: np.ndarray, block: Block) -> tuple[np.ndarray, np.ndarray]:
        """Return covariances of the slopes of a block's prediction due to the noise of bank and fresh runs.

        Kriged parts are not counted. The first array is (k, parameters, parameters), the second the
        correlation of the slopes of two means, (k, k).
        """
        surfaces, size = self.emulator.surfaces[block.condition], len(x)
        near = x + STEP * np.concatenate([np.eye(size), -np.eye(size)])
        if block.condition in self.corrections:
            chance = self.corrections[block.condition].chance(near)
        else:
            factors = len(self.emulator.space.factors)
            terms = all_terms(near, factors)
            chance = terms @ surfaces.coefficient_chance(x[:factors], self.mechanisms) @ terms.T
        difference = np.concatenate([np.eye(size), -np.eye(size)], axis=1) / (2.0 * STEP)
        of_each = difference @ chance @ difference.T
        if self.is_directed:
            of_each = of_each * self.turn(block.condition)[:, None, None] ** 2
        correlation = surfaces.correlation(x, self.mechanisms)
        return of_each[block.columns], correlation[block.square]

    def shift_slopes(self, x: np.ndarray, block: Block) -> np.ndarray:
        """Return derivatives of the prediction of a block by the shift, (k, parameters).

        Where there are fresh runs, the corrections undo the effect of a shift on the emulated values.
        """
        slopes = self._emulated_slopes(x[None], block.condition)[0]
        if block.condition in self.corrections:
            correction = self.corrections[block.condition]
            at_runs = self._emulated_slopes(correction.points, block.condition)
            slopes = slopes - np.einsum("jn,njp->jp", correction.gain(x[None])[:, 0], at_runs)
        if self.is_directed:
            slopes = slopes * self.turn(block.condition)[:, None]
        return np.asarray(slopes[block.columns])

    def _emulated_slopes(self, x: np.ndarray, condition: str) -> np.ndarray:
        """Return derivatives without corrections at coded (n, parameters), (n, observables, parameters)."""
        plain = replace(self, corrections={}, views={}, heading=0.0)
        steps = STEP * np.eye(x.shape[1])
        sides = [[plain.predict(x + side * step, condition) for step in steps] for side in (1.0, -1.0)]
        ahead, behind = np.moveaxis(np.array(sides), 1, 3)
        return np.asarray((ahead - behind) / (2.0 * STEP))

    def error(self, x: np.ndarray, block: Block) -> np.ndarray:
        """Return the covariance of the error of a block's prediction, with the systematic error, (k, k)."""
        theta = x[: len(self.emulator.space.factors)]
        own = self.systematic**2 * self.emulator.surfaces[block.condition].noise.variance(theta)
        return np.asarray(self.open_error(x, block) + np.diag(own[block.columns]))


@dataclass(frozen=True, eq=False)
class Stack:
    """Model and the means of some conditions, as one vector."""

    model: Model
    blocks: tuple[Block, ...]

    @cached_property
    def target(self) -> np.ndarray:
        """Measured means, (means,)."""
        return np.concatenate([block.mean for block in self.blocks])

    def predict(self, x: np.ndarray) -> np.ndarray:
        """Return the predicted means at coded parameters (n, parameters), (n, means)."""
        parts = [self.model.predict(x, block.condition)[:, block.columns] for block in self.blocks]
        return np.concatenate(parts, axis=1)

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Return derivatives by central differences at coded parameters, (n, means, parameters)."""
        count, size = x.shape
        steps = STEP * np.concatenate([np.eye(size), -np.eye(size)])
        values = self.predict((x[:, None, :] + steps).reshape(-1, size)).reshape(count, 2 * size, -1)
        return np.asarray(np.swapaxes(values[:, :size] - values[:, size:], 1, 2) / (2.0 * STEP))

    def covariance(self, x: np.ndarray) -> np.ndarray:
        """Return the covariance of measured less predicted means at one row of coded parameters."""
        parts = zip(self._noises(x), self.blocks, strict=True)
        own = _blocks(noise + self.model.error(x, block) for noise, block in parts)
        return own + self.common.T @ self.common

    def open_error(self, x: np.ndarray) -> np.ndarray:
        """Return the covariance of the predictions' own errors at one row of coded parameters."""
        return _blocks(self.model.open_error(x, block) for block in self.blocks)

    def shift_slopes(self, x: np.ndarray) -> np.ndarray:
        """Return derivatives of the predicted means by the model's shift, (means, parameters)."""
        return np.concatenate([self.model.shift_slopes(x, block) for block in self.blocks])

    def feigned_information(self, x: np.ndarray, precision: np.ndarray) -> np.ndarray:
        """Return the spurious information on the parameters: the square of the noise in the slopes.

        Slopes J with noise of covariance S have an expected J' P J that is too large by that of the noise
        (Fuller 1987, Measurement Error Models, chapter 1), with P the inverse covariance of measured less
        predicted means.
        """
        feigned, start = np.zeros((len(x), len(x))), 0
        for block in self.blocks:
            end = start + len(block.mean)
            own, correlation = self.model.slope_chance(x, block)
            sd = np.sqrt(np.maximum(np.einsum("jaa->j", own), np.finfo(float).tiny))
            weights = precision[start:end, start:end] * correlation * np.outer(sd, sd)
            # for two means the shape is the mean of both
            feigned += np.einsum("j,jab->ab", weights.sum(axis=0) / sd**2, own)
            start = end
        return feigned

    @cached_property
    def common(self) -> np.ndarray:
        """Change of the means by a standard deviation of each calibration error, (2 observables, means).

        Offsets of all observables come first, then scales, by the numbers of their errors.
        """
        numbers = np.arange(len(self.model.emulator.observables))[:, None]
        errors = np.concatenate([[block.columns, block.scales] for block in self.blocks], axis=1)
        moved = np.concatenate([block.common for block in self.blocks], axis=1)
        parts = zip(errors, moved, strict=True)
        return np.concatenate([np.where(error == numbers, each, 0.0) for error, each in parts])

    def noise(self, x: np.ndarray) -> np.ndarray:
        """Return the covariance of the measured means alone, (means, means)."""
        return _blocks(self._noises(x))

    def _noises(self, x: np.ndarray) -> Iterator[np.ndarray]:
        """Return the covariances of the measured means of each block alone."""
        model = self.model
        runs = {block.condition: model.run_covariance(x, block.condition) for block in self.blocks}
        # all blocks are means of the same replicates, or of as few
        excess = model.excess(x, self.blocks[0].scatter, runs)
        return (model.noise_of(runs[block.condition], block, excess) for block in self.blocks)


def _blocks(parts: Iterable[np.ndarray]) -> np.ndarray:
    """Return the matrix with square parts on its diagonal; SciPy's takes 30 times as long."""
    parts = [*parts]
    out, end = np.zeros(2 * [sum(map(len, parts))]), 0
    for part in parts:
        start, end = end, end + len(part)
        out[start:end, start:end] = part
    return out
