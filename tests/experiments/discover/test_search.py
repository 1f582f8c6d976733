"""Settings of a search before the data are opened, and the banks that it may use."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from doe.discrepancy import Measured, Outcomes, Point, Verdict, bank_points, drive, load_bank, make_bank
from doe.errors import RuleError
from experiments.discover.fresh_cases import cases_for
from experiments.discover.maker import maker_of_today
from experiments.discover.mechanism_files import FORMER_NAMES
from experiments.discover.search import Search
from experiments.io.errors import InputError, StudyError
from experiments.report.discovery import Terms, verdict_line, write_discovery
from experiments.studyfile import Study, load_study
from experiments.studyfile.observables import NAMES, OBSERVABLES, OUTLINE

TRIAL = Path(__file__).parents[3] / "experiments" / "studies" / "trial" / "study.toml"


def trial(**changes: Any) -> Study:
    return load_study(TRIAL, "bench", changes)


class Linear:
    """A world that is linear in factors and sizes, with normal noise: a simulator that takes no time."""

    observables = NAMES

    def __init__(self, search: Search) -> None:
        self.space = search.space
        rng = np.random.default_rng(3)
        conditions, width = len(self.space.conditions), len(NAMES)
        self._slopes = rng.standard_normal((conditions, len(self.space.factors), width))
        self._signatures = {
            name: 8.0 * rng.standard_normal(width) + 3.0 * rng.standard_normal((conditions, width))
            for name in self.space.names
        }
        # a value that a mirror turns over is 0, except of an effect with a direction
        self._even = ~np.isin(NAMES, self.space.odd)
        self._slopes *= self._even
        for name in self.space.names:
            if not self.space.mechanism(name).directed:
                self._signatures[name] = self._signatures[name] * self._even

    def __call__(self, points: Sequence[Point]) -> Outcomes:
        rows = np.array([self._row(point) for point in points]).reshape(len(points), len(NAMES))
        return Outcomes(self._even + 0.1 * rows, ("",) * len(points))

    def _row(self, point: Point) -> np.ndarray:
        condition = self.space.conditions.index(point.condition)
        row = self.space.coded_theta(np.array(point.theta)) @ self._slopes[condition]
        for name, size in point.sizes:
            row = row + self._signatures[name][condition] * size / self.space.mechanism(name).maximum
        return np.asarray(row + 0.5 * np.random.default_rng(point.seed).standard_normal(len(NAMES)))


@pytest.fixture(scope="module")
def bank(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bank") / "bank.npz"
    search = Search.of(trial())
    search.make_bank(Linear(search)).save(path)
    return path


def test_the_study_names_the_effects_and_the_settings() -> None:
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
        ({"maxima": {"plate_tilt": "8 mm"}}, "unit of angle"),
        ({"maxima": {"plate_tilt": "0 deg"}}, "above 0, where it has no effect"),
        ({"maxima": {"plate_tilt": "95 deg"}}, "a size that the study can have"),
    ],
)
def test_what_cannot_be_looked_for_is_an_error_with_its_place(discover: dict, said: str) -> None:
    with pytest.raises((InputError, RuleError), match=said) as error:
        Search.of(trial(discover=discover))
    assert "discover" in str(error.value) or "Settings" in str(error.value)


def test_a_study_may_have_its_effects_searched_up_to_other_sizes() -> None:
    search = Search.of(trial(discover={"maxima": {"plate_tilt": "0.1 rad", "rolling_torque": 0.4}}))
    ends = {one.name: one.maximum for one in search.space.mechanisms}
    theirs = {one.name: one.maximum for one in Search.of(trial()).space.mechanisms}
    # 0.1 rad in degrees, to the six digits written here
    assert ends == theirs | {"plate_tilt": pytest.approx(5.72958, rel=1e-6), "rolling_torque": 0.4}


def test_a_direct_reading_narrows_the_range_of_its_factor(bank: Path) -> None:
    reading = {"parameter": "mu_gg", "by": "value", "mean": "0.6", "sd": "0.03", "n": 9, "model_sd": "0.02"}
    search, whole = Search.of(trial(direct=[reading])), Search.of(trial()).space
    # three times the root of 0.03^2 / 9 + 0.02^2
    assert search.space.lower == pytest.approx((0.6 - 0.067082, *whole.lower[1:]), rel=1e-5)
    assert search.space.upper == pytest.approx((0.6 + 0.067082, *whole.upper[1:]), rel=1e-5)
    with pytest.raises(InputError, match="of a study with another grain"):
        search.read_bank(bank)  # made for the whole range


def test_a_bank_of_other_largest_sizes_does_not_know_the_effect(bank: Path) -> None:
    search = Search.of(trial(discover={"maxima": {"rolling_torque": 0.4}}))
    known = search.read_bank(bank).space.mechanisms
    assert [one.name for one in search.space.mechanisms if one not in known] == ["rolling_torque"]


def test_a_study_that_holds_everything_out_cannot_be_searched() -> None:
    names = [condition.name for condition in trial().conditions]
    with pytest.raises(StudyError, match="must not be held out"):
        Search.of(trial(condition={name: {"held_out": True} for name in names}))


def test_a_bank_comes_back_as_it_was_made(bank: Path) -> None:
    search = Search.of(trial())
    read, made = search.read_bank(bank), search.make_bank(Linear(search))
    assert (read.space, read.observables, read.study) == (made.space, made.observables, made.study)
    # Kept as float32.
    np.testing.assert_allclose(read.values, made.values, rtol=1e-7)


@pytest.mark.parametrize(
    "changes",
    [
        {"grain": {"density": "800 kg/m^3"}},
        {"condition": {"fast": {"scene": {"lifted-cylinder": {"lift_speed": "0.3 m/s"}}}}},
    ],
)
def test_the_bank_of_another_grain_test_or_condition_is_refused(bank: Path, changes: dict) -> None:
    with pytest.raises(InputError, match="is the bank of a study with another"):
        Search.of(trial(**changes)).read_bank(bank)


def test_what_changes_no_heap_leaves_the_bank_in_use(bank: Path) -> None:
    search = Search.of(trial(name="Renamed", discover={"mechanisms": ["size_spread", "shape"]}))
    kept = search.read_bank(bank)
    assert kept.space.names == Search.of(trial()).space.names
    with pytest.raises(InputError, match="looked for"):
        Search.of(trial(discover={"mechanisms": ["shape"]})).read_bank(bank)


def test_a_plan_counts_no_fresh_run_where_too_few_means_were_measured() -> None:
    search = Search.of(trial())
    names = ("height", "r50", "r90")
    rows = {"base": np.array([[0.012, 0.02, 0.03], [0.013, 0.021, 0.031]])}
    few = Measured(("base",), names, rows)
    assert cases_for(search, few, None, seed=1) == (0, 0)
    more = Measured(("base", "fast"), names, {**rows, "fast": rows["base"]})
    assert 0 < cases_for(search, more, None, seed=1)[0] < cases_for(search, more, None, seed=1)[1]


def test_a_bank_without_outlines_serves_a_study_that_sees_them(bank: Path) -> None:
    """They are more to see of the same heaps; fresh runs have them in further columns."""
    with_them, without = Search.of(trial()), Search.of(trial(measurement={"outline": False}))
    assert len(with_them.study.measurable) == len(without.study.measurable) + len(OUTLINE)
    assert with_them.fingerprint == without.fingerprint
    assert with_them.read_bank(bank).observables == NAMES
    assert Search.of(trial(measurement={"pixels": 300})).fingerprint != without.fingerprint


def test_an_older_study_and_its_bank_may_call_a_mechanism_as_it_was(tmp_path: Path) -> None:
    search = Search.of(trial())
    older = {now: former for former, now in FORMER_NAMES.items()}
    kept = load_bank(TRIAL.with_name("bank-bench.npz"))
    kept.renamed(older).save(tmp_path / "older.npz")
    assert "contact_cohesion" in load_bank(tmp_path / "older.npz").space.names
    assert search.read_bank(tmp_path / "older.npz").space.names == kept.space.names
    names = [older.get(name, name) for name in search.space.names]
    assert Search.of(trial(discover={"mechanisms": names})).space == search.space


def test_the_report_says_when_another_engine_made_the_bank(tmp_path: Path) -> None:
    search = Search.of(trial())
    world, path = Linear(search), tmp_path / "bank.npz"
    maker = {"engine": "0" * 64, "day": "2026-03-14", "commit": "abc"}
    search.make_bank(world, maker).save(path)
    bank = search.read_bank(path)
    assert bank.maker == maker
    measured = Measured(("base",), ("flank_angle",), {"base": np.array([[1.0], [1.1], [0.9]])})
    for made, said in (
        (maker_of_today("abc"), []),
        ({}, ["the bank does not say which engine made it"]),
        (maker, ["the bank was made on 2026-03-14 by another engine (commit abc) than the fresh runs"]),
    ):
        notes = drive(search.analysis(measured, replace(bank, maker=made), seed=1), world).notes
        assert [note for note in notes if "engine" in note] == said


def test_the_shipped_bank_knows_what_made_it() -> None:
    maker = Search.of(load_study(TRIAL, "bench")).read_bank(TRIAL.with_name("bank-bench.npz")).maker
    assert (maker["day"], maker["commit"]) == ("2026-11-29", "4db84d0bf9f5")
    assert len(maker["engine"]) == 64


def test_a_bank_from_before_an_effect_saturated_is_read_with_the_same_sizes(tmp_path: Path) -> None:
    search, path = Search.of(load_study(TRIAL)), tmp_path / "older.npz"
    settings = replace(search.settings, bank_points=10, bank_mechanism_points=10)
    points = bank_points(search.space, settings)
    outcomes = Outcomes(np.ones((len(points), len(NAMES))), ("",) * len(points))
    made = make_bank(search.space, NAMES, points, outcomes, search.fingerprint)
    before = made.saturating({"plate_roughness": None})
    before.save(path)
    read = search.read_bank(path)
    rows = read.mechanism == read.space.names.index("plate_roughness")
    assert before.space.mechanism("plate_roughness").saturation is None
    rough = read.space.mechanism("plate_roughness")
    assert rough.saturation == 0.1
    natural = [rough.natural(size) for size in read.coded_size[rows]]
    assert natural == pytest.approx(0.6 * before.coded_size[rows], abs=1e-9)
    assert np.array_equal(read.coded_size[~rows], before.coded_size[~rows])


@pytest.mark.parametrize("hidden", [(), (("plate_tilt", 3.0),)])
def test_the_page_names_what_was_hidden_in_a_known_world(
    hidden: tuple[tuple[str, float], ...], tmp_path: Path
) -> None:
    search = Search.of(trial())
    world = Linear(search)
    theta = tuple(factor.center for factor in search.study.factors)
    heaps = {
        name: world([Point(theta, hidden, name, 100 * at + seed) for seed in range(6)]).values
        for at, name in enumerate(search.space.conditions)
    }
    measured = Measured(search.space.conditions, NAMES, heaps)
    found = drive(search.analysis(measured, search.make_bank(world), seed=1), world)
    terms = Terms.of(search.library, OBSERVABLES, search.study.factor_sections)
    page = write_discovery(found, search.study, terms, search.settings, tmp_path)
    assert found.named == tuple(name for name, _ in hidden)
    assert sorted(path.name for path in tmp_path.glob("*.toml")) == [
        f"study-with-{name}.toml" for name, _ in hidden
    ]
    said = "Missing: tilt of the plate" if hidden else "Nothing is missing"
    assert said in page.read_text(encoding="utf-8")
    if found.chosen is not None:
        [size] = found.chosen.sizes
        # Six heaps a condition against a signature of tens of their standard deviations.
        assert size.value == pytest.approx(3.0, rel=0.05)
        assert [both.held_out for both in found.before_after] == [False, True]


def test_one_angle_is_not_identifiable_and_said_so(tmp_path: Path) -> None:
    search = Search.of(trial())
    world = Linear(search)
    measured = Measured(("base",), ("flank_angle",), {"base": np.array([[1.0], [1.1], [0.9]])})
    found = drive(search.analysis(measured, search.make_bank(world), seed=1), world)
    terms = Terms.of(search.library, OBSERVABLES, search.study.factor_sections)
    assert found.verdict is Verdict.NOT_IDENTIFIABLE
    page = write_discovery(found, search.study, terms, search.settings, tmp_path)
    assert "These data cannot tell" in page.read_text(encoding="utf-8")
    assert verdict_line(found, terms).endswith(".")


def test_the_last_bits_of_coded_parameters_make_no_other_case() -> None:
    space = Search.of(load_study(TRIAL, "bench")).space
    name = space.names[0]
    coded = np.append(np.linspace(-0.7, 0.6, len(space.factors)), 1.0 / 3.0)
    other = coded * (1.0 + np.array([1.0, -1.0, 1.0, -1.0]) * 2.0**-50)
    assert space.point(coded, (name,), "base", 1) == space.point(other, (name,), "base", 1)
