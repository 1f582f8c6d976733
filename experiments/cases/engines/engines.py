"""Engines by name, those that ship and those of packages from outside, and the engine of a study."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from dem_warp import Case, CaseResult
from dem_warp.registry import Registry
from experiments.cases.engines.contract import command_program
from experiments.cases.engines.driver import Driver
from experiments.cases.engines.engine import Engine
from experiments.cases.engines.program import ProgramEngine
from experiments.io.errors import InputError, StudyError
from experiments.studyfile import Study
from experiments.studyfile.engine_section import EngineSection, quoted
from experiments.studyfile.solver_section import CARD_SOLVER, OWN_SOLVER

HAND = "hand"
"""Engine of a person."""


def _check(name: str, engine: object, known: object) -> None:
    if not callable(engine):
        raise TypeError(f"must be a function of cases, got {engine!r}")


_DRIVERS = {name: ProgramEngine(Driver(name)) for name in ("liggghts", "lammps", "yade")}

ENGINES: Registry[Engine] = Registry("dem_warp.engines", _DRIVERS, _check)
"""Engines by name: drivers of other codes, and those of installed packages."""


@dataclass(frozen=True)
class _Person:
    """A person who simulates cases in another program: campaigns and searches write sheets of them."""

    observables: tuple[str, ...] = ()
    """Observables that the sheets of a search ask for, next to those that heaps show."""
    identity: str = "by hand"

    def __call__(self, cases: Sequence[Case], *others: Any, **options: Any) -> list[CaseResult]:
        raise InputError(
            "engine.by",
            "a person simulates this study's cases; only calibrate, plan, bridge and discover wait for them",
        )


def with_engine(study: Study, name: str | None = None, command: str | None = None, **limits: Any) -> Study:
    """Return a study whose cases another engine simulates, by its name or its command; None: its own.

    Further keys of the section, e.g. ``time_limit``, replace the study's; None leaves one as it is. The files
    of a command are searched in the current folder.

    Raise InputError when no engine has this name, the command is not valid, or both are given.
    """
    if name is None and command is None:
        return study
    if name is not None and command is not None:
        raise InputError("engine", "cannot have both a name and a command", f"{name}; {command}")
    if name is not None and name not in (*ENGINES, HAND):
        raise InputError("engine", f"must be one of {', '.join(ENGINES) or 'none'}", name)
    own = study.document.get("engine", {})
    kept = {key: value for key, value in own.items() if key not in ("name", "command", "by")}
    if command is not None:
        words = command_program(command, Path.cwd(), "--command").words
        chosen = {"command": " ".join(map(quoted, words))}
    else:
        chosen = {"by": HAND} if name == HAND else {"name": str(name)}
    given = {key: value for key, value in limits.items() if value is not None}
    return study.with_engine(kept | chosen | given)


def engine_of(study: Study) -> Engine | None:
    """Return the engine that a study names; None is that of dem-warp.

    Raise StudyError when no engine has this name, its program is missing, it cannot simulate the study's
    cases, it does not take the settings of a program, or the study's card was corrected for another solver.
    """
    section, place = study.engine, f"{study.file}: engine"
    solver, solver_place = study.solver, f"{study.file}: solver.{CARD_SOLVER}"
    if section is None:
        solver.check_solver(OWN_SOLVER, solver_place)
        return None
    if section.name is None:
        declared = dict.fromkeys(name for scene in study.scenes.values() for name in scene.observables)
        _check_observables(section.observables, list(declared), f"{place}.observables")
    if section.by is not None:
        return _Person(section.observables)
    if section.command is not None:
        more = (section.version, section.observables)
        command = command_program(section.command, study.file.parent, f"{place}.command", *more)
        solver.check_solver(command.name, solver_place)
        return ProgramEngine(command, section.workers, section.time_limit)
    engine = _engine_named(section, place)
    solver.check_solver(str(section.name), solver_place)
    check = getattr(engine, "check", None)
    if check is not None:
        try:
            check(study.case({}, seed=0))
        except InputError as error:
            # each on its own line: a code may lack more than one thing
            found = (replace(problem, place=place) for problem in error.problems)
            raise StudyError.of(found) from None
        except ValueError as error:
            raise StudyError(place, f"cannot run this study: {error}", section.name) from None
    return engine


def _check_observables(names: tuple[str, ...], known: list[str], place: str) -> None:
    """Refuse names that no scene of the study declares; a heap's shape is measured here."""
    if unknown := [name for name in names if name not in known]:
        rule = f"must be of {', '.join(known)}, as the heap shows the others"
        raise StudyError(place, rule, ", ".join(unknown))


def _engine_named(section: EngineSection, place: str) -> Engine:
    """Return the engine of a section's name, with the section's limits."""
    if section.name is None or section.name not in ENGINES:
        rule = f"must be one of {', '.join(ENGINES) or 'none'}"
        raise StudyError(f"{place}.name", rule, section.name)
    engine = ENGINES[section.name]
    if section.version or section.observables:
        rule = "version and observables are settings of a command"
        raise StudyError(place, rule, section.version or list(section.observables))
    driver = engine.program if isinstance(engine, ProgramEngine) else None
    if section.approximate and not isinstance(driver, Driver):
        raise StudyError(f"{place}.approximate", "is a setting of the codes that a case is exported to", True)
    if isinstance(driver, Driver):
        return ProgramEngine(Driver(driver.name, section.approximate), section.workers, section.time_limit)
    if isinstance(engine, ProgramEngine):
        return replace(engine, workers=section.workers, time_limit=section.time_limit)
    if section.time_limit is not None:
        raise StudyError(place, "this engine runs no program that a limit could end", section.time_limit)
    return engine
