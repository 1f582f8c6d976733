"""Campaigns on analytic heaps: the angle is a function of the settings, with noise from the case's seed."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd

from doe import Factor
from experiments.studyfile import Study, load_study
from experiments.studyfile.campaign import CampaignSettings, Direct, Target

Angle = Callable[[Mapping[str, float]], float]

NOISE = 0.35
"""Standard deviation of one analytic heap [deg]."""


def friction(row: Mapping[str, float]) -> float:
    """Both static frictions raise the angle, nothing else does."""
    e, f = (row["E"] - 0.48) / 0.06, (row["F"] - 0.45) / 0.10
    return 30.2 + 3.0 * e + 2.0 * f + 0.7 * e * f - 0.35 * f * f


class AnalyticHeaps:
    """A runner: the angle is a function of the settings plus noise from the case's seed."""

    def __init__(
        self,
        angle: Angle = friction,
        fails: Callable[[Mapping[str, float]], bool] = lambda row: False,
        noise: float = NOISE,
    ) -> None:
        self.angle, self.fails, self.noise = angle, fails, noise
        self.tables: list[pd.DataFrame] = []

    def __call__(self, table: pd.DataFrame) -> pd.DataFrame:
        self.tables.append(table)
        rows = table.to_dict("records")
        failed = np.array([self.fails(row) for row in rows])
        noise = [self.noise * np.random.default_rng(row["seed"]).standard_normal() for row in rows]
        angles = [self.angle(row) + own for row, own in zip(rows, noise, strict=True)]
        return table.assign(
            status=np.where(failed, "diverged", "finished"),
            reason=np.where(failed, "a grain left <the domain> & fell", ""),
            angle=np.where(failed, np.nan, angles),
            angle_se=0.2,
            grain_count=400.0,
            fill_height=0.028,
            case_key=[f"key-{row['seed']}" for row in rows],
        )


def planes(study: Study, table: pd.DataFrame) -> pd.DataFrame:
    """Heaps and hoppers whose responses are planes of the frictions, with noise from the case's seed."""

    def case(row: Mapping) -> dict:
        e, f, g = (float(factor.to_coded(row[factor.name])) for factor in study.factors[:3])
        noise = np.random.default_rng(row["seed"]).standard_normal(2)
        facts = {"grain_count": 400.0, "simulated_time": 2.0, "case_key": f"key-{row['seed']}"}
        if row["scene"] == "target":
            angle, density = 24.0 + 2.0 * e + 5.0 * f + 1.5 * g, 0.55 - 0.012 * e + 0.003 * f - 0.008 * g
            return facts | {"angle": angle + 0.6 * noise[0], "solid_fraction": density + 0.002 * noise[1]}
        return facts | {"angle": np.nan, "flow_rate": 0.05 - 0.006 * e - 0.002 * g + 0.001 * noise[0]}

    rows = [case(row) for row in table.to_dict("records")]
    found = pd.DataFrame(rows, index=table.index).assign(status="finished", reason="", angle_se=0.2)
    return pd.concat([table, found], axis=1)


@dataclass(frozen=True)
class StandInStudy:
    """The part of a study that a campaign asks for."""

    target: Target
    factors: tuple[Factor, ...]
    campaign: CampaignSettings = field(default_factory=CampaignSettings)
    least: float = 0.0
    """Physical limit of every factor."""
    file: Path = Path("study.toml")
    direct: tuple[Direct, ...] = ()

    @property
    def labels(self) -> dict[str, str]:
        return {factor.name: f"parameter {factor.name}" for factor in self.factors}

    @property
    def limits(self) -> dict[str, tuple[float, float]]:
        return {factor.name: (self.least, np.inf) for factor in self.factors}

    def case(self, *_: object) -> None:
        """Accept any settings."""


def settings(**sections: Mapping) -> CampaignSettings:
    """Return the decisions of a campaign."""
    return CampaignSettings.model_validate(sections)


def study_with(study: Study, companion: str | None = None, **campaign: Mapping) -> Study:
    """Copy a study with other decisions of its campaign."""
    settings = CampaignSettings.model_validate(study.campaign.model_dump() | campaign)
    update = {"campaign": settings}
    return study.model_copy(update=update if companion is None else update | {"companion": companion})


def twin_of_one_angle() -> Study:
    """Return the bench study with the angle as its only response, and without readings."""
    study = load_study(None, "bench")
    alone = study.with_target(replace(study.target, responses=study.target.responses[:1]))
    return study_with(
        alone.model_copy(update={"direct_sections": (), "direct": ()}), selection={"keep": ("E", "F")}
    )
