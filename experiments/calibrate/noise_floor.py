"""Stage (a): how much a heap varies from seed to seed."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from doe import Factor, NoiseFloor, noise_floor
from experiments.calibrate.cases import failure_summary, middle, plan_cases, scene_cases, values_of
from experiments.calibrate.responses import each_response, scenes_of
from experiments.calibrate.results import Decision, NoiseFloorResult
from experiments.calibrate.values import quantity
from experiments.studyfile.campaign import NoiseFloorSettings, Response, SeedSettings

STAGE = "noise_floor"


def plan_noise_floor(
    factors: Sequence[Factor],
    settings: NoiseFloorSettings,
    seeds: SeedSettings,
    responses: Sequence[Response] = (),
) -> pd.DataFrame:
    """Lay out replicates with every factor at its middle."""
    center = pd.DataFrame([middle(factors)], index=[1])
    return plan_cases(factors, STAGE, center, settings.replicates, seeds.campaign, scenes_of(responses))


def analyse_noise_floor(
    settings: NoiseFloorSettings, cases: pd.DataFrame, responses: Sequence[Response] = ()
) -> NoiseFloorResult:
    """Measure mean and standard deviation of the replicates.

    Raises
    ------
    StageEnd
        When fewer than two of them gave an angle.
    """
    heaps = scene_cases(cases)
    floor = noise_floor(values_of(heaps, STAGE), settings.confidence)
    others = each_response(
        responses,
        cases,
        lambda found, column: noise_floor(values_of(found, STAGE, column), settings.confidence),
    )
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
        f"{low:.2f} to {high:.2f} deg) about {floor.mean:.2f} deg. {failure_summary(heaps)}".strip(),
    )
    return NoiseFloorResult(heaps, floor, (decision, *_responses(responses, others)), others)


def _responses(responses: Sequence[Response], floors: dict[str, NoiseFloor]) -> list[Decision]:
    """Say how much the other responses vary; nothing where the angle is alone."""
    if not floors:
        return []
    spreads = [
        f"{r.name} by {quantity(floors[r.name].sd, r.unit)} about {quantity(floors[r.name].mean, r.unit)}"
        for r in responses
    ]
    return [
        Decision(
            STAGE,
            "The same cases, and as many of every further scene, give the noise of the other responses.",
            {f"sd of {name}": floor.sd for name, floor in floors.items()},
            f"A single case varies in {', '.join(spreads)} (standard deviation).",
        )
    ]
