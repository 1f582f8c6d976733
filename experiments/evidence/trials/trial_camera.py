"""The camera of the trials: what a real photograph adds to a heap, beyond what the analysis assumes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from doe.discrepancy import Calibration
from experiments.measurement.instrument_error import usual_error
from experiments.studyfile.observables import BY_NAME

SCALE_ERROR = 0.002
"""Relative standard deviation of the scale, one for all pictures of a trial: a millimetre on half a metre."""
ROLL = math.radians(0.3)
"""Standard deviation of the camera's roll that levelling leaves, one for all pictures of a trial [rad]."""
READING = {"deg": 0.1, "m": 5.0e-5, "1": 0.002}
"""Standard deviations of reading one picture by unit: half a pixel or so."""


def stated_scales(names: Sequence[str]) -> dict[str, Calibration]:
    """Errors of scale that are known of such a camera, by observable that has its scale."""
    shown = [BY_NAME[name] for name in names if BY_NAME[name].by_photograph and BY_NAME[name].unit == "m"]
    return {one.name: replace(usual_error(one), offset=0.0, scale=SCALE_ERROR) for one in shown}


@dataclass(frozen=True)
class Camera:
    """One set-up of a camera."""

    scale: float
    """Its lengths over the true ones."""
    roll: float
    """Turn about the line of sight, clockwise in the picture [rad]."""

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Camera:
        """Set up a camera as well as people do."""
        return cls(scale=1.0 + SCALE_ERROR * rng.standard_normal(), roll=ROLL * rng.standard_normal())

    def read(self, heaps: np.ndarray, names: Sequence[str], rng: np.random.Generator) -> np.ndarray:
        """Read pictures of heaps; what no photograph shows stays.

        A roll by a small angle w moves the apex of a heap of height h by w h and leaves its base, so that the
        area right of the apex less that left of it changes by w h^2, the lean by w tan(flank angle); means of
        both flanks, angles and the outline's heights, change in second order only. These heights stand at
        places of the outline's own size: a scale takes them as any length. Heaps are rows, (n, observables),
        in the order of the names; NaN stays.
        """
        seen, known = heaps.copy(), list(names)
        lean, angle = known.index("asymmetry"), known.index("flank_angle")
        seen[:, lean] -= self.roll * np.tan(np.radians(heaps[:, angle]))
        for column, observable in enumerate(BY_NAME[name] for name in known):
            if observable.by_photograph:
                scale = self.scale if observable.unit == "m" else 1.0
                errors = READING[observable.unit] * rng.standard_normal(len(heaps))
                seen[:, column] = scale * seen[:, column] + errors
        return seen
