"""Studies: one TOML file each, its sections and units, every rule checked with the place of a breach."""

from experiments.errors import StudyError
from experiments.studyfile.conditions import Condition
from experiments.studyfile.study import BUCKWHEAT, Study, load_card, load_study, study_scales
from experiments.studyfile.template import write_template

__all__ = [
    "BUCKWHEAT",
    "Condition",
    "Study",
    "StudyError",
    "load_card",
    "load_study",
    "study_scales",
    "write_template",
]
