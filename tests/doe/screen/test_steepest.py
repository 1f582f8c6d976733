"""Steepest paths: direction, steps, limits, predictions."""

import numpy as np
import pytest

from doe import Factor, central_composite, climb_table, fit_surface, plackett_burman, screen, steepest_path

FACTORS = [Factor("A", 0.0, 10.0), Factor("B", 0.2, 0.4), Factor("C", -5.0, 5.0)]


@pytest.fixture
def plane():
    """Plane theta = 20 + 3 a - 1.5 b + 0 c in coded units."""
    design = plackett_burman(FACTORS)
    return screen(design, 20.0 + 3.0 * design.coded["A"] - 1.5 * design.coded["B"])


def test_path_follows_the_gradient(plane):
    path = steepest_path(plane, 4, step=0.5)
    moves = np.diff(path.coded.to_numpy(), axis=0)
    assert moves == pytest.approx(np.tile([0.5, -0.25, 0.0], (4, 1)), abs=1e-12)
    assert path.natural.iloc[0].to_dict() == pytest.approx({"A": 5.0, "B": 0.3, "C": 0.0}, abs=1e-15)
    assert np.diff(path.predicted) == pytest.approx(3.0 * 0.5 + 1.5 * 0.25, abs=1e-12)


def test_no_direction_of_that_length_rises_more(plane):
    path = steepest_path(plane, 1, step=0.5)
    move = path.coded.iloc[1].to_numpy()
    others = np.random.default_rng(51).normal(size=(200, 3))
    others *= np.linalg.norm(move) / np.linalg.norm(others, axis=1, keepdims=True)
    assert (others @ [3.0, -1.5, 0.0]).max() <= move @ [3.0, -1.5, 0.0] + 1e-12


def test_natural_steps_take_their_sign_from_the_model(plane):
    path = steepest_path(
        plane, 2, factors=["A", "B"], step={"A": 1.0, "B": 0.05}, start={"A": 2.0, "B": 0.38}
    )
    assert path.natural.to_numpy() == pytest.approx(
        np.array([[2.0, 0.38], [3.0, 0.33], [4.0, 0.28]]), abs=1e-12
    )
    assert path.names == ["A", "B"]


def test_a_factor_stays_at_its_limit_while_others_go_on(plane):
    path = steepest_path(plane, 4, step=1.0, limits={"A": (0.0, 12.0)})
    assert path.natural["A"].to_list() == pytest.approx([5.0, 10.0, 12.0, 12.0, 12.0], abs=1e-12)
    assert np.diff(path.coded["B"]) == pytest.approx(-0.5, abs=1e-12)


def test_path_ends_where_nothing_moves(plane):
    path = steepest_path(plane, 9, factors=["A"], step=1.0, limits={"A": (0.0, 12.0)})
    assert path.natural["A"].to_list() == pytest.approx([5.0, 10.0, 12.0], abs=1e-12)
    assert list(path.coded.index) == [1, 2, 3] == list(path.predicted.index)


def test_surface_predicts_its_curvature_along_the_path():
    design = central_composite(FACTORS[:2])
    a, b = design.coded["A"], design.coded["B"]
    path = steepest_path(fit_surface(design, 10.0 + 2.0 * a + b - a**2), 2, step=0.5)
    assert path.predicted.to_list() == pytest.approx([10.0, 11.0, 11.5], abs=1e-9)


def test_climb_table_averages_replicates(plane):
    path = steepest_path(plane, 2)
    table = climb_table(path, [[19.0, 21.0], [23.0, 25.0], [29.0, 31.0]], target=25.0)
    assert table["response"].to_list() == [20.0, 24.0, 30.0]
    assert table["error"].to_list() == [-5.0, -1.0, 5.0]
    assert table["error_percent"].to_list() == pytest.approx([20.0, 4.0, 20.0], rel=1e-12)
