"""The engine as a simulator: points in, simulated all at once, measured, kept; observables out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache

import numpy as np

from dem_warp import Case, CaseResult
from dem_warp.result import OnProgress
from doe.discrepancy import Outcomes, Point
from experiments.cases import Engine, Workers, engine_of
from experiments.cases.engines.key import case_key
from experiments.cases.execute import CaseRunner
from experiments.cases.store.outcome_table import Outcome, OutcomeTable
from experiments.cases.workers.own import THIS_MACHINE
from experiments.io.errors import StudyError
from experiments.measurement.case_observables import measure
from experiments.studyfile import Study
from experiments.studyfile.mechanism_factor import MechanismFactor, with_mechanisms
from experiments.studyfile.observables import BY_NAME, VERSION
from experiments.studyfile.study import MeasurementSection


class EngineSimulator:
    """Answers points of a study with the observables of its test, simulated by the study's engine.

    All points of a call are simulated as one batch; they are measured in processes of their
    own while the next are simulated, and kept. A point whose case a study refuses has that as its reason.

    Use it as a context, or call `close`, to end its processes.

    Parameters
    ----------
    study
        The study with its conditions.
    library
        Mechanisms that points may name, from its `library_for`.
    table
        Table that keeps outcomes; what is there already is not simulated again.
    workers
        Workers that simulate.
    engine
        Simulates in the place of the study's engine.

    Raises
    ------
    StudyError
        When the study's engine cannot be used.
    """

    def __init__(
        self,
        study: Study,
        library: Sequence[MechanismFactor],
        table: OutcomeTable,
        workers: Workers = THIS_MACHINE,
        engine: Engine | None = None,
    ) -> None:
        self.study, self.table, self.engine = study, table, engine or engine_of(study)
        names = [each.name for each in study.measurable]
        reported = getattr(self.engine, "observables", names)
        seen = [name for name in names if name in BY_NAME and BY_NAME[name].by_photograph]
        self.observables = tuple(name for name in names if name in (*seen, *reported))
        """Names of what it answers with."""
        self._workers = workers
        self._runner = CaseRunner(table, _measured, workers, self.engine)
        self._library = {mechanism.name: mechanism for mechanism in library}
        self._factors = [factor.name for factor in study.factors]
        self._conditions = [condition.name for condition in study.conditions]
        self._extended = lru_cache(maxsize=None)(self._extend)

    def __enter__(self) -> EngineSimulator:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        self._runner.close()

    def __call__(
        self,
        points: Sequence[Point],
        progress: OnProgress | None = None,
        person: Callable[[Mapping[str, Point]], Mapping[str, Outcome]] | None = None,
    ) -> Outcomes:
        """Return the observables of every point, in order; `progress` is called with the progress.

        A `person` answers points by the keys of their cases, in the place of the engine.

        Raise ValueError when a point names an unknown mechanism or condition, or has not one value for every
        factor.
        """
        cases: dict[str, Case] = {}
        keys, refused = [], {}
        for point in points:
            try:
                case = self.case(point)
                keys.append(self.key(case))
                cases[keys[-1]] = case
            except StudyError as error:
                keys.append(f"refused: {error}")
                refused[keys[-1]] = (np.full(len(self.observables), np.nan), error.problem)
        found = self.table.load(list(cases)) | refused
        missing = {key: case for key, case in cases.items() if key not in found}
        if person is not None:
            asked = {key: point for key, point in zip(keys, points, strict=True) if key in missing}
            found, missing = found | dict(person(asked)), {}
        found |= self._runner.run(missing, lambda key: (self.study.measurement, self.observables), progress)
        values = np.array([found[key][0] for key in keys]).reshape(len(keys), len(self.observables))
        return Outcomes(values, tuple(found[key][1] for key in keys))

    def heaps(self, points: Sequence[Point]) -> list[CaseResult]:
        """Simulate a few points for their heaps, of which the table keeps the observables only."""
        return self._workers.simulate([self.case(point) for point in points], self.engine)

    def case(self, point: Point) -> Case:
        """Build the case of a point; StudyError where the study refuses it."""
        if len(point.theta) != len(self._factors):
            rule = f"Point.theta: must be one value for each of {', '.join(self._factors)}"
            raise ValueError(f"{rule}, got {point.theta!r}")
        if unknown := [name for name, _ in point.sizes if name not in self._library]:
            raise ValueError(f"Point.sizes: must name mechanisms of the library, got {', '.join(unknown)}")
        if point.condition not in self._conditions:
            rule = f"Point.condition: must be one of {', '.join(self._conditions)}"
            raise ValueError(f"{rule}, got {point.condition!r}")
        study = self._extended(tuple(name for name, _ in point.sizes), point.condition)
        settings = dict(zip(self._factors, point.theta, strict=True)) | dict(point.sizes)
        return study.case(settings, point.seed)

    def key(self, case: Case) -> str:
        """Key of a case: a hash of all that determines its observables."""
        reading = {"measurement": self.study.measurement.settings, "observables": VERSION}
        return case_key(case, self.engine, **reading)

    def _extend(self, names: tuple[str, ...], condition: str) -> Study:
        mechanisms = [self._library[name] for name in names]
        return with_mechanisms(self.study, mechanisms).under(condition)


def _measured(result: CaseResult, settings: MeasurementSection, names: tuple[str, ...]) -> Outcome:
    return measure(settings, result, names)
