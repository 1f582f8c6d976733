"""A search for what a study lacks: its library, its rules, its bank, and the analysis of one data set."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from dem_warp import EDEM
from doe.discrepancy import (
    Analysis,
    Bank,
    Measured,
    MechanismRange,
    SearchSpace,
    Settings,
    Simulator,
    analyse,
    bank_points,
    fit_emulator,
    fitted,
    load_bank,
    make_bank,
    settings_of,
)
from experiments.cases import engine_of
from experiments.cases.engines.key import engine_identity
from experiments.discover.maker import notes_on
from experiments.discover.mechanism_files import FORMER_NAMES, library_for, with_maximum
from experiments.discover.mirror import odd_observables
from experiments.io.errors import InputError, StudyError
from experiments.io.texts import nearest_name
from experiments.studyfile import Study
from experiments.studyfile.campaign import near_readings
from experiments.studyfile.mechanism_factor import MechanismFactor

WITHOUT_EFFECT = (
    "name", "note", "companion", "target", "response", "direct", "candidate", "campaign", "discover",
    "factor", "engine",
)  # fmt: skip
"""Keys of a study that change no heap at given factors; of its engine, the identity does."""


@dataclass(frozen=True)
class Search:
    """Mechanisms that are looked for, and the rules; settled before the data are opened."""

    study: Study
    library: tuple[MechanismFactor, ...]
    settings: Settings

    @classmethod
    def of(cls, study: Study) -> Search:
        """Read the search of a study, as its ``[discover]`` has it.

        Raise StudyError when the study cannot be searched: nothing varies, every condition is held out, or
        ``[discover]`` names what it cannot have.
        """
        file = str(study.file)
        if not study.factors:
            raise StudyError(file, "needs at least one [[factor]], as a search calibrates first")
        if all(condition.held_out for condition in study.conditions):
            names = ", ".join(condition.name for condition in study.conditions)
            raise StudyError(file, f"at least one condition must not be held out, got {names}")
        settings = settings_of(study.discover.settings, f"{file}: discover.settings")
        return cls(study, _wanted(study), settings)

    @property
    def space(self) -> SearchSpace:
        """Names and ranges of all that varies; a direct reading narrows the range of its factor."""
        factors, conditions = near_readings(self.study.factors, self.study.direct), self.study.conditions
        return SearchSpace(
            tuple(factor.name for factor in factors),
            tuple(factor.low for factor in factors),
            tuple(factor.high for factor in factors),
            tuple(condition.name for condition in conditions),
            tuple(condition.held_out for condition in conditions),
            tuple(
                MechanismRange(one.name, one.null, one.maximum, one.directed, one.saturation, one.removal)
                for one in self.library
            ),
            odd_observables(self.study),
        )

    @property
    def fingerprint(self) -> str:
        """Hash of all of the study that determines a heap at given factors."""
        described = self.study.identity
        document = {key: value for key, value in described["study"].items() if key not in WITHOUT_EFFECT}
        if "condition" in document:  # the camera changes no heap
            conditions = document["condition"].items()
            document["condition"] = {
                n: {k: v for k, v in each.items() if k != "camera"} for n, each in conditions
            }
        if "measurement" in document:  # outlines are more to see of the same heaps
            document["measurement"] = {k: v for k, v in document["measurement"].items() if k != "outline"}
        if self.study.solver.laws == EDEM:
            document.pop("solver", None)  # as from before laws had names
        engine = engine_of(self.study)
        others = [] if engine is None else [engine_identity(engine)]
        text = json.dumps([document, described["clump_sha256"], *others], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    def make_bank(self, simulator: Simulator, maker: Mapping[str, str] | None = None) -> Bank:
        """Simulate the points of the bank in one call; ``maker`` describes the engine of the simulator.

        Raise RuleError when too few of them finish for an emulator.
        """
        points = bank_points(self.space, self.settings)
        outcomes = simulator(points)
        return fitted(make_bank(self.space, simulator.observables, points, outcomes, self.fingerprint, maker))

    def read_bank(self, path: Path) -> Bank:
        """Read a bank that was made for this study.

        Raise InputError when the file is no bank, or that of another study.
        """
        bank, mine = _up_to_date(load_bank(path).renamed(FORMER_NAMES), self.space), self.space
        its = bank.space
        if bank.study not in ("", self.fingerprint) or its.without(*its.names) != mine.without(*mine.names):
            problem = "is the bank of a study with another grain, test, scale, factor or condition"
            raise InputError(str(path), problem)
        if not any(mechanism in mine.mechanisms for mechanism in its.mechanisms):
            raise InputError(str(path), "must hold a mechanism that is looked for", ", ".join(its.names))
        return bank

    def analysis(self, measured: Measured, bank: Bank, seed: int) -> Analysis:
        """Begin the analysis of a data set."""
        emulator = fit_emulator(bank)
        known = self.space.mechanisms
        foreign = [one.name for one in emulator.space.mechanisms if one not in known]
        lacking = [one.name for one in known if one not in bank.space.mechanisms]
        notes = [f"{name} is not in the bank, so it was not looked for" for name in lacking]
        ranges = zip(self.space.factors, self.space.lower, self.space.upper, strict=True)
        notes += [
            f"{name} is searched from {low:.4g} to {high:.4g}, three standard errors about its direct reading"
            for name, low, high in ranges
            if name in {one.factor for one in self.study.direct}
        ]
        notes += notes_on(bank.maker, engine_of(self.study))
        emulator = replace(emulator.without(*foreign), notes=(*emulator.notes, *notes))
        return analyse(measured, emulator, self.settings, seed)


def _up_to_date(bank: Bank, space: SearchSpace) -> Bank:
    """Return a bank with what older ones do not say, as what a mirror turns over, and what saturates."""
    bank = bank.saturating({one.name: one.saturation for one in space.mechanisms})
    known = {one.name: (one.directed, one.removal) for one in space.mechanisms}
    own = [(one, *known.get(one.name, (False, ""))) for one in bank.space.mechanisms]
    mechanisms = tuple(replace(one, directed=directed, removal=removal) for one, directed, removal in own)
    odd = tuple(name for name in space.odd if name in bank.observables)
    return replace(bank, space=replace(bank.space, mechanisms=mechanisms, odd=odd))


def _wanted(study: Study) -> tuple[MechanismFactor, ...]:
    library = {mechanism.name: mechanism for mechanism in library_for(study)}
    if not library:
        raise StudyError(str(study.file), "has room for no mechanism of the library")
    names = [FORMER_NAMES.get(name, name) for name in study.discover.mechanisms or ()]
    maxima = {FORMER_NAMES.get(name, name): size for name, size in study.discover.maxima.items()}
    for key, named in (("mechanisms", names), ("maxima", maxima)):
        for name in named:
            if name not in library:
                rule = f"must name mechanisms that the study can have, {nearest_name(name, list(library))}"
                raise StudyError(f"{study.file}: discover.{key}", rule, name)
    library |= {name: with_maximum(study, library[name], size) for name, size in maxima.items()}
    return tuple(library[name] for name in sorted(names or library))
