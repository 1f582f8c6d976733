"""Another code as the simulator of a trial."""

from typing import Any

from dem_warp import Case
from doe.discrepancy import Point
from experiments.cases import Workers
from experiments.cases.store.outcome_table import OutcomeTable
from experiments.discover.engine_simulator import EngineSimulator
from experiments.discover.mechanism_files import library_for
from experiments.evidence.trials.generate_trials import PIXEL_SHARE, STUDY
from experiments.evidence.trials.other_codes.code_effects import OUTSIDE
from experiments.evidence.trials.other_codes.code_process import liggghts_engine
from experiments.evidence.trials.other_codes.setting import Setting
from experiments.studyfile import Study, load_study


def workshop_study(scale: str) -> Study:
    """Return the trial study with the other workshop's camera."""
    pixels = round(PIXEL_SHARE * load_study(STUDY, scale or None).measurement.pixels)
    return load_study(STUDY, scale or None, {"measurement": {"pixels": pixels}})


class OtherCodeSimulator(EngineSimulator):
    """Answers points of a trial with the observables of tests that another code ran in its own setting.

    Points may name mechanisms of the library and effects that it lacks.
    """

    def __init__(self, study: Study, setting: Setting, table: OutcomeTable, workers: Workers) -> None:
        super().__init__(study, library_for(study), table, workers, engine=liggghts_engine())
        self.setting = setting

    def case(self, point: Point) -> Case[Any]:
        """Build the case of a point, in the other workshop."""
        known = tuple(size for size in point.sizes if size[0] not in OUTSIDE)
        ours = super().case(Point(point.theta, known, point.condition, point.seed))
        case: Case[Any] = self.setting.of(ours)
        for name, size in point.sizes:
            if name in OUTSIDE:
                case = OUTSIDE[name].change(case, size)
        return case
