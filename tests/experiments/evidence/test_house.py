"""The limits of the house, without exceptions."""

from experiments.evidence.house.counts import circles_broken, counts, heights
from experiments.evidence.house.walk import walk


def test_the_house_stays_within_its_limits() -> None:
    assert [count for count in counts() if count.value > count.limit] == []


def test_a_study_goes_down_from_the_command_to_the_engine() -> None:
    assert [count for count in walk() if count.value > count.limit] == []


def test_floors_and_circles_are_counted() -> None:
    chain = {("roof", "wall"), ("wall", "ground"), ("roof", "ground")}
    assert heights(chain) == {"ground": 1, "wall": 2, "roof": 3}
    assert circles_broken(chain)[1] == 0
    assert circles_broken(chain | {("ground", "roof")})[1] > 0
