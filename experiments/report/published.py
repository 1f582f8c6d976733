"""Numbers that were published for a study, to be set beside a campaign's own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import pandas as pd

from doe import Sample, Surface

QUALITY = {
    "r2": "R²",
    "r2_adjusted": "R² adjusted",
    "r2_predicted": "R² predicted",
    "cv_percent": "coefficient of variation [%]",
    "adequate_precision": "adequate precision (above 4 is wanted)",
}
"""Measures of a fit by their names in ``Surface``, in words."""


def quality_of(models: Mapping[str, Surface]) -> pd.DataFrame:
    """Measures of fits, one column a model."""
    values = {model: [getattr(fit, name) for name in QUALITY] for model, fit in models.items()}
    return pd.DataFrame(values, index=list(QUALITY))


@dataclass(frozen=True)
class Published:
    """Results of a published calibration."""

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

    @property
    def kept(self) -> tuple[str, ...]:
        """Factors of its response surface."""
        return tuple(self.optimum)

    def anova(self, model: str, names: tuple[str, ...]) -> pd.DataFrame:
        """Analysis of variance of a model, with interactions written in the order of `names`."""
        swapped = {f"{b}:{a}": f"{a}:{b}" for i, a in enumerate(names) for b in names[i + 1 :]}
        return self.surfaces[model].anova.rename(index=swapped)
