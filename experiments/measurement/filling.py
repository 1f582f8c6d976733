"""Filling of a drum as it was reached, against the one that a study states.

Grains stop falling when the drum is as full as a look at its surface tells, and a level bed is struck off at
the height that the stated filling has: the bed ends lower at its sides, or higher by the grains that were
still falling (`experiments/evidence/performance/fillings.py` has the size of both).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from dem_warp import Drum

TOLERANCE = 0.02
"""Part of a drum's volume by which its filling may miss the stated one without a word."""


def filling_reached(scene: Any, observables: Mapping[str, float]) -> float | None:
    """Part of a drum's volume below its bed's surface, before it turned; None where it is not known.

    Parameters
    ----------
    scene
        Scene of the case; anything but a drum has no filling.
    observables
        Observables of the case in SI, of which `fill_height` counts.
    """
    height = observables.get("fill_height")
    if not isinstance(scene, Drum) or height is None:
        return None
    return scene.volume_below(height) / scene.volume_below(scene.diameter)


def filling_told(scene: Drum, reached: float) -> str:
    """Say what was reached, and, where the grains were not counted, what was stated."""
    told = f"{reached:.2f} of the drum"
    return told if scene.grain_count is not None else f"{told}, {scene.filling:g} stated"


def filling_missed(scene: Drum, reached: float) -> bool:
    """Tell that a drum was filled otherwise than stated; counted grains fill what they fill."""
    return scene.grain_count is None and abs(reached - scene.filling) > TOLERANCE
