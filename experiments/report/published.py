"""The paper's own results, recomputed from its printed runs, for a study that is the paper's."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass

import pandas as pd

from doe import Sample, Surface
from experiments.studies.buckwheat import paper
from experiments.studyfile import Study

QUALITY = ("r2", "r2_adjusted", "r2_predicted", "cv_percent", "adequate_precision")
"""Measures of a fit, by their names in ``Surface``."""


@dataclass(frozen=True)
class Published:
    """What the paper found."""

    screening: pd.DataFrame
    """Tests of the effects by factor, as ``ScreenResult.table``."""
    climb: pd.DataFrame
    """By step: factors, angle [deg], error_percent."""
    surfaces: Mapping[str, Surface]
    """Its "full" and "reduced" model."""
    optimum: Mapping[str, float]
    """Its chosen point."""
    heaps: Sample
    """Its simulated angles at the chosen point [deg]."""
    measured: Sample
    """Its measured angle [deg]."""
    misprints: pd.DataFrame
    """What its own numbers contradict: place, item, printed, recomputed, reason."""

    @property
    def kept(self) -> tuple[str, ...]:
        """Factors of its response surface."""
        return tuple(self.optimum)

    def anova(self, model: str, names: tuple[str, ...]) -> pd.DataFrame:
        """Analysis of variance of a model, with interactions written in the order of `names`."""
        swapped = {f"{b}:{a}": f"{a}:{b}" for i, a in enumerate(names) for b in names[i + 1 :]}
        return self.surfaces[model].anova.rename(index=swapped)

    @property
    def quality(self) -> pd.DataFrame:
        """Measures of the fit, one column a model."""
        values = {model: [getattr(fit, name) for name in QUALITY] for model, fit in self.surfaces.items()}
        return pd.DataFrame(values, index=QUALITY)


def published_for(study: Study) -> Published | None:
    """Return the paper's results when the study is the paper's, else None."""
    if not study.paper:
        return None
    climb = paper.published("steepest_climb").rename_axis("step")
    reduced = paper.surface("reduced")
    settings = paper.published("settings")["value"]
    return Published(
        screening=paper.screening().table,
        climb=climb.rename(columns={"repose_angle_deg": "angle", "relative_error_pct": "error_percent"}),
        surfaces={"full": paper.surface("quadratic"), "reduced": reduced},
        optimum={name: float(settings[name]) for name in reduced.design.names},
        heaps=Sample.of(paper.verification()),
        measured=paper.measured(),
        misprints=pd.DataFrame([asdict(misprint) for misprint in paper.misprints()]),
    )
