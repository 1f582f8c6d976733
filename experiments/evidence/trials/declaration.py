"""Declarations before a trial is drawn: which mechanisms the data should show, and from which size on."""

import json
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from doe.discrepancy import Calibration, Emulator, MechanismRange, Settings
from doe.discrepancy.contest.power import Effects, detectable_coded_size
from doe.discrepancy.contest.signatures import signatures
from doe.discrepancy.emulation.bank import sobol_points
from doe.discrepancy.fitting.fitted_model import Model, Stack
from doe.discrepancy.fitting.measured_means import Block
from doe.discrepancy.fitting.model_fit import weigh
from experiments.evidence.trials.truth import read_sealed_json
from experiments.evidence.trials.truths import Declared, Plan
from experiments.io.errors import InputError
from experiments.io.files import write_text
from experiments.studyfile.observables import NAMES

KIN = 0.9
"""Mechanisms whose visible signatures correlate by more than this are alike: no data tell them apart."""

THETAS = 32
"""Points in the ranges of the factors at which the power is taken."""

BLIND = 0.1
"""Largest part of those ranges in which a mechanism that may be named need not show. In the fifth blind
trials plate roughness, which does nothing on a plate of high friction, was missed there."""


@dataclass(frozen=True)
class Declaration:
    """Everything that is fixed before the trials."""

    study: str
    scale: str
    """Name of the study, and its scale ("" for the study as written)."""
    drawn_on: str
    """Date."""
    plan: Plan
    settings: Settings
    """Settings of the analysis; they declare what it may name."""
    library: tuple[Declared, ...]
    """Mechanisms with their detectable sizes, with the plan's replicates."""
    outside: tuple[Declared, ...]
    """Mechanisms that the library never has."""

    def write(self, path: Path) -> None:
        """Write it as JSON."""
        document = asdict(self) | {"settings_sha256": self.settings.sha256}
        for effect in (*document["library"], *document["outside"]):
            effect["detectable"] = effect["detectable"] if math.isfinite(effect["detectable"]) else None
        write_text(path, json.dumps(document, indent=1, allow_nan=False) + "\n")


def read_declaration(path: Path) -> Declaration:
    """Read what `Declaration.write` wrote."""
    document = read_sealed_json(path)
    sha256 = document.pop("settings_sha256")
    settings = document.pop("settings")
    resolvable = settings.pop("resolvable")
    fixed = Settings(**settings, resolvable=None if resolvable is None else tuple(resolvable))
    if fixed.sha256 != sha256:
        raise InputError(str(path), f"settings must have the hash {sha256}", fixed.sha256)
    library, outside = (tuple(map(_effect, document.pop(name))) for name in ("library", "outside"))
    plan = Plan(**document.pop("plan"))
    return Declaration(**document, plan=plan, settings=fixed, library=library, outside=outside)


def _effect(record: dict[str, Any]) -> Declared:
    # Declarations of the first six trials call it gamma80.
    found = record.pop("gamma80" if "gamma80" in record else "detectable")
    detectable = math.inf if found is None else found
    return Declared(**record | {"detectable": detectable, "kin": tuple(record["kin"])})


def declared_effects(
    emulator: Emulator,
    settings: Settings,
    replicates: int,
    observables: Collection[str] = NAMES,
    calibration: Mapping[str, Calibration] | None = None,
) -> tuple[Declared, ...]:
    """Declare what replicates of every condition should show of each mechanism of the library.

    They show the observables that are named: a bank may know more, as outlines; and are off in all conditions
    alike by no more than a calibration has, by observable.
    The power is the mean over the ranges of the factors, as truths are drawn from all of them. A mechanism
    is distinct if the end of its range shows nearly everywhere in them.
    """
    space = emulator.space
    drawn, correlations = [], []
    for theta in 2.0 * sobol_points(THETAS, len(space.factors), seed=0) - 1.0:
        means = perfect_means(emulator, theta, replicates, observables, calibration or {})
        stack = Stack(Model(emulator, (), settings.systematic), means)
        fitted = weigh(stack, theta)
        effects = Effects.of(fitted, signatures(fitted))
        drawn.append(effects.power(settings))
        correlations.append(np.abs(effects.correlations))
    kin = _kin(space.names, np.mean(correlations, axis=0))
    return tuple(
        declared_effect(span, powers, settings, kin[span.name])
        for span, powers in zip(space.mechanisms, np.swapaxes(drawn, 0, 1), strict=True)
    )


def declared_effect(
    span: MechanismRange, powers: np.ndarray, settings: Settings, kin: tuple[str, ...] = ()
) -> Declared:
    """Declare a mechanism of some power, (points, `power.CODED_SIZES`), in the ranges of the factors."""
    coded = detectable_coded_size(powers.mean(axis=0), settings)
    detectable = abs(span.natural(coded) - span.null) if math.isfinite(coded) else math.inf
    distinct = math.isfinite(detectable_coded_size(np.quantile(powers, BLIND, axis=0), settings))
    return Declared(span.name, span.null, span.maximum, detectable, distinct, kin)


def with_names(settings: Settings, library: Sequence[Declared]) -> Settings:
    """Return the settings that let an analysis name the resolvable mechanisms and no other."""
    return replace(settings, resolvable=tuple(effect.name for effect in library if effect.resolvable))


def perfect_means(
    emulator: Emulator,
    theta: np.ndarray,
    replicates: int,
    observables: Collection[str],
    calibration: Mapping[str, Calibration],
) -> tuple[Block, ...]:
    """Means of replicates in every training condition that are exactly the model's at coded theta."""
    numbers = np.flatnonzero(np.isin(emulator.observables, list(observables)))
    means = [
        Block.of_means(condition, numbers, surfaces.predict(theta[None], ())[0][numbers], replicates)
        for condition, surfaces in emulator.surfaces.items()
        if not emulator.space.is_held_out(condition)
    ]
    return tuple(block.calibrated(emulator.observables, calibration) for block in means)


def _kin(names: Sequence[str], correlations: np.ndarray) -> dict[str, tuple[str, ...]]:
    """Mechanisms that look alike after calibration, by mechanism."""
    return {
        name: tuple(other for j, other in enumerate(names) if j != i and correlations[i, j] > KIN)
        for i, name in enumerate(names)
    }
