"""The power of data: the size from which on a mechanism is found and distinguished from every other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats
from scipy.interpolate import interp1d

from doe.discrepancy.contest.signatures import LEAST_LENGTH, Signatures, projector, secants
from doe.discrepancy.emulation.condition_surfaces import added
from doe.discrepancy.fitting.model_fit import Fitted, minimise
from doe.discrepancy.problem.settings import Settings
from doe.discrepancy.problem.space import SearchSpace

CODED_SIZES = np.linspace(0.0, 1.0, 201)[1:]
"""Coded sizes among which the smallest visible one is searched."""
KNOTS = np.linspace(0.0, 1.0, 11)
"""Coded sizes at which the share that calibration takes up is computed; linear in between."""
TRUSTED = 0.8
"""Trusted share of an emulated effect: mechanisms that resemble a factor showed 0.7 (median) of the standard
deviations that it promised (``trials/record/README.md``)."""
SAME = (1.0 - (1.0 - TRUSTED) ** 2) ** 0.5
"""Correlation from which two signatures are the same: they differ by less than that share."""


@dataclass(frozen=True, eq=False)
class Effects:
    """Effects of mechanisms of every size added to a fitted model, less the part that a refit takes up."""

    names: tuple[str, ...]
    visible: np.ndarray
    """Whitened, at `CODED_SIZES`, (mechanisms, sizes, means)."""
    whole: np.ndarray
    """Squared lengths without the refit, (mechanisms, sizes)."""
    chance: np.ndarray
    """Part of the squared visible lengths due to the noise of the bank: where a mechanism does nothing, the
    emulator still shows something, (mechanisms, sizes)."""
    unknown: np.ndarray
    """Part of them due to all that the bank leaves open of the mechanism's addition, (mechanisms, sizes)."""
    correlations: np.ndarray
    """Between visible signatures, (mechanisms, mechanisms)."""

    @classmethod
    def of(cls, fitted: Fitted, seen: Signatures) -> Effects:
        """Compute the effects of the mechanisms that are not in a fitted model.

        The refit is a full one, within the ranges: an effect unlike any small change of the factors may be
        like a large one.
        """
        stack, theta = fitted.stack, fitted.x[: len(fitted.model.emulator.space.factors)]
        shape = (len(seen.names), len(KNOTS), len(fitted.covariance))
        if not seen.names:  # no mechanism has an effect, or all were left out
            none = np.empty((0, len(CODED_SIZES)))
            return cls((), np.empty((*none.shape, shape[-1])), none, none, none, seen.correlations)
        extra = np.reshape(
            [secants(stack.model, stack.blocks, theta, name, KNOTS) for name in seen.names], shape
        )
        targets = extra.reshape(-1, shape[-1]) + stack.predict(fitted.x[None])
        starts = np.repeat(fitted.x[None], len(targets), axis=0)
        bounds = fitted.model.lower, fitted.model.upper
        x, _ = minimise(stack, fitted.whitening, targets, starts, *bounds)
        left = (targets - stack.predict(x)).reshape(shape)
        white = (each @ fitted.whitening.T for each in (left, extra))
        visible, whole = (interp1d(KNOTS, each, axis=1)(CODED_SIZES) for each in white)
        chance, unknown = interp1d(KNOTS, _errors(fitted, seen.names, theta), axis=2)(CODED_SIZES)
        return cls(seen.names, visible, (whole**2).sum(axis=2), chance, unknown, seen.correlations)

    @property
    def squares(self) -> np.ndarray:
        """Squared lengths, (mechanisms, sizes)."""
        return np.asarray((self.visible**2).sum(axis=2))

    def apart(self, index: int, errors: np.ndarray) -> np.ndarray:
        """Return squared distances of a mechanism of every size from each other one, (mechanisms, sizes).

        The other has its nearest size, or is absent. Each was fitted to runs of its own: two equal mechanisms
        are as far apart as the errors of both, so these are taken off. Mechanisms whose signatures correlate
        by `SAME` or more are the same to an emulator.

        Parameters
        ----------
        errors : (mechanisms, sizes) array
            Parts in the squared visible lengths: `chance` for the likely distance, `unknown` for the distance
            that the bank has shown.
        """
        squares, sizes = self.squares, np.arange(len(CODED_SIZES))
        out = np.repeat(squares[index][None], len(self.names), axis=0)
        for rival in range(len(self.names)):
            if rival != index:
                products = self.visible[index] @ self.visible[rival].T
                squared = squares[index][:, None] + squares[rival] - 2.0 * products
                at = squared.argmin(axis=1)
                nearest = squared[sizes, at] - errors[index] - errors[rival][at]
                same = self.correlations[index, rival] >= SAME
                out[rival] = 0.0 if same else np.clip(nearest, 0.0, squares[index])
        return out

    def power(self, settings: Settings) -> np.ndarray:
        """Return the probability that each mechanism is found and distinguished, (mechanisms, sizes).

        It is found where its visible effect, less the emulator's error and the effect of chance, is
        ``least_ratio`` standard deviations. It is distinguished from a rival that is further behind in Q than
        a tie: the difference in Q of models d apart is d^2 +- 2 d. The smaller of the two probabilities
        counts.
        """
        trusted = np.maximum(self.squares - (1.0 - TRUSTED) ** 2 * self.whole - self.chance, 0.0)
        found = stats.norm.cdf(np.sqrt(trusted) - settings.least_ratio)
        nearest = np.array([self.apart(index, self.chance).min(axis=0) for index in range(len(self.names))])
        nearest = np.maximum(nearest, LEAST_LENGTH**2).reshape(found.shape)
        separated = stats.norm.cdf((nearest - settings.tie_margin) / (2.0 * np.sqrt(nearest)))
        return np.minimum(found, separated)


