"""Stage (a): how much a heap varies from seed to seed."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from doe import Factor, noise_floor
from experiments.calibrate.cases import angles_of, failure_summary, middle, plan_cases
from experiments.calibrate.results import Decision, NoiseFloorResult
from experiments.calibrate.settings import NoiseFloorSettings, SeedSettings

STAGE = "noise_floor"


def plan_noise_floor(
    factors: Sequence[Factor], settings: NoiseFloorSettings, seeds: SeedSettings
) -> pd.DataFrame:
    """Lay out replicates with every factor at its middle."""
    center = pd.DataFrame([middle(factors)], index=[1])
    return plan_cases(factors, STAGE, center, settings.replicates, seeds.campaign)


def analyse_noise_floor(settings: NoiseFloorSettings, cases: pd.DataFrame) -> NoiseFloorResult:
    """Measure mean and standard deviation of the replicates.

    Raises
    ------
    StageEnd
        When fewer than two of them gave an angle.
    """
    floor = noise_floor(angles_of(cases, STAGE), settings.confidence)
    low, high = floor.sd_interval
    decision = Decision(
        STAGE,
        "Cases with every factor at its middle and different seeds give the noise floor.",
        {
            "mean [deg]": floor.mean,
            "sd [deg]": floor.sd,
            "n": floor.sample.n,
            "sd low [deg]": low,
            "sd high [deg]": high,
            "confidence": settings.confidence,
        },
        f"A single heap varies by {floor.sd:.2f} deg (standard deviation; {settings.confidence:.0%} interval "
        f"{low:.2f} to {high:.2f} deg) about {floor.mean:.2f} deg. {failure_summary(cases)}".strip(),
    )
    return NoiseFloorResult(cases, floor, (decision,))
