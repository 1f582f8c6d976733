"""Stage (a): how much a case varies from seed to seed."""

from __future__ import annotations

import pandas as pd

from doe import noise_floor
from experiments.calibrate.cases import failure_summary, middle, plan_cases, values_of
from experiments.calibrate.results import Decision, NoiseFloorResult
from experiments.calibrate.values import interval_text, key_of, quantity
from experiments.studyfile import Study

STAGE = "noise_floor"


def plan_noise_floor(study: Study) -> pd.DataFrame:
    """Lay out replicates with every factor at its middle."""
    center = pd.DataFrame([middle(study.factors)], index=[1])
    return plan_cases(study, STAGE, center, study.campaign.noise_floor.replicates, study.target.fitted)


def analyse_noise_floor(study: Study, cases: pd.DataFrame) -> NoiseFloorResult:
    """Measure mean and standard deviation of the replicates; StageEnd with fewer than two values."""
    responses, confidence = study.target.fitted, study.campaign.noise_floor.confidence
    floors = {r.name: noise_floor(values_of(cases, STAGE, r), confidence) for r in responses}
    numbers: dict[str, float] = {"confidence": confidence}
    said = []
    for response, floor in zip(responses, floors.values(), strict=True):
        numbers |= {key_of("mean", response): floor.mean, key_of("sd", response): floor.sd}
        numbers |= {f"n of {response.name}": floor.sample.n}
        low, high = floor.sd_interval
        numbers |= {key_of("sd low", response): low, key_of("sd high", response): high}
        said.append(
            f"{response.name} by {quantity(floor.sd, response.unit)} ({confidence:.0%} interval "
            f"{interval_text(floor.sd_interval, response.unit)}) about {quantity(floor.mean, response.unit)}"
        )
    decision = Decision(
        STAGE,
        "Cases with every factor at its middle and different seeds give the noise floor.",
        numbers,
        f"A single case varies in {'; '.join(said)} (standard deviation). "
        f"{failure_summary(cases, *responses)}".strip(),
    )
    return NoiseFloorResult(floors, cases, (decision,))