def _errors(fitted: Fitted, names: Sequence[str], theta: np.ndarray) -> np.ndarray:
    """Return parts of errors in squared visible lengths at the coded `KNOTS`, (2, mechanisms, knots).

    The first is that of chance, the second that of all that is open; see `Effects`.
    """
    left = projector(fitted.sensitivities) @ fitted.whitening
    terms = added(np.repeat(theta[None], len(KNOTS), axis=0), KNOTS)
    out = np.zeros((2, len(names), len(KNOTS)))
    start = 0
    for block in fitted.stack.blocks:
        end = start + len(block.columns)
        metric = left[:, start:end].T @ left[:, start:end]
        for number, name in enumerate(names):
            part = fitted.model.emulator.surfaces[block.condition].additions[name]
            seen = np.sum(metric * part.covariance[block.square])
            for own, error in zip(out[:, number], (part.chance, part.gram_inverse), strict=True):
                own += np.einsum("ks,st,kt->k", terms, error, terms) * seen
        start = end
    return out


def shown_apart(effects: Effects, name: str, coded_size: float) -> dict[str, float]:
    """Compute by other mechanism how far its Q, refitted, is above that of one of a coded size.

    Only the part beyond the errors of the bank's emulator counts.
    """
    index = effects.names.index(name)
    apart = effects.apart(index, effects.unknown)[:, np.abs(CODED_SIZES - coded_size).argmin()]
    return {other: float(apart[rival]) for rival, other in enumerate(effects.names) if rival != index}


@dataclass(frozen=True)
class Power:
    """The smallest size of a mechanism that the data can show and distinguish from every other."""

    mechanism: str
    detectable_size: float
    """Size found and distinguished with the power of the settings (80 %); infinite if the range has no such
    size."""
    maximum: float
    """End of the range."""
    visible_share: float
    """Share of its squared signature that calibration cannot take up."""
    resolvable: bool
    """True if the range has such a size, by the emulator or by declaration."""


def powers(effects: Effects, shares: np.ndarray, space: SearchSpace, settings: Settings) -> tuple[Power, ...]:
    """Return the power of the data for every mechanism, with its visible share (`Power`)."""
    out = []
    for name, power, share in zip(effects.names, effects.power(settings), shares, strict=True):
        coded = detectable_coded_size(power, settings)
        resolvable = np.isfinite(coded) if settings.resolvable is None else name in settings.resolvable
        size = space.natural_size(name, coded) if np.isfinite(coded) else float("inf")
        out.append(Power(name, size, space.mechanism(name).maximum, float(share), bool(resolvable)))
    return tuple(out)


def detectable_coded_size(power: np.ndarray, settings: Settings) -> float:
    """Return the smallest size of `CODED_SIZES` with the power of the settings; infinite if there is none."""
    shown = power >= settings.power
    return float(CODED_SIZES[shown.argmax()]) if shown.any() else float("inf")
