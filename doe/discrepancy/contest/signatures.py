"""Signatures: the mark of each mechanism in the data, beyond what calibrated factors take up."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.linalg import block_diag

from doe.discrepancy.fitting.fitted_model import Model
from doe.discrepancy.fitting.measured_means import Block
from doe.discrepancy.fitting.model_fit import Fitted

SECANT = 0.5
"""Coded size at which a signature is taken: effect per unit of size."""
LEAST_LENGTH = 1e-6
"""Length of a (whitened) signature below which it is invisible."""


def signature(
    model: Model, blocks: Sequence[Block], theta: np.ndarray, name: str, heading: float = 0.0
) -> np.ndarray:
    """Compute the addition of a mechanism to the means of conditions per unit of its coded size, (means,)."""
    return secants(model, blocks, theta, name, np.array([SECANT]), heading)[0] / SECANT


def secants(
    model: Model,
    blocks: Sequence[Block],
    theta: np.ndarray,
    name: str,
    sizes: np.ndarray,
    heading: float = 0.0,
) -> np.ndarray:
    """Compute the emulated addition of a mechanism to the means at coded sizes (n,), (n, means)."""
    x = np.column_stack([np.repeat(theta[None], len(sizes), axis=0), sizes])
    parts = []
    for block in blocks:
        surfaces = model.emulator.surfaces[block.condition]
        difference = surfaces.predict(x, (name,)) - surfaces.predict(theta[None], ())
        difference = difference * replace(model, heading=heading).turn(block.condition)
        parts.append(difference[:, block.columns])
    return np.concatenate(parts, axis=1)


def projector(sensitivities: np.ndarray) -> np.ndarray:
    """Return I - J J+, which leaves the part of whitened means beyond a refit of the free parameters."""
    return np.eye(len(sensitivities)) - sensitivities @ np.linalg.pinv(sensitivities)


@dataclass(frozen=True, eq=False)
class Signatures:
    """Signatures of mechanisms that a fitted model lacks, whitened by its covariance."""

    names: tuple[str, ...]
    whole: np.ndarray
    """Effect of a unit of coded size, (mechanisms, means)."""
    visible: np.ndarray
    """Part that a refit leaves, (mechanisms, means)."""
    turned_names: tuple[str, ...] = ()
    turned: np.ndarray = field(default_factory=lambda: np.empty((0, 0)))
    """Directed mechanisms, and that part of them from behind, (directed mechanisms, means)."""

    @property
    def directions(self) -> np.ndarray:
        """Visible signatures of length one; zeros where nothing is visible, (mechanisms, means)."""
        return _of_length_one(self.visible)

    @property
    def turned_directions(self) -> np.ndarray:
        """Directions of the signatures from behind, (directed mechanisms, means)."""
        return _of_length_one(self.turned)

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


def _of_length_one(visible: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(visible, axis=1, keepdims=True)
    return np.asarray(np.where(length > LEAST_LENGTH, visible / np.maximum(length, LEAST_LENGTH), 0.0))


def unshared(seen: Signatures, fitted: Fitted) -> Signatures:
    """Remove from signatures the errors of the bank that are in the residuals as well.

    The addition of a mechanism is emulated as a difference from the base, and the base's error is in it and
    in the residuals: they seem to point at mechanisms where nothing is missing. The estimate of that error
    from the residuals is taken out of the visible parts; the rest is independent of the residuals if nothing
    is missing. Nothing is taken out of a model that fresh runs have corrected.
    """
    if fitted.model.corrections or not seen.names:
        return seen
    project = projector(fitted.sensitivities)
    left = fitted.whitening.T @ (project @ fitted.residuals)
    shared = {name: _shared_errors(fitted, name) @ left for name in seen.names}
    visible, turned = (
        part - np.array([shared[name] for name in names]).reshape(part.shape) @ fitted.whitening.T @ project
        for part, names in ((seen.visible, seen.names), (seen.turned, seen.turned_names))
    )
    return replace(seen, visible=visible, turned=turned)


def _shared_errors(fitted: Fitted, name: str) -> np.ndarray:
    """Return the covariance of errors of a signature with those of the residuals, (means, means)."""
    parts = []
    for block in fitted.stack.blocks:
        surfaces = fitted.model.emulator.surfaces[block.condition]
        covariance = surfaces.shared_error(fitted.x, fitted.mechanisms, name, SECANT) / SECANT
        parts.append(covariance[block.square])
    return np.asarray(block_diag(*parts))


def signatures(fitted: Fitted) -> Signatures:
    """Compute signatures of the mechanisms that are not in a fitted model."""
    emulator, blocks = fitted.model.emulator, fitted.stack.blocks
    names = tuple(name for name in emulator.space.names if name not in fitted.mechanisms)
    theta = fitted.x[: len(emulator.space.factors)]
    turned = tuple(name for name in names if emulator.space.odd and emulator.space.mechanism(name).directed)
    seen = [signature(fitted.model, blocks, theta, name) for name in names]
    seen += [signature(fitted.model, blocks, theta, name, 180.0) for name in turned]
    whole = np.array(seen).reshape(len(seen), len(fitted.covariance)) @ fitted.whitening.T
    visible = whole @ projector(fitted.sensitivities)
    count = len(names)
    return Signatures(names, whole[:count], visible[:count], turned, visible[count:])
