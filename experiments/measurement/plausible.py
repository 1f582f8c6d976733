"""Limits of measured values: no heap is larger than its grains allow, no time longer than the test.

Wrong units move a value by factors of ten and more, so that wide limits find them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from dem_warp import Drum, LiftedCylinder
from experiments.io.errors import InputError
from experiments.studyfile import Study
from experiments.studyfile.campaign import TARGET_SCENE
from experiments.studyfile.observables import BY_NAME, OBSERVABLES, Observable

PATIENCE = 10.0
"""Time that a heap is given after the tube is gone [s]."""


@dataclass(frozen=True)
class SizeOfTest:
    """Size and duration of a test."""

    grain: float
    """Radius of the smallest sphere of a grain [m]: no heap is lower."""
    length: float
    """Radius of the flattest heap that the grains of the tube can make, or the room of another test [m]."""
    time: float
    """Time from the start of the lift until long after its end, endless of another test [s]."""
    radius: float | None = None
    """Radius of a drum [m]."""

    def limits(self, observable: Observable) -> tuple[float, float]:
        """Smallest and largest value that an observable can have, in its unit (deg, m, s or 1)."""
        by_unit = {"deg": (0.0, 90.0), "m": (self.grain, self.length), "s": (0.0, self.time)}
        if observable.part_of:  # a heap has no height beyond its foot, and a drum's axis is in its middle
            return (0.0 if self.radius is None else -self.length), self.length
        masses = {"kg": (0.0, math.inf), "kg/s": (0.0, math.inf)}
        return observable.limits or (by_unit | masses).get(observable.unit, (-math.inf, math.inf))

    def require_height(self, height: float, question: str, told: str, place: str) -> None:
        """Refuse the outline of a heap whose greatest height [m] the test cannot give.

        Raises
        ------
        InputError
            With the ``question`` what may be wrong, and what else is ``told`` of it.
        """
        low, high = self.limits(BY_NAME["height"])
        if not low <= height <= high:
            rule = f"an outline is between {1e3 * low:.3g} and {1e3 * high:.3g} mm high in this test"
            raise InputError(place, f"expected {rule}: {question}", f"{1e3 * height:.6g} mm{told}")


def size_of_test(study: Study, scene: str = TARGET_SCENE) -> SizeOfTest:
    """Size of the test of a study, or of another of its scenes."""
    case = study.case({}, 0, scene)
    test = case.scene
    if not isinstance(test, LiftedCylinder):
        half_x, half_y, bottom = test.room(case.grains.grain_reach)
        room = max(2.0 * half_x, 2.0 * half_y, test.brim - bottom)
        radius = test.diameter / 2 if isinstance(test, Drum) else None
        return SizeOfTest(case.grains.smallest_sphere, room, math.inf, radius)
    reach = 4.0 * test.diameter + 2.0 * test.height
    return SizeOfTest(case.grains.smallest_sphere, reach, PATIENCE + 10.0 * test.height / test.lift_speed)


def inversions(heap: Mapping[str, float]) -> Iterable[tuple[str, str]]:
    """Pairs of observables of one heap that are the wrong way round."""
    for small in OBSERVABLES:
        large = small.never_above
        if small.name in heap and large in heap and not heap[small.name] <= heap[large]:
            yield small.name, large
