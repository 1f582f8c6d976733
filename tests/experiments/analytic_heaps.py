"""Campaigns on analytic heaps: the angle is a function of the settings, with noise from the case's seed."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import pandas as pd

from experiments.studyfile import Study
from experiments.studyfile.campaign import CampaignSettings

Angle = Callable[[Mapping[str, float]], float]
Runner = Callable[[pd.DataFrame], pd.DataFrame]

NOISE = 0.35
"""Standard deviation of one analytic heap [deg]."""


def friction(row: Mapping[str, float]) -> float:
    """Both static frictions raise the angle, nothing else does."""
    e, f = (row["E"] - 0.48) / 0.06, (row["F"] - 0.45) / 0.10
    return 30.2 + 3.0 * e + 2.0 * f + 0.7 * e * f - 0.35 * f * f


def analytic_heaps(
    angle: Callable[[Mapping[str, float]], float] = friction,
    fails: Callable[[Mapping[str, float]], bool] = lambda row: False,
) -> Callable[[pd.DataFrame], pd.DataFrame]:
    """Make a runner: the angle is a function of the settings plus noise from the case's seed."""

    def run(table: pd.DataFrame) -> pd.DataFrame:
        rows = table.to_dict("records")
        failed = np.array([fails(row) for row in rows])
        angles = [angle(row) + NOISE * np.random.default_rng(row["seed"]).standard_normal() for row in rows]
        return table.assign(
            status=np.where(failed, "diverged", "finished"),
            reason=np.where(failed, "a grain left <the domain> & fell", ""),
            angle=np.where(failed, np.nan, angles),
            angle_se=0.2,
            grain_count=400.0,
            fill_height=0.028,
            case_key=[f"key-{row['seed']}" for row in rows],
        )

    return run


def study_with(study: Study, companion: str | None = None, **campaign: Mapping) -> Study:
    """Copy a study with other decisions of its campaign."""
    settings = CampaignSettings.model_validate(study.campaign.model_dump() | campaign)
    update = {"campaign": settings}
    return study.model_copy(update=update if companion is None else update | {"companion": companion})
