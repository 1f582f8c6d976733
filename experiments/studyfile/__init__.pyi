"""The public names: each is loaded with its module when it is first used."""

from .conditions import Condition
from .loading import BUCKWHEAT, cheaper_study, load_card, load_study, study_scales
from .new_study import write_template
from .study import Study, StudyError

__all__ = [
    "BUCKWHEAT",
    "Condition",
    "Study",
    "StudyError",
    "cheaper_study",
    "load_card",
    "load_study",
    "study_scales",
    "write_template",
]
