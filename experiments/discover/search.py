"""A search for what a study lacks: its library, its rules, its bank, and the analysis of one data set."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, replace
from pathlib import Path

from experiments.cases.folder import describe
from experiments.discover.analysis import Analysis, analyse
from experiments.discover.bank import Bank, Maker, bank_points, load_bank, make_bank
from experiments.discover.discovery import Discovery
from experiments.discover.emulator import fit_emulator
from experiments.discover.library import Mechanism, library_for
from experiments.discover.measured import Measured
from experiments.discover.settings import Settings, settings_of
from experiments.discover.simulator import Simulator
from experiments.discover.space import SearchSpace
from experiments.errors import InputError, StudyError
from experiments.studyfile import Study
from experiments.studyfile.schema import nearest_name

WITHOUT_EFFECT = ("name", "note", "companion", "target", "response", "campaign", "discover", "factor")
"""Keys of a study that change no heap at given factors."""


@dataclass(frozen=True)
class Search:
    """What is looked for, and by which rules; settled before the data are opened.

    Attributes
    ----------
    study : Study
    library : tuple of Mechanism
        Effects that are looked for.
    settings : Settings
    """

    study: Study
    library: tuple[Mechanism, ...]
    settings: Settings

    @classmethod
    def of(cls, study: Study) -> Search:
        """Read the search of a study, as its ``[discover]`` has it.

        Raises
        ------
        StudyError
            When the study cannot be searched: its test leaves no heap, nothing varies, every condition is
            held out, or ``[discover]`` names what it cannot have.
        """
        file = str(study.file)
        if not study.scene.leaves_a_heap:
            raise StudyError("the search measures heaps: [scene.lifted-cylinder]", "another test", file)
        if not study.factors:
            raise StudyError("a search calibrates first, so it needs at least one [[factor]]", "none", file)
        if all(condition.held_out for condition in study.conditions):
            names = ", ".join(condition.name for condition in study.conditions)
            raise StudyError("at least one condition takes part in the fit", f"held out: {names}", file)
        settings = settings_of(study.discover.settings, f"{file}: discover.settings")
        return cls(study, _wanted(study), settings)

    @property
    def space(self) -> SearchSpace:
        """What varies."""
        return SearchSpace.of(self.study, self.library)

    @property
    def fingerprint(self) -> str:
        """Hash of all of the study that determines a heap at given factors."""
        described = describe(self.study)
        document = {key: value for key, value in described["study"].items() if key not in WITHOUT_EFFECT}
        text = json.dumps([document, described["clump_sha256"]], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    def make_bank(self, simulator: Simulator, maker: Maker | None = None) -> Bank:
        """Run the library waves, all in one call.

        Parameters
        ----------
        simulator
            Answers them.
        maker
            What it is; None for what is no engine.
        """
        points = bank_points(self.space, self.settings)
        outcomes = simulator(points)
        return make_bank(self.space, simulator.observables, points, outcomes, self.fingerprint, maker)

    def read_bank(self, path: Path) -> Bank:
        """Read a bank that was made for this study.

        Raises
        ------
        InputError
            When the file is no bank, or that of another study.
        """
        bank = load_bank(path)
        mine = self.space
        if bank.study not in ("", self.fingerprint) or bank.space.without(*bank.space.names) != mine.without(
            *mine.names
        ):
            rule = (
                "must be the bank of this study, at this scale: the same grain, test, factors and conditions"
            )
            raise InputError(rule, "another study's", str(path))
        if not any(mechanism in mine.mechanisms for mechanism in bank.space.mechanisms):
            raise InputError(
                "must hold a mechanism that is looked for", ", ".join(bank.space.names), str(path)
            )
        return bank

    def analysis(self, measured: Measured, bank: Bank, seed: int) -> Analysis:
        """Begin the analysis of a data set."""
        emulator = fit_emulator(bank)
        known = self.space.mechanisms
        foreign = [one.name for one in emulator.space.mechanisms if one not in known]
        lacking = [one.name for one in known if one not in bank.space.mechanisms]
        notes = [f"{name} is not in the bank, so it was not looked for" for name in lacking]
        notes += _notes_on(bank.maker)
        emulator = replace(emulator.without(*foreign), notes=(*emulator.notes, *notes))
        return analyse(measured, emulator, self.settings, seed)


def drive(analysis: Analysis, simulator: Simulator) -> Discovery:
    """Run an analysis to its end, its waves answered by a simulator."""
    try:
        points = next(analysis)
        while True:
            points = analysis.send(simulator(points))
    except StopIteration as end:
        found: Discovery = end.value
        return found


def _notes_on(maker: Maker | None) -> list[str]:
    if maker is None:
        return ["the bank does not say which engine made it"]
    if not maker.is_another_engine:
        return []
    commit = f" (commit {maker.commit})" if maker.commit else ""
    return [f"the bank was made on {maker.day} by another engine{commit} than the fresh runs"]


def _wanted(study: Study) -> tuple[Mechanism, ...]:
    library = {mechanism.name: mechanism for mechanism in library_for(study)}
    if not library:
        raise StudyError("a search needs a mechanism that the study can have", "none", str(study.file))
    names = study.discover.mechanisms
    for name in names or ():
        if name not in library:
            rule = f"must name mechanisms that the study can have, {nearest_name(name, list(library))}"
            raise StudyError(rule, name, f"{study.file}: discover.mechanisms")
    return tuple(library[name] for name in sorted(names or library))
