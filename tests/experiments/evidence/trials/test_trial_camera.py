"""Views of a trial: the camera's errors, and the observables that an analysis has in each."""

import numpy as np
import pytest

from experiments.evidence.trials.findings import EVERYTHING, OUTLINED, PHOTOGRAPHS, VIEWS
from experiments.evidence.trials.trial_camera import Camera
from experiments.studyfile.observables import BY_NAME, NAMES, OUTLINE, PHOTOGRAPHED, READINGS
from imaging.flank.heap_shape import profile_heights


class Steady(np.random.Generator):
    """Draws no errors."""

    def __init__(self) -> None:
        super().__init__(np.random.PCG64(0))

    def standard_normal(self, size: int) -> np.ndarray:  # type: ignore[override]
        return np.zeros(size)


def test_a_rolled_camera_leans_a_straight_heap() -> None:
    """A drawn triangle, rolled, against the closed form of the camera."""
    angle, roll = np.radians(25.0), 0.01
    apex = np.tan(angle)  # of a heap of half width 1
    left, right = 1.0 + roll * apex, 1.0 - roll * apex
    names = [*NAMES, *(each.name for each in OUTLINE)]
    heap = np.ones((1, len(names)))
    heap[0, [names.index("flank_angle"), names.index("asymmetry")]] = 25.0, 0.0
    seen = Camera(scale=1.02, roll=roll).read(heap, names, Steady())
    assert seen[0, names.index("asymmetry")] == pytest.approx((right - left) / (right + left))
    for column, name in enumerate(names):
        if BY_NAME[name].unit == "m":
            assert seen[0, column] == pytest.approx(1.02 if BY_NAME[name].by_photograph else 1.0)
        elif name != "asymmetry":
            assert seen[0, column] == heap[0, column]


def test_a_camera_does_to_an_outline_what_its_heights_say() -> None:
    """A drawn triangle, turned and enlarged: heights grow as lengths, and a roll moves them by its square."""
    angle, roll, scale = np.radians(25.0), 0.005, 1.02
    corners = np.array([[-1.0, 0.0], [0.0, np.tan(angle)], [1.0, 0.0]])
    apex = scale * (corners[1] + roll * np.array([corners[1, 1], 0.0]))
    level = profile_heights(*corners.T)
    seen = profile_heights(*np.array([scale * corners[0], apex, scale * corners[2]]).T)
    np.testing.assert_allclose(seen, scale * level, atol=roll**2)


def test_photographs_show_every_height_of_the_outline_and_nothing_of_a_balance() -> None:
    shown = {name for name, each in BY_NAME.items() if each.by_photograph and name == each.name}
    shown -= {each.name for each in READINGS}  # other readings of the outline that the views have
    assert set(VIEWS[PHOTOGRAPHS]) == shown
    assert set(PHOTOGRAPHED) < shown
    # what a balance, a film and a ruler show stays in the other views
    assert VIEWS[EVERYTHING] == NAMES
    assert set(VIEWS[OUTLINED]) == {*NAMES, *shown}
