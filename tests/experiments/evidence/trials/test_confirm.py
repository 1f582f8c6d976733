"""A bank that is looked at again: its points are known, and a value that differs is seen."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from doe.discrepancy import Bank, Outcomes, Point
from experiments.discover.search import Search
from experiments.evidence.trials.confirm import differing, points_of
from experiments.evidence.trials.generate_trials import STUDY, bank_beside
from experiments.io.errors import InputError
from experiments.studyfile import load_study

BENCH = "bench"


@pytest.fixture(scope="module")
def search() -> Search:
    return Search.of(load_study(STUDY, BENCH))


@pytest.fixture(scope="module")
def bank(search: Search) -> Bank:
    return search.read_bank(bank_beside(BENCH))


@pytest.fixture(scope="module")
def points(bank: Bank, search: Search) -> list[Point]:
    return points_of(bank, search)


class _Kept:
    """The bank's own values, one of them changed, as if an engine gave them."""

    def __init__(self, bank: Bank, points: Sequence[Point], changed: int) -> None:
        self.observables = bank.observables[::-1]
        self._values, self._rows = bank.values.copy(), {point: i for i, point in enumerate(points)}
        self._values[changed, 3] *= 1.001
        self._reasons = bank.reasons

    def __call__(self, points: Sequence[Point]) -> Outcomes:
        rows = [self._rows[point] for point in points]
        return Outcomes(self._values[rows][:, ::-1], tuple(str(self._reasons[row]) for row in rows))


def test_points_are_those_that_the_bank_was_made_of(bank: Bank, search: Search, points: list[Point]) -> None:
    assert len(points) == len(bank.reasons)
    conditions, effects = search.space.conditions, bank.space.names
    numbers = [conditions.index(point.condition) for point in points]
    assert np.array_equal(numbers, bank.condition)
    names = ["" if number < 0 else effects[number] for number in bank.mechanism]
    assert [point.sizes[0][0] if point.sizes else "" for point in points] == names


def test_points_of_another_bank_are_refused(bank: Bank, search: Search) -> None:
    with pytest.raises(InputError, match="must have the points that are drawn today"):
        points_of(replace(bank, theta=0.9 * bank.theta), search)


def test_a_run_that_differs_in_one_observable_is_named(bank: Bank, points: list[Point]) -> None:
    rows = np.arange(0, len(points), 7)
    simulator = _Kept(bank, points, changed=int(rows[5]))
    assert differing(bank, points, rows, simulator).tolist() == [rows[5]]
