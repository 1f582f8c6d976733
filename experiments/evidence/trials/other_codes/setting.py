"""Settings of the other workshop: what it does in its own way, drawn once for a trial."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dem_warp import PRESETS, Case
from dem_warp.laws.conventions import Rolling
from experiments.evidence.trials.other_codes.odd_lift import odd

_STREAM = 2
"""Stream of random numbers of a trial's seed; 1 is that of its camera."""

ROLLING: tuple[Rolling, ...] = ("cdt", "epsd2")
"""Resistances to rolling of LIGGGHTS."""


@dataclass(frozen=True)
class Setting:
    """Way in which a trial's tests are run."""

    step_share: float
    """Time step over that of the study."""
    rain_rate: float
    """Grains a second at the most."""
    tube_sides: int
    """Sides of the prism that stands for the tube, where it is a mesh."""
    look_time: float
    """Time between two looks of the film [s]."""
    rolling: Rolling
    """Resistance to rolling, where there is one."""

    @classmethod
    def drawn(cls, seed: int) -> Setting:
        """Draw the setting of a trial from its seed."""
        rng = np.random.default_rng([seed, _STREAM])
        return cls(
            step_share=float(rng.uniform(0.6, 1.0)),
            rain_rate=float(rng.uniform(500.0, 1000.0)),
            tube_sides=int(rng.integers(40, 97)),
            look_time=float(rng.uniform(2.5e-3, 5e-3)),
            rolling=ROLLING[rng.integers(len(ROLLING))],
        )

    def of(self, case: Case[Any]) -> Case[Any]:
        """Take a case to the other workshop."""
        scene = odd(
            replace(case.scene, rain_rate=min(self.rain_rate, case.scene.grains_per_second(case))),
            tube_sides=self.tube_sides,
            look_time=self.look_time,
        )
        fraction = self.step_share * case.numerics.time_step_fraction
        return replace(
            case,
            scene=scene,
            numerics=replace(case.numerics, time_step_fraction=fraction),
            laws=replace(PRESETS["liggghts"], rolling=self.rolling),
        )
