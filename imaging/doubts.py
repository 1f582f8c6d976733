"""Reasons to doubt an angle: each a rule with its limit, what was found, and why the limit is where it is."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Doubt:
    """One reason to doubt an angle.

    Attributes
    ----------
    name : str
        Short name, for tables: one of `DOUBTS`.
    finding : str
        What was found, and against which limit.
    """

    name: str
    finding: str

    def __str__(self) -> str:
        return f"{self.name}: {self.finding}"


LARGEST_LEAN = 4.0
"""Left and right flank [degrees]: heaps poured on a level plate stand within 2.5 of one another as a rule."""
LARGEST_ERROR = 1.0
"""Standard error of the mean [degrees]: twice what a heap of twenty grains across has."""
LARGEST_UNSEEN_TILT = 5.0
"""Tilt [degrees] that is believed without a plate in view: hands hold a phone level within 3 or 4."""
LEAST_ANGLE, GREATEST_ANGLE = 5.0, 60.0
"""Repose angles of dry grains [degrees] lie well within."""
LARGEST_ELEVATION = 15.0
"""Camera's height over the plate [degrees] up to which its effect, 3.5 degrees there, is taken out."""
LARGEST_MISFIT = 0.05
"""Root mean square of the outline about its two lines, over its height: a parabola's dome has 0.075."""
LARGEST_END = 0.2
"""Height of the outline's end over the heap's: a heap runs out on its plate, a dish's wall does not."""
LARGEST_GAP = 0.1
"""Part of the area under the outline that does not differ from the background."""
LARGEST_SHIFT = 1.0
"""Change of the mean [degrees] with the threshold: an edge stays where it is, a shadow's fades."""

DOUBTS = (
    "lean", "error", "tilt", "range", "elevation", "straightness", "ends", "gaps", "threshold", "foot",
    "border", "plate", "shadow", "objects",
)  # fmt: skip
"""Names of all doubts."""
