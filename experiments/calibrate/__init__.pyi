"""The public names: each is loaded with its module when it is first used."""

from .campaign import Campaign
from .cases import Runner, case_seed
from .results import ClimbEnd, Decision, Outcome
from .stages import calibrate

__all__ = [
    "Campaign",
    "ClimbEnd",
    "Decision",
    "Outcome",
    "Runner",
    "calibrate",
    "case_seed",
]
