"""What a measured value can be: no heap is larger than its grains allow, no time longer than the test.

Wrong units move a value by factors of ten and more, so that wide limits find them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from dem_warp import LiftedCylinder
from experiments.errors import StudyError
from experiments.studyfile import Study

SHARES = {
    "concavity": (-1.0, 1.0),
    "asymmetry": (-1.0, 1.0),
    "rolled_fraction": (0.0, 1.0),
    "wall_drag": (-1.0, 1.0),
}
"""Ends of the ratios, by their definitions."""

RISING = (("r50", "r90"), ("t75", "t55"), ("centre_height", "height"))
"""Of two observables of one heap, the first is always the smaller."""

PATIENCE = 10.0
"""Time that a heap is given after the tube is gone [s]."""


@dataclass(frozen=True)
class SizeOfTest:
    """How large and how long a lifted-cylinder test is.

    Attributes
    ----------
    grain : float
        Radius of the smallest sphere of a grain [m]: no heap is lower.
    length : float
        Radius of the flattest heap that the grains of the tube can make [m].
    time : float
        From the start of the lift until long after its end [s].
    """

    grain: float
    length: float
    time: float

    def limits(self, observable: str, unit: str) -> tuple[float, float]:
        """Smallest and largest value that an observable can have, in its unit (deg, m, s or 1)."""
        by_unit = {"deg": (0.0, 90.0), "m": (self.grain, self.length), "s": (0.0, self.time)}
        return by_unit[unit] if unit in by_unit else SHARES[observable]


def size_of_test(study: Study) -> SizeOfTest:
    """Size of the test of a study.

    Raises
    ------
    StudyError
        When it is no lifted cylinder.
    """
    case = study.case({}, seed=0)
    scene = case.scene
    if not isinstance(scene, LiftedCylinder):
        raise StudyError("heaps need a [scene.lifted-cylinder]", type(scene).__name__, str(study.file))
    reach = 4.0 * scene.diameter + 2.0 * scene.height
    return SizeOfTest(case.grains.smallest_sphere, reach, PATIENCE + 10.0 * scene.height / scene.lift_speed)


def inversions(heap: Mapping[str, float]) -> Iterable[tuple[str, str]]:
    """Pairs of observables of one heap that are the wrong way round."""
    for small, large in RISING:
        if small in heap and large in heap and not heap[small] <= heap[large]:
            yield small, large
