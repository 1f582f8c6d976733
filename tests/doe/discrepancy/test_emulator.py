"""The bank and its emulator: noise, surfaces, the errors that they state."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Never

import numpy as np
import pytest
import synthetic_world
from scipy import stats
from synthetic_world import CONDITIONS, OBSERVABLES, SETTINGS, SyntheticSimulator, bank, emulator, space

from doe.discrepancy import Bank, Outcomes, bank_points, fit_emulator, fitted, load_bank, make_bank
from doe.discrepancy.emulation import kriged_parts, surface_fits
from doe.discrepancy.emulation.kriged_parts import KrigedParts
from doe.discrepancy.emulation.run_noise import ALIKE, fit_noises
from doe.discrepancy.emulation.surface_fits import AddedRuns, BaseRuns, fit_additions, fit_bases
from doe.discrepancy.fitting.fitted_model import Model, Stack
from doe.discrepancy.fitting.measured_means import gather
from doe.discrepancy.fitting.model_fit import fit, whiten
from doe.errors import RuleError
from doe.numerics.kriging import Covariance, fit_kriging, krige


def test_points_are_the_same_whenever_asked_and_every_case_has_its_own_seed() -> None:
    points = bank_points(space(), SETTINGS, seed=4)
    assert points == bank_points(space(), SETTINGS, seed=4)
    assert len({point.seed for point in points}) == len(points)
    assert len(points) == (128 * 2 + 7 * 64) * 5


def test_a_bank_comes_back_from_its_file(tmp_path: Path) -> None:
    bank().save(tmp_path / "bank.npz")
    back = load_bank(tmp_path / "bank.npz")
    assert back.space == bank().space
    # Values are kept in single precision.
    np.testing.assert_allclose(back.values, bank().values, rtol=2.0**-23)
    np.testing.assert_array_equal(back.coded_size, bank().coded_size)


def test_a_file_that_is_no_bank_is_refused_with_its_name(tmp_path: Path) -> None:
    path = tmp_path / "photo.npz"
    path.write_text("no bank")
    with pytest.raises(RuleError, match=r"photo\.npz: must be a bank"):
        load_bank(path)


def test_the_emulator_errs_as_much_as_it_says() -> None:
    rng = np.random.default_rng(5)
    simulator, known = SyntheticSimulator(space()), emulator()
    squares = []
    for name in ("beta", "gamma", "delta"):
        for condition in CONDITIONS:
            x = np.append(rng.uniform(-0.9, 0.9, 3), rng.uniform(0.1, 0.6))
            truth = simulator.mean(known.space.natural_theta(x[:3]), {name: 2.0 * x[3]}, condition)
            error = truth - known.surfaces[condition].predict(x[None], (name,))[0]
            whitened = whiten(known.surfaces[condition].error(x, (name,))) @ error
            squares.append(whitened @ whitened)
    total, count = float(np.sum(squares)), len(squares) * len(OBSERVABLES)
    # Errors of one condition hang together, so the count of independent ones is about that of the surfaces.
    assert stats.chi2.ppf(1e-3, len(squares)) / len(squares) < total / count
    assert total / count < stats.chi2.isf(1e-3, len(squares)) / len(squares)


def test_kriging_goes_through_points_without_noise_and_forgets_far_from_them() -> None:
    points = np.array([[0.0], [1.0], [2.5]])
    known = krige(points, np.array([1.0, -1.0, 0.5]), np.full(3, 1e-10), Covariance(2.0, np.array([0.7])))
    np.testing.assert_allclose(known.mean(points), [1.0, -1.0, 0.5], atol=1e-8)
    np.testing.assert_allclose(known.variance(np.array([[0.0], [50.0]])), [0.0, 2.0], atol=1e-8)


def test_kriging_leaves_one_out_as_if_it_were_fitted_without() -> None:
    rng = np.random.default_rng(6)
    points, values, noise = rng.uniform(-1, 1, (12, 2)), rng.standard_normal(12), np.full(12, 0.1)
    covariance = Covariance(1.5, np.array([0.8, 1.2]))
    whole = krige(points, values, noise, covariance)
    for left in range(12):
        kept = np.arange(12) != left
        rest = krige(points[kept], values[kept], noise[kept], covariance)
        alone = values[left] - rest.mean(points[left : left + 1])[0]
        assert whole.leave_one_out[left] == pytest.approx(alone, abs=1e-9)


def _bent_bank() -> Bank:
    """Bank of a world in which a bump in one factor moves the observable 2, with and without `alpha`."""
    points, simulator = (
        bank_points(space(("alpha",)), SETTINGS, seed=1),
        SyntheticSimulator(space(("alpha",))),
    )
    values = simulator(points).values
    theta = space().coded_theta(np.array([point.theta for point in points]))
    values[:, 2] += 3.0 * np.exp(-8.0 * (theta[:, 0] - 0.3) ** 2) * np.std(values[:, 2])
    return make_bank(space(("alpha",)), OBSERVABLES, points, Outcomes(values, ("",) * len(points)))


@cache
def _kriged_bank() -> Bank:
    return fitted(_bent_bank())


def test_what_a_cubic_cannot_follow_is_kriged() -> None:
    points = bank_points(space(("alpha",)), SETTINGS, seed=1)
    simulator, bent = SyntheticSimulator(space(("alpha",))), fit_emulator(_bent_bank())
    assert all(2 in surfaces.base.kriging for surfaces in bent.surfaces.values())
    grid = np.column_stack([np.linspace(-0.8, 0.8, 9), np.zeros((9, 2))])
    truth = np.array([simulator.mean(space().natural_theta(row), {}, "base")[2] for row in grid])
    truth += 3.0 * np.exp(-8.0 * (grid[:, 0] - 0.3) ** 2) * np.std(simulator(points).values[:, 2])
    surfaces = bent.surfaces["base"]
    flat = replace(surfaces, base=replace(surfaces.base, kriging={}))
    kriged, cubic = (np.abs(one.predict(grid, ())[:, 2] - truth).max() for one in (surfaces, flat))
    assert kriged < 0.4 * cubic


def test_a_bank_keeps_what_its_fit_kriged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _kriged_bank().save(tmp_path / "bank.npz")
    kept = load_bank(tmp_path / "bank.npz")
    searched = fit_emulator(replace(kept, kriged=None))

    def search(*_data: np.ndarray) -> Never:
        raise AssertionError("searched again")

    monkeypatch.setattr(kriged_parts, "fit_kriging", search)
    known = fit_emulator(kept)
    x = np.random.default_rng(4).uniform(-0.9, 0.9, (20, 4))
    for condition in CONDITIONS:
        one, other = known.surfaces[condition], searched.surfaces[condition]
        assert one.base.kriging.keys() == other.base.kriging.keys() >= {2}
        # float32 in the file moves the lengths that a search finds, by less than noise by far
        np.testing.assert_allclose(one.predict(x, ("alpha",)), other.predict(x, ("alpha",)), rtol=1e-3)
        assert np.array_equal(one.additions["alpha"].silent, other.additions["alpha"].silent)


def test_parts_that_other_runs_kriged_are_searched_for_again() -> None:
    runs = _kriged_bank()
    assert runs.known_parts is not None
    others = [
        replace(runs, values=runs.values * 1.001),
        replace(runs, theta=0.9 * runs.theta),
        replace(runs, space=replace(runs.space, odd=(OBSERVABLES[0],))),
    ]
    assert [each.known_parts for each in others] == [None] * 3
    again = fit_emulator(others[0])
    assert again.surfaces["base"].base.kriging.keys() >= {2}
    assert again.kriged is not None
    assert again.kriged.runs == others[0].runs_sha256


@pytest.mark.parametrize(
    ("place", "value"),
    [(0, 0.5), (1, -2.0), (2, 99.0), (3, 0.0), (4, np.inf)],
)
def test_a_kriged_part_that_can_not_be_is_refused(place: int, value: float) -> None:
    runs = _kriged_bank()
    assert runs.kriged is not None
    table = runs.kriged.table()
    table[0, place] = value
    with pytest.raises(RuleError, match="kriged"):
        fit_emulator(replace(runs, kriged=KrigedParts.from_table(runs.runs_sha256, table)))


def test_a_kriged_part_as_of_equal_runs_is_refused() -> None:
    runs = _kriged_bank()
    assert runs.kriged is not None
    table = runs.kriged.table()
    table[0, 3], table[0, 4:7] = 1e30, 1e9  # all runs alike, their noise negligible: no inverse
    with pytest.raises(RuleError, match="can be inverted"):
        fit_emulator(replace(runs, kriged=KrigedParts.from_table(runs.runs_sha256, table)))


def _warped(theta: np.ndarray) -> np.ndarray:
    """Act as a factor: less than itself inside its range, and more at the ends (coded)."""
    return np.asarray(theta + 0.4 * (theta**3 - 0.6 * theta))


def test_what_all_observables_bend_alike_does_not_move_the_factors() -> None:
    simulator, known = SyntheticSimulator(space(())), space(())
    points = bank_points(known, SETTINGS, seed=1)
    acting = [
        replace(point, theta=tuple(known.natural_theta(_warped(known.coded_theta(np.array(point.theta))))))
        for point in points
    ]
    bent = fit_emulator(make_bank(known, OBSERVABLES, points, simulator(acting)))
    squares = []
    for seed in range(10):
        theta = np.random.default_rng(seed).uniform(-0.9, 0.9, 3)
        data = synthetic_world.measure({}, seed, theta=tuple(known.natural_theta(_warped(theta))))
        fitted = fit(Stack(Model(bent, (), 0.0), gather(data, bent).training))
        squares.append(((fitted.x - theta) / fitted.errors) ** 2)
    # 30 squares of normal numbers; without terms of third order their sum is 160.
    assert np.sum(squares) < stats.chi2.isf(1e-3, 30)


def test_fitted_lengths_tell_a_flat_direction_from_a_steep_one() -> None:
    rng = np.random.default_rng(8)
    points = rng.uniform(-1.0, 1.0, (80, 2))
    fitted = fit_kriging(
        points, np.sin(4.0 * points[:, 0]) + 0.01 * rng.standard_normal(80), np.full(80, 1e-4)
    )
    assert fitted.covariance.length[1] > 3.0 * fitted.covariance.length[0]


def _with_failures(failed: np.ndarray) -> Bank:
    values, reasons = bank().values.copy(), bank().reasons.astype("<U20")
    values[failed], reasons[failed] = np.nan, "the run failed"
    return replace(bank(), values=values, reasons=reasons)


def test_failed_cases_are_left_out_and_counted() -> None:
    failed = np.zeros(len(bank().reasons), dtype=bool)
    failed[::50] = True
    known = fit_emulator(_with_failures(failed))
    assert any(f"{failed.sum()} of {len(failed)} cases" in note for note in known.notes)


def test_a_mechanism_that_always_fails_leaves_the_library() -> None:
    known = fit_emulator(_with_failures((bank().mechanism == 1) & (bank().condition == 2)))
    assert "beta" not in known.space.names
    assert any(note.startswith("beta has too few") for note in known.notes)


def test_a_condition_that_always_fails_is_an_error_with_its_name() -> None:
    with pytest.raises(RuleError, match="condition wide of the bank"):
        fit_emulator(_with_failures(bank().condition == 2))


def test_scales_of_coefficients_are_found_behind_their_noise() -> None:
    rng = np.random.default_rng(10)
    true, grams, moments = np.array([3.0, 0.5]), [], []
    for _ in range(5):
        terms = rng.uniform(0.0, 1.0, (60, 2))
        data = terms @ (true[:, None] * rng.standard_normal((2, 400))) + rng.standard_normal((60, 400))
        grams.append(terms.T @ terms)
        moments.append(terms.T @ data)
    # 2000 coefficients: a scale of 3 is known to 1.6 %, one of 0.5, as large as its noise, to some 4 %.
    np.testing.assert_allclose(surface_fits.likeliest_scales(grams, moments), true, rtol=0.15)


def test_the_scatter_under_a_mechanism_has_a_correlation_of_its_own() -> None:
    """Size decides, as far as its runs outweigh those that the base's correlation is worth."""
    rng, count = np.random.default_rng(11), 300
    theta, size = rng.uniform(-1.0, 1.0, (count, 1)), rng.uniform(0.0, 1.0, count)
    [noise] = fit_noises([(theta, rng.standard_normal((count, 2)))], np.full(2, 1e-9))
    [base] = fit_bases([BaseRuns.of(theta, rng.standard_normal((count, 2)), noise)])
    triangle = np.linalg.cholesky([[1.0, 0.8], [0.8, 1.0]])
    alike = size[:, None] + rng.standard_normal((count, 2)) @ triangle.T
    [addition] = fit_additions([AddedRuns(base, theta, size, alike)])
    worth = size.sum() ** 2 / (size**2).sum()
    # A correlation of .8 is known to (1 - .8^2) / sqrt(worth), that of the base to 1 / sqrt(300).
    assert addition.correlation[0, 1] == pytest.approx(0.8 * worth / (worth + ALIKE), abs=0.06)
    surfaces = replace(base, additions={"sticks": addition, "else": addition})
    nothing, half, both = np.array([0.0, 0.0]), np.array([0.0, 0.5]), np.array([0.0, 1.0, 1.0])
    np.testing.assert_array_equal(surfaces.correlation(nothing, ("sticks",)), noise.correlation)
    between = (noise.correlation + addition.correlation) / 2.0
    np.testing.assert_allclose(surfaces.correlation(half, ("sticks",)), between, rtol=1e-12)
    two = surfaces.correlation(both, ("sticks", "else"))
    np.testing.assert_allclose(two, addition.correlation, rtol=1e-12)
