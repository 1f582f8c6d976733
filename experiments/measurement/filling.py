"""Reached filling of a drum, compared with the filling of the study.

The filling stops by the height of the bed's surface, and a level bed is cut at the height of the study's
filling. So the bed ends lower at its sides, or higher by the grains that were still falling.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from dem_warp import Drum

TOLERANCE = 0.02
"""Deviation of a filling without a caution, as a part of the drum's volume."""


def filling_reached(scene: Any, observables: Mapping[str, float]) -> float | None:
    """Return the part of a drum's volume below its bed's surface, before it turned; None where it is unknown.

    It follows from `fill_height` among the observables [m]; only a drum has a filling.
    """
    height = observables.get("fill_height")
    if not isinstance(scene, Drum) or height is None:
        return None
    return scene.volume_below(height) / scene.volume_below(scene.diameter)


def filling_text(scene: Drum, reached: float) -> str:
    """Write the reached filling, with that of the study where this has no number of grains."""
    text = f"{reached:.2f} of the drum"
    return text if scene.grain_count is not None else f"{text}, {scene.filling:g} in the study"


def filling_missed(scene: Drum, reached: float) -> bool:
    """Return True if the filling deviates from the study's, which gives no number of grains."""
    return scene.grain_count is None and abs(reached - scene.filling) > TOLERANCE
