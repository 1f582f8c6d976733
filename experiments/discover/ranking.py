"""What each mechanism would look like in the data, beyond what a calibration of the factors can take up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from experiments.discover.emulator import Emulator
from experiments.discover.evidence import Block
from experiments.discover.fitting import Fitted
from experiments.discover.settings import Settings

SECANT = 0.5
"""Coded size at which a signature is taken: an effect a unit of size."""
SIZES = np.linspace(0.0, 1.0, 201)[1:]
"""Coded sizes that the smallest visible one is searched on."""
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
    """Mechanisms beside a fitted model, whitened by its covariance.

    Attributes
    ----------
    names : tuple of str
    whole : (mechanisms, means) array
        Effect of a unit of coded size.
    visible : (mechanisms, means) array
        What a refit leaves of it.
    noise : (mechanisms,) array
        Squared length that the bank's noise alone would give ``visible``.
    """

    names: tuple[str, ...]
    whole: np.ndarray
    visible: np.ndarray
    noise: np.ndarray

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
    project = projector(fitted.sensitivities)
    noise = np.array([_noise(fitted, project, theta, name) for name in names])
    return Signatures(names, whole, whole @ project, noise)


def _noise(fitted: Fitted, project: np.ndarray, theta: np.ndarray, name: str) -> float:
    """tr(M cov M) of the noise of a whitened signature, cov by conditions."""
    seen = project @ fitted.whitening
    total, start = 0.0, 0
    for block in fitted.stack.blocks:
        error = fitted.model.emulator.surfaces[block.condition].added_noise(theta, SECANT, name)
        part = seen[:, start : start + len(block.columns)]
        total += float(np.sum(part * (part @ error[np.ix_(block.columns, block.columns)])))
        start += len(block.columns)
    return total / SECANT**2


def _apart(seen: Signatures, index: int, rival: int) -> float:
    """Squared visible length of a signature of coded size 1 that its rival cannot take up.

    Two that are the same differ by their noise, which is subtracted.
    """
    own, other = seen.visible[index], seen.visible[rival]
    # A size that is not negative takes up nothing of an opposite signature.
    taken = max(float(own @ other), 0.0) / max(float(other @ other), LEAST_LENGTH**2)
    left = own - taken * other
    return max(float(left @ left) - float(seen.noise[index]) - taken**2 * float(seen.noise[rival]), 0.0)


def alike(seen: Signatures, name: str, size: float, margin: float) -> frozenset[str]:
    """Mechanisms whose Q, refitted, would be less than the margin above that of one of a coded size.

    What fresh runs then show between them is their own noise.
    """
    index = seen.names.index(name)
    others = (rival for rival in range(len(seen.names)) if rival != index)
    return frozenset(seen.names[rival] for rival in others if size**2 * _apart(seen, index, rival) < margin)


@dataclass(frozen=True)
class Visibility:
    """What the data could show of a mechanism.

    Attributes
    ----------
    name : str
    gamma80 : float
        Smallest coded size that is found with the power of the settings; infinite if the largest is not.
    share : float
        Share of its squared signature that calibration cannot take up.
    rival : str
        The mechanism most like it; empty if it is alone.
    apart : float
        Distance from the rival at the largest size, each refitted, in standard deviations.
    resolvable : bool
        Visible within its range and, at its end, apart from every other.
    """

    name: str
    gamma80: float
    share: float
    rival: str
    apart: float
    resolvable: bool


def visibilities(base: Fitted, seen: Signatures, settings: Settings) -> tuple[Visibility, ...]:
    """Power of the data for every mechanism, from the calibrated base.

    A mechanism is found where its visible effect is ``least_ratio`` standard deviations and what the power
    asks beyond. It may be told from a rival if at its largest size that is more likely than a tie: the
    difference in Q of models d apart is d^2 +- 2 d.
    """
    quantile = float(stats.norm.ppf(settings.power))
    project = projector(base.sensitivities) @ base.whitening
    theta = base.x[: len(base.model.emulator.space.factors)]
    correlations = np.maximum(seen.correlations, 0.0) - np.eye(len(seen.names))
    out = []
    for index, name in enumerate(seen.names):
        effects = secants(base.model.emulator, base.stack.blocks, theta, name, SIZES) @ project.T
        squares = (effects**2).sum(axis=1)
        found = np.flatnonzero(squares >= (settings.least_ratio + quantile) ** 2)
        gamma80 = float(SIZES[found[0]]) if len(found) else float("inf")
        closest = int(np.argmax(correlations[index])) if len(seen.names) > 1 else index
        apart = float(np.sqrt(squares.max() if closest == index else _apart(seen, index, closest)))
        rival = seen.names[closest] if closest != index else ""
        resolvable = np.isfinite(gamma80) and (apart**2 >= settings.tie_margin or not rival)
        if settings.resolvable is not None:
            resolvable = name in settings.resolvable
        share = float(seen.shares[index])
        out.append(Visibility(name, gamma80, share, rival, apart, bool(resolvable)))
    return tuple(out)
