"""What is declared before a trial is drawn: which mechanisms the data should show, and from which size on."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from experiments.discover.analysis import analyse
from experiments.discover.discovery import Discovery
from experiments.discover.emulator import Emulator
from experiments.discover.measured import Measured
from experiments.discover.settings import Settings
from experiments.discover.trials.drawing import Effect, Plan
from experiments.errors import InputError
from experiments.files import write_text

KIN = 0.9
"""Mechanisms whose visible signatures correlate by more than this are alike: no data tell them apart."""


@dataclass(frozen=True)
class Declaration:
    """Everything that is fixed before the trials.

    Attributes
    ----------
    study, scale : str
        Name of the study, and its scale ("" for the study as written).
    drawn_on : str
        Date.
    plan : Plan
    settings : Settings
        Of the analysis; what it may name is declared in it.
    library : tuple of Effect
        Mechanisms with their gamma80, at the middle of the factors' ranges, with the plan's replicates.
    strangers : tuple of Effect
        What the library never has.
    """

    study: str
    scale: str
    drawn_on: str
    plan: Plan
    settings: Settings
    library: tuple[Effect, ...]
    strangers: tuple[Effect, ...]

    def write(self, path: Path) -> None:
        """Write it as JSON."""
        document = asdict(self) | {"settings_sha256": self.settings.sha256}
        for effect in (*document["library"], *document["strangers"]):
            effect["gamma80"] = effect["gamma80"] if math.isfinite(effect["gamma80"]) else None
        write_text(path, json.dumps(document, indent=1, allow_nan=False) + "\n")


def read_declaration(path: Path) -> Declaration:
    """Read what `Declaration.write` wrote.

    Raises
    ------
    InputError
        When the settings are not the ones whose hash stands beside them.
    """
    document = json.loads(path.read_text(encoding="utf-8"))
    sha256 = document.pop("settings_sha256")
    settings = document.pop("settings")
    resolvable = settings.pop("resolvable")
    fixed = Settings(**settings, resolvable=None if resolvable is None else tuple(resolvable))
    if fixed.sha256 != sha256:
        raise InputError(f"settings must have the hash {sha256}", fixed.sha256, str(path))
    library, strangers = (tuple(map(_effect, document.pop(name))) for name in ("library", "strangers"))
    plan = Plan(**document.pop("plan"))
    return Declaration(**document, plan=plan, settings=fixed, library=library, strangers=strangers)


def _effect(record: dict[str, Any]) -> Effect:
    gamma80 = math.inf if record["gamma80"] is None else record["gamma80"]
    return Effect(**record | {"gamma80": gamma80, "kin": tuple(record["kin"])})


def declared_effects(emulator: Emulator, settings: Settings, replicates: int) -> tuple[Effect, ...]:
    """What so many replicates of every condition should show of each mechanism of the library.

    An analysis of data that agree with the base model at the middle of every factor's range says so.
    """
    found = _found(analyse(perfect_data(emulator, replicates), emulator, settings, seed=0))
    ranges = {mechanism.name: mechanism for mechanism in emulator.space.mechanisms}
    kin, effects = _kin(found), []
    for power in found.power:
        span = ranges[power.mechanism]
        gamma80 = abs(power.gamma80 - span.null)
        effects.append(Effect(span.name, span.null, span.maximum, gamma80, power.resolvable, kin[span.name]))
    return tuple(effects)


def with_names(settings: Settings, library: Sequence[Effect]) -> Settings:
    """Settings that let an analysis name the resolvable mechanisms and no other."""
    return replace(settings, resolvable=tuple(effect.name for effect in library if effect.resolvable))


def perfect_data(emulator: Emulator, replicates: int) -> Measured:
    """Replicates that scatter as the model's heaps do, about means that are exactly the model's."""
    rng = np.random.default_rng(0)
    middle = np.zeros(len(emulator.space.factors))
    values = {}
    for condition, surfaces in emulator.surfaces.items():
        scatter = rng.multivariate_normal(
            np.zeros(len(emulator.observables)), surfaces.noise.covariance(middle), replicates
        )
        values[condition] = surfaces.predict(middle[None], ()) + scatter - scatter.mean(axis=0)
    return Measured(tuple(values), emulator.observables, values)


def _found(analysis: Any) -> Discovery:
    """End of an analysis that must not need a wave."""
    try:
        next(analysis)
    except StopIteration as end:
        found: Discovery = end.value
        return found
    raise InputError("the base model must agree with its own emulator", "a gap", "declaration")


def _kin(found: Discovery) -> dict[str, tuple[str, ...]]:
    """By mechanism: those that look like it after calibration."""
    if found.confounding is None:
        return {power.mechanism: () for power in found.power}
    names, correlations = found.confounding.mechanisms, np.abs(found.confounding.correlations)
    return {
        name: tuple(other for j, other in enumerate(names) if j != i and correlations[i, j] > KIN)
        for i, name in enumerate(names)
    }
