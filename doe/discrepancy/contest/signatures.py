"""Signatures: the mark of each mechanism in the data, beyond what a calibration of the factors takes up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from doe.discrepancy.emulation.emulator import Emulator
from doe.discrepancy.fitting.evidence import Block
from doe.discrepancy.fitting.fit import Fitted

SECANT = 0.5
"""Coded size at which a signature is taken: an effect a unit of size."""
LEAST_LENGTH = 1e-6
"""A signature that is shorter (whitened) is not seen at all."""


def signature(emulator: Emulator, blocks: Sequence[Block], theta: np.ndarray, name: str) -> np.ndarray:
    """Compute what a mechanism adds to the means of conditions for a unit of its coded size, (means,)."""
    return secants(emulator, blocks, theta, name, np.array([SECANT]))[0] / SECANT


def secants(
    emulator: Emulator, blocks: Sequence[Block], theta: np.ndarray, name: str, sizes: np.ndarray
) -> np.ndarray:
    """Compute what a mechanism adds to the means at coded sizes (n,), (n, means)."""
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
    """Part that a refit leaves of it, (mechanisms, means)."""

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
