"""Another code as the simulator of a trial."""

from typing import Any

from dem_warp import Case
from experiments.cases import Workers
from experiments.cases.store.outcome_table import OutcomeTable
from experiments.discover.mechanism_files import library_for
from experiments.evidence.trials.generate_trials import PIXEL_SHARE, STUDY
from experiments.evidence.trials.other_codes.code_effects import OutsideSimulator
from experiments.evidence.trials.other_codes.code_process import liggghts_engine
from experiments.evidence.trials.other_codes.setting import Setting
from experiments.studyfile import Study, load_study


def workshop_study(scale: str) -> Study:
    """Return the trial study with the other workshop's camera."""
    pixels = round(PIXEL_SHARE * load_study(STUDY, scale or None).measurement.pixels)
    return load_study(STUDY, scale or None, {"measurement": {"pixels": pixels}})


class OtherCodeSimulator(OutsideSimulator):
    """Answers points of a trial with the observables of tests that another code ran in its own setting."""

    def __init__(self, study: Study, setting: Setting, table: OutcomeTable, workers: Workers) -> None:
        super().__init__(study, library_for(study), table, workers, engine=liggghts_engine())
        self.setting = setting

    def made(self, case: Case[Any]) -> Case[Any]:
        """Take a case to the other workshop."""
        return self.setting.of(case)
