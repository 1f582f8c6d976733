"""What a search is settled on before the data are opened, and which bank it may use."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.discover.bank import Bank
from experiments.discover.observables import NAMES
from experiments.discover.search import Search
from experiments.discover.simulator import Outcomes, Point
from experiments.errors import InputError, StudyError
from experiments.study import Study, load_study

TRIAL = Path(__file__).parents[3] / "experiments" / "studies" / "trial" / "study.toml"


def trial(**changes: Any) -> Study:
    return load_study(TRIAL, "bench", changes)


class Drawn:
    """Answers points with numbers, as quickly as that."""

    observables = NAMES

    def __call__(self, points: list[Point]) -> Outcomes:
        rng = np.random.default_rng(1)
        return Outcomes(1.0 + rng.random((len(points), len(NAMES))), ("",) * len(points))


@pytest.fixture(scope="module")
def bank(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bank") / "bank.npz"
    Search.of(trial()).make_bank(Drawn()).save(path)
    return path


def test_the_study_says_what_is_looked_for_and_how_hard() -> None:
    search = Search.of(trial())
    assert [one.name for one in search.library] == sorted(search.study.discover.mechanisms or ())
    assert search.settings.bank_points == search.study.discover.settings["bank_points"]
    everything = Search.of(load_study(TRIAL))
    assert len(everything.library) > len(search.library)


@pytest.mark.parametrize(
    ("discover", "said"),
    [
        ({"mechanisms": ["plate_tilted"]}, "plate_tilt"),
        ({"settings": {"bank_point": 30}}, "bank_points"),
        ({"settings": {"bank_points": 3}}, "at least 10"),
        ({"mechanism": ["plate_tilt"]}, "mechanisms"),
    ],
)
def test_what_cannot_be_looked_for_is_an_error_with_its_place(discover: dict, said: str) -> None:
    with pytest.raises(InputError, match=said) as error:
        Search.of(trial(discover=discover))
    assert "discover" in str(error.value) or "Settings" in str(error.value)


def test_a_study_that_holds_everything_out_cannot_be_searched() -> None:
    names = [condition.name for condition in trial().conditions]
    with pytest.raises(StudyError, match="takes part in the fit"):
        Search.of(trial(condition={name: {"held_out": True} for name in names}))


def test_a_bank_comes_back_as_it_was_made(bank: Path) -> None:
    read = Search.of(trial()).read_bank(bank)
    made: Bank = Search.of(trial()).make_bank(Drawn())
    assert (read.space, read.observables, read.study) == (made.space, made.observables, made.study)
    # Kept as float32.
    np.testing.assert_allclose(read.values, made.values, rtol=1e-7)


@pytest.mark.parametrize(
    "changes",
    [
        {"grain": {"density": "800 kg/m^3"}},
        {"condition": {"fast": {"scene": {"lifted-cylinder": {"lift_speed": "0.3 m/s"}}}}},
        {"scene": {"lifted-cylinder": {"grain_count": 120}}},
    ],
)
def test_the_bank_of_another_grain_test_or_condition_is_refused(bank: Path, changes: dict) -> None:
    with pytest.raises(InputError, match="another study's"):
        Search.of(trial(**changes)).read_bank(bank)


def test_what_changes_no_heap_leaves_the_bank_in_use(bank: Path) -> None:
    search = Search.of(trial(name="Renamed", discover={"mechanisms": ["size_spread", "shape"]}))
    kept = search.read_bank(bank)
    assert kept.space.names == Search.of(trial()).space.names
    with pytest.raises(InputError, match="looked for"):
        Search.of(trial(discover={"mechanisms": ["shape"]})).read_bank(bank)


def test_no_bank_at_all_is_said_so(tmp_path: Path) -> None:
    path = tmp_path / "bank.npz"
    path.write_bytes(b"no archive")
    with pytest.raises(InputError, match="bank"):
        Search.of(trial()).read_bank(path)
