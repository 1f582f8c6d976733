"""Measured data as arrays: means and covariances over what was measured."""

import numpy as np

from doe.discrepancy import Measured

NAN = np.nan
NAMES = ("flank_angle", "height")


def measured(rows: list[list[float]], **more) -> Measured:
    return Measured(("base",), NAMES, {"base": np.array(rows)}, **more)


def test_means_and_covariances_are_those_of_complete_tables() -> None:
    rows = np.random.default_rng(5).normal(size=(7, 2))
    data = measured(rows.tolist())
    np.testing.assert_array_equal(data.counts("base"), [7, 7])
    # Both sum the same seven numbers, perhaps in another order: some roundings of float64.
    np.testing.assert_allclose(data.mean("base"), rows.mean(axis=0), rtol=1e-14)
    np.testing.assert_allclose(data.covariance("base"), np.cov(rows.T), rtol=1e-13)


def test_what_was_not_measured_counts_nowhere() -> None:
    data = measured([[20.0, 1.0], [22.0, NAN], [24.0, 3.0]])
    np.testing.assert_array_equal(data.counts("base"), [3, 2])
    np.testing.assert_array_equal(data.mean("base"), [22.0, 2.0])
    # Angle over three replicates, (4 + 0 + 4) / 2; both over the two that have both, (2 * 1 + 2 * 1) / 1.
    np.testing.assert_array_equal(data.covariance("base"), [[4.0, 4.0], [4.0, 2.0]])


def test_one_replicate_has_a_mean_and_no_scatter() -> None:
    data = measured([[20.0, NAN]])
    np.testing.assert_array_equal(data.mean("base"), [20.0, NAN])
    assert np.isnan(data.covariance("base")).all()


def test_fewer_observables_leave_the_rest_as_it_is() -> None:
    data = measured([[20.0, 1.0], [22.0, 2.0]], notes=("a note",)).only(["height", "r50"])
    assert data.observables == ("height",)
    assert data.notes == ("a note",)
    np.testing.assert_array_equal(data.values["base"], [[1.0], [2.0]])
