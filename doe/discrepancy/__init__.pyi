"""The public names: each is loaded with its module when it is first used."""

from .analysis import Analysis, analyse, drive
from .contest.gap import Answer, Question
from .contest.power import Power
from .contest.slips import Slip
from .emulation.bank import Bank, bank_points, load_bank, make_bank
from .emulation.emulator import Emulator, fit_emulator, fitted
from .fitting.model_fit import Interval
from .problem.outcomes import Outcomes, Point, Simulator
from .problem.replicates import Calibration, Measured
from .problem.settings import Settings, settings_of
from .problem.space import MechanismRange, SearchSpace
from .verdict.before_after import BeforeAfter
from .verdict.discovery import (
    CalibrationUse,
    Candidate,
    Confounding,
    Data,
    Discovery,
    Drift,
    Effort,
    Fit,
    Gap,
    Verdict,
)
from .verdict.next_experiment import NextExperiment

__all__ = [
    "Analysis",
    "Answer",
    "Bank",
    "BeforeAfter",
    "Calibration",
    "CalibrationUse",
    "Candidate",
    "Confounding",
    "Data",
    "Discovery",
    "Drift",
    "Effort",
    "Emulator",
    "Fit",
    "Gap",
    "Interval",
    "Measured",
    "MechanismRange",
    "NextExperiment",
    "Outcomes",
    "Point",
    "Power",
    "Question",
    "SearchSpace",
    "Settings",
    "Simulator",
    "Slip",
    "Verdict",
    "analyse",
    "bank_points",
    "drive",
    "fit_emulator",
    "fitted",
    "load_bank",
    "make_bank",
    "settings_of",
]
