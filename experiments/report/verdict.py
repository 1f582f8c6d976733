"""Verdict of a campaign in words; its numbers are elsewhere on the page."""

from __future__ import annotations

from collections.abc import Iterable

from experiments.calibrate.campaign import Campaign
from experiments.calibrate.results import Outcome
from experiments.report.kit.numbers import enumeration
from experiments.report.kit.sentences import say

HEADLINES = {
    Outcome.CALIBRATED: "Calibrated",
    Outcome.UNDECIDED: "No difference found",
    Outcome.MISSED: "Target missed",
    Outcome.NO_SIGNIFICANT_FACTOR: "No significant factor",
    Outcome.TARGET_NOT_REACHED: "Target not reached",
    Outcome.PLATEAU: "Plateau before the target",
    Outcome.BOX_TOO_SMALL: "Box of the surface too small for the noise",
    Outcome.NO_CONTOUR: "No setting gives the target",
    Outcome.TOO_MANY_FAILED_RUNS: "Too many failed runs",
}
"""Outcomes in a few words."""


def headline(campaign: Campaign) -> str:
    """Say in a few words how a campaign ended."""
    if campaign.outcome is Outcome.CALIBRATED and campaign.optimum and campaign.optimum.pins_nothing:
        return "Target met; values not pinned"
    return HEADLINES[campaign.outcome]


def verdict_sentence(campaign: Campaign) -> str:
    """Say how a campaign ended; one that ended before its verification with its own reason."""
    if campaign.verification is None:
        return campaign.reason
    tests = campaign.verification.responses
    if missed := [name for name, test in tests.items() if test.different]:
        return say("ending.missed", names=_words(missed))
    open_ones = [name for name, test in tests.items() if not test.equivalent]
    if open_ones:
        return say("ending.open", names=_words(open_ones))
    return say("ending.met", names=_words(tests))


def _words(names: Iterable[str]) -> str:
    return enumeration(name.replace("_", " ") for name in names)
