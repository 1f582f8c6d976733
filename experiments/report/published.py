"""Numbers that were published for a study, to be set beside a campaign's own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import pandas as pd

from doe import Sample, Surface

QUALITY = ("r2", "r2_adjusted", "r2_predicted", "cv_percent", "adequate_precision")
"""Measures of a fit, by their names in ``Surface``."""


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

    @property
    def quality(self) -> pd.DataFrame:
        """Measures of the fit, one column a model."""
        values = {model: [getattr(fit, name) for name in QUALITY] for model, fit in self.surfaces.items()}
        return pd.DataFrame(values, index=QUALITY)
