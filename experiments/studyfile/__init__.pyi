"""The public names: each is loaded with its module when it is first used."""

from .conditions import Condition
from .new_study import write_template
from .study import BUCKWHEAT, Study, StudyError, load_card, load_study, study_scales

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
