"""What each mechanism would look like in the data, beyond what a calibration of the factors can take up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats
from scipy.interpolate import interp1d

from doe.discrepancy.emulation.emulator import Emulator
from doe.discrepancy.emulation.surfaces import added
from doe.discrepancy.fitting.evidence import Block
from doe.discrepancy.fitting.fit import Fitted, minimise
from doe.discrepancy.problem.settings import Settings

SECANT = 0.5
"""Coded size at which a signature is taken: an effect a unit of size."""
SIZES = np.linspace(0.0, 1.0, 201)[1:]
"""Coded sizes that the smallest visible one is searched on."""
KNOTS = np.linspace(0.0, 1.0, 11)
"""Coded sizes at which calibration is asked what it takes up; straight in between."""
TRUSTED = 0.8
"""Part of an effect that an emulator is right about. In the fourth blind trials wall adhesion, most of which
looks like another friction, was seen with 0.7 (median) of the standard deviations that it promised."""
SAME = (1.0 - (1.0 - TRUSTED) ** 2) ** 0.5
"""Correlation from which two signatures are one: they differ by less than that."""
LEAST_LENGTH = 1e-6
"""A signature that is shorter (whitened) is not seen at all."""


def signature(emulator: Emulator, blocks: Sequence[Block], theta: np.ndarray, name: str) -> np.ndarray:
    """What a mechanism adds to the means of some conditions for a unit of its coded size, (means,)."""
    return secants(emulator, blocks, theta, name, np.array([SECANT]))[0] / SECANT


def secants(
    emulator: Emulator, blocks: Sequence[Block], theta: np.ndarray, name: str, sizes: np.ndarray
) -> np.ndarray:
    """What a mechanism adds to the means at coded sizes (n,), (n, means)."""
    x = np.column_stack([np.repeat(theta[None], len(sizes), axis=0), sizes])
    parts = []
    for block in blocks:
        surfaces = emulator.surfaces[block.condition]
        difference = surfaces.predict(x, (name,)) - surfaces.predict(theta[None], ())
        parts.append(difference[:, block.columns])
    return np.concatenate(parts, axis=1)


def projector(sensitivities: np.ndarray) -> np.ndarray:
    """I - J J+: what is left of whitened means when the free parameters were refitted, (means, means)."""
    return np.eye(len(sensitivities)) - sensitivities @ np.linalg.pinv(sensitivities)


@dataclass(frozen=True, eq=False)
class Signatures:
    """Mechanisms beside a fitted model, whitened by its covariance."""

    names: tuple[str, ...]
    whole: np.ndarray
    """Effect of a unit of coded size, (mechanisms, means)."""
    visible: np.ndarray
    """What a refit leaves of it, (mechanisms, means)."""

    @property
    def directions(self) -> np.ndarray:
        """Visible signatures of length one; zeros where nothing is visible, (mechanisms, means)."""
        length = np.linalg.norm(self.visible, axis=1, keepdims=True)
        return np.asarray(
            np.where(length > LEAST_LENGTH, self.visible / np.maximum(length, LEAST_LENGTH), 0.0)
        )

    @property
    def shares(self) -> np.ndarray:
        """Share of each squared signature that is visible, (mechanisms,)."""
        visible = (self.visible**2).sum(axis=1)
        whole = (self.whole**2).sum(axis=1)
        return np.asarray(
            np.divide(visible, whole, out=np.zeros_like(whole), where=whole > 0.0).clip(0.0, 1.0)
        )

    @property
    def correlations(self) -> np.ndarray:
        """Confounding: cosines between visible signatures, (mechanisms, mechanisms)."""
        return np.asarray(np.clip(self.directions @ self.directions.T, -1.0, 1.0))


def signatures(fitted: Fitted) -> Signatures:
    """Signatures of the mechanisms that are not in a fitted model."""
    emulator, blocks = fitted.model.emulator, fitted.stack.blocks
    names = tuple(name for name in emulator.space.names if name not in fitted.mechanisms)
    theta = fitted.x[: len(emulator.space.factors)]
    size = (len(names), len(fitted.covariance))
    natural = np.array([signature(emulator, blocks, theta, name) for name in names]).reshape(size)
    whole = natural @ fitted.whitening.T
    return Signatures(names, whole, whole @ projector(fitted.sensitivities))


@dataclass(frozen=True, eq=False)
class Effects:
    """What mechanisms of every size show beside a fitted model, a refit of which takes up its part."""

    names: tuple[str, ...]
    visible: np.ndarray
    """Whitened, at the coded `SIZES`, (mechanisms, sizes, means)."""
    whole: np.ndarray
    """Squared lengths without the refit, (mechanisms, sizes)."""
    chance: np.ndarray
    """What the noise of the bank adds to the squared visible lengths: where a mechanism does nothing, the
    emulator still shows something, (mechanisms, sizes)."""
    correlations: np.ndarray
    """Between visible signatures, (mechanisms, mechanisms)."""

    @classmethod
    def of(cls, fitted: Fitted, seen: Signatures) -> Effects:
        """Of the mechanisms that are not in a fitted model.

        The refit is one in full, within the ranges: what looks unlike any small change of the factors may be
        like a large one, as an adhesion of the walls is like much more friction.
        """
        stack, theta = fitted.stack, fitted.x[: len(fitted.model.emulator.space.factors)]
        shape = (len(seen.names), len(KNOTS), len(fitted.covariance))
        extra = np.reshape(
            [secants(stack.model.emulator, stack.blocks, theta, name, KNOTS) for name in seen.names], shape
        )
        targets = extra.reshape(-1, shape[-1]) + stack.predict(fitted.x[None])
        starts = np.repeat(fitted.x[None], len(targets), axis=0)
        bounds = fitted.model.lower, fitted.model.upper
        x, _ = minimise(stack, fitted.whitening, targets, starts, *bounds)
        left = (targets - stack.predict(x)).reshape(shape)
        visible, whole = (interp1d(KNOTS, each @ fitted.whitening.T, axis=1)(SIZES) for each in (left, extra))
        chance = interp1d(KNOTS, _chance(fitted, seen.names, theta), axis=1)(SIZES)
        return cls(seen.names, visible, (whole**2).sum(axis=2), chance, seen.correlations)

    @property
    def squares(self) -> np.ndarray:
        """Squared lengths, (mechanisms, sizes)."""
        return np.asarray((self.visible**2).sum(axis=2))

    def apart(self, index: int) -> np.ndarray:
        """Squared distance of a mechanism of every size from each other one, (mechanisms, sizes).

        The other has the size in its range that is nearest, or none. Those whose signatures correlate by
        `SAME` or more are one to an emulator; of the mechanism itself nothing is nearest.
        """
        squares = self.squares
        out = np.repeat(squares[index][None], len(self.names), axis=0)
        for rival in range(len(self.names)):
            if rival != index:
                products = self.visible[index] @ self.visible[rival].T
                nearest = (squares[index][:, None] + squares[rival] - 2.0 * products).min(axis=1)
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
        nearest = np.array([self.apart(index).min(axis=0) for index in range(len(self.names))])
        nearest = np.maximum(nearest, LEAST_LENGTH**2).reshape(found.shape)
        told = stats.norm.cdf((nearest - settings.tie_margin) / (2.0 * np.sqrt(nearest)))
        return np.minimum(found, told)


def _chance(fitted: Fitted, names: Sequence[str], theta: np.ndarray) -> np.ndarray:
    """See `Effects`, at the coded `KNOTS`, (mechanisms, knots)."""
    left = projector(fitted.sensitivities) @ fitted.whitening
    terms = added(np.repeat(theta[None], len(KNOTS), axis=0), KNOTS)
    out = np.zeros((len(names), len(KNOTS)))
    start = 0
    for block in fitted.stack.blocks:
        end = start + len(block.columns)
        metric = left[:, start:end].T @ left[:, start:end]
        for own, name in zip(out, names, strict=True):
            part = fitted.model.emulator.surfaces[block.condition].additions[name]
            seen = np.sum(metric * part.covariance[np.ix_(block.columns, block.columns)])
            own += np.einsum("ks,st,kt->k", terms, part.chance, terms) * seen
        start = end
    return out


def alike(effects: Effects, name: str, size: float, margin: float) -> frozenset[str]:
    """Mechanisms whose Q, refitted, would be less than the margin above that of one of a coded size.

    What fresh runs then show between them is their own noise.
    """
    index = effects.names.index(name)
    apart = effects.apart(index)[:, np.abs(SIZES - size).argmin()]
    others = (rival for rival in range(len(effects.names)) if rival != index)
    return frozenset(effects.names[rival] for rival in others if apart[rival] < margin)


@dataclass(frozen=True)
class Visibility:
    """What the data could show of a mechanism."""

    name: str
    gamma80: float
    """Smallest coded size that is found, and told from every other, with the power of the settings; infinite
    if the largest is not."""
    share: float
    """Share of its squared signature that calibration cannot take up."""
    resolvable: bool
    """Whether a size in its range is; or what was declared."""


def visibilities(effects: Effects, shares: np.ndarray, settings: Settings) -> tuple[Visibility, ...]:
    """Power of the data for every mechanism.

    Parameters
    ----------
    effects : Effects
        Beside the calibrated base.
    shares : (mechanisms,) array
        See `Visibility`.
    settings : Settings
    """
    out = []
    for name, power, share in zip(effects.names, effects.power(settings), shares, strict=True):
        gamma80 = smallest_shown(power, settings)
        resolvable = np.isfinite(gamma80) if settings.resolvable is None else name in settings.resolvable
        out.append(Visibility(name, gamma80, float(share), bool(resolvable)))
    return tuple(out)


def smallest_shown(power: np.ndarray, settings: Settings) -> float:
    """Smallest coded size that is shown with the power of the settings, infinite if none is.

    Parameters
    ----------
    power : (sizes,) array
        At the coded `SIZES`.
    settings : Settings
    """
    shown = power >= settings.power
    return float(SIZES[shown.argmax()]) if shown.any() else float("inf")
