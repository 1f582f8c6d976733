"""The power of data: from which size on a mechanism is found, and told from every other."""

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
"""Coded sizes that the smallest visible one is searched on."""
KNOTS = np.linspace(0.0, 1.0, 11)
"""Coded sizes at which calibration is asked what it takes up; straight in between."""
TRUSTED = 0.8
"""Part of an effect that an emulator is right about. In blind trials on a simulator a mechanism most of
which looks like another value of a factor was seen with 0.7 (median) of the standard deviations that it
promised."""
SAME = (1.0 - (1.0 - TRUSTED) ** 2) ** 0.5
"""Correlation from which two signatures are one: they differ by less than that."""


@dataclass(frozen=True, eq=False)
class Effects:
    """Effects of mechanisms of every size beside a fitted model, a refit of which takes up its part."""

    names: tuple[str, ...]
    visible: np.ndarray
    """Whitened, at `CODED_SIZES`, (mechanisms, sizes, means)."""
    whole: np.ndarray
    """Squared lengths without the refit, (mechanisms, sizes)."""
    chance: np.ndarray
    """Part of the noise of the bank in the squared visible lengths: where a mechanism does nothing, the
    emulator still shows something, (mechanisms, sizes)."""
    unknown: np.ndarray
    """Part in them of all that the bank leaves open of the mechanism's addition, (mechanisms, sizes)."""
    correlations: np.ndarray
    """Between visible signatures, (mechanisms, mechanisms)."""

    @classmethod
    def of(cls, fitted: Fitted, seen: Signatures) -> Effects:
        """Of the mechanisms that are not in a fitted model.

        The refit is one in full, within the ranges: what looks unlike any small change of the factors may be
        like a large one.
        """
        stack, theta = fitted.stack, fitted.x[: len(fitted.model.emulator.space.factors)]
        shape = (len(seen.names), len(KNOTS), len(fitted.covariance))
        if not seen.names:  # none does anything, or all were left out
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
        """Squared distance of a mechanism of every size from each other one, (mechanisms, sizes).

        The other has the size in its range that is nearest, or none. Each was fitted to runs of its own: two
        that do the same are as far apart as the errors of both, so these are taken off. Those whose
        signatures correlate by `SAME` or more are one to an emulator; of the mechanism itself nothing is
        nearest.

        Parameters
        ----------
        index : int
        errors : (mechanisms, sizes) array
            Parts in the squared visible lengths: `chance` for the likely distance, `unknown` for what the
            bank has shown of it.
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
        """Probability that a mechanism of every size is found and told from every other.

        It is found where its visible effect, less what an emulator may be wrong about and what chance adds to
        it, is ``least_ratio`` standard deviations. It is told from a rival where that is further behind in Q
        than a tie: the difference in Q of models d apart is d^2 +- 2 d.

        Returns
        -------
        (mechanisms, sizes) array
            The smaller of the two probabilities.
        """
        trusted = np.maximum(self.squares - (1.0 - TRUSTED) ** 2 * self.whole - self.chance, 0.0)
        found = stats.norm.cdf(np.sqrt(trusted) - settings.least_ratio)
        nearest = np.array([self.apart(index, self.chance).min(axis=0) for index in range(len(self.names))])
        nearest = np.maximum(nearest, LEAST_LENGTH**2).reshape(found.shape)
        told = stats.norm.cdf((nearest - settings.tie_margin) / (2.0 * np.sqrt(nearest)))
        return np.minimum(found, told)


def _errors(fitted: Fitted, names: Sequence[str], theta: np.ndarray) -> np.ndarray:
    """Parts of errors in squared visible lengths, at the coded `KNOTS`, (2, mechanisms, knots).

    Of chance, and of all that is open; see `Effects`.
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
            seen = np.sum(metric * part.covariance[np.ix_(block.columns, block.columns)])
            for own, error in zip(out[:, number], (part.chance, part.gram_inverse), strict=True):
                own += np.einsum("ks,st,kt->k", terms, error, terms) * seen
        start = end
    return out


def shown_apart(effects: Effects, name: str, coded_size: float) -> dict[str, float]:
    """Compute by how much Q of every other mechanism, refitted, is above that of one of a coded size.

    So much of it as is beyond the errors of the bank's emulator.

    Returns
    -------
    dict
        By the other's name.
    """
    index = effects.names.index(name)
    apart = effects.apart(index, effects.unknown)[:, np.abs(CODED_SIZES - coded_size).argmin()]
    return {other: float(apart[rival]) for rival, other in enumerate(effects.names) if rival != index}


@dataclass(frozen=True)
class Power:
    """The smallest size of a mechanism that the data could show and tell from every other."""

    mechanism: str
    detectable_size: float
    """Size found and told apart with the power of the settings (80 %); infinite if none in its range is."""
    maximum: float
    """End of its range."""
    visible_share: float
    """Share of its squared signature that calibration cannot take up."""
    resolvable: bool
    """True if its range has such a size, as the emulator has it; or what was declared."""


def powers(effects: Effects, shares: np.ndarray, space: SearchSpace, settings: Settings) -> tuple[Power, ...]:
    """Power of the data for every mechanism.

    Parameters
    ----------
    effects : Effects
        Beside the calibrated base.
    shares : (mechanisms,) array
        See `Power`.
    space : SearchSpace
        Ranges of the mechanisms.
    settings : Settings
    """
    out = []
    for name, power, share in zip(effects.names, effects.power(settings), shares, strict=True):
        coded = detectable_coded_size(power, settings)
        resolvable = np.isfinite(coded) if settings.resolvable is None else name in settings.resolvable
        size = space.natural_size(name, coded) if np.isfinite(coded) else float("inf")
        out.append(Power(name, size, space.mechanism(name).maximum, float(share), bool(resolvable)))
    return tuple(out)


def detectable_coded_size(power: np.ndarray, settings: Settings) -> float:
    """Smallest coded size that is shown with the power of the settings, infinite if none is.

    Parameters
    ----------
    power : (sizes,) array
        At `CODED_SIZES`.
    settings : Settings
    """
    shown = power >= settings.power
    return float(CODED_SIZES[shown.argmax()]) if shown.any() else float("inf")
