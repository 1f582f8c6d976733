"""The calibration campaign: from the noise floor to the verified optimum."""

from experiments.calibrate.campaign import calibrate
from experiments.calibrate.cases import Runner, case_seed
from experiments.calibrate.results import Campaign, ClimbEnd, Decision, Outcome
from experiments.studyfile.campaign import CampaignSettings, Response, Target, Twin

__all__ = [
    "Campaign",
    "CampaignSettings",
    "ClimbEnd",
    "Decision",
    "Outcome",
    "Response",
    "Runner",
    "Target",
    "Twin",
    "calibrate",
    "case_seed",
]
