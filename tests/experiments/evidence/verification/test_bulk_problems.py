"""The bulk problems of the verification: their analysis on drawn truth, and the shortest of each."""

import math
from dataclasses import replace

import numpy as np
import pytest

from dem_warp import simulate
from dem_warp.walls import Mesh
from experiments.cases import Store
from experiments.evidence.verification.problems import beverloo, heap_angle, janssen, stability, stored
from experiments.studyfile import load_study


def test_k_comes_back_from_the_load_that_janssen_says():
    k, diameter, height, weight = 0.8, 0.03, 0.09, 2.0
    x = 4.0 * k * janssen.WALL_FRICTION * height / diameter
    floor = weight * (1.0 - math.exp(-x)) / x
    one = np.ones(4)
    loads = janssen.Loads(
        diameter=diameter,
        height=height,
        weight=weight,
        path=one,
        floor=floor * one,
        wall=(weight - floor) / janssen.WALL_FRICTION * one,
        depth=one,
        vertical=one,
        horizontal=one,
    )
    assert loads.janssen == pytest.approx(k, rel=1e-9)
    np.testing.assert_allclose(loads.mobilised, 1.0, rtol=1e-12)


def test_the_wall_of_a_tube_that_is_drawn_upwards_carries_what_janssen_says():
    (loads,) = janssen.draw([janssen.column(6, 0)], "cpu")
    # Every contact on the wall slides; what is left are the column's vibrations, 3 % of a load at a time.
    assert loads.wall_friction == pytest.approx(janssen.WALL_FRICTION, rel=0.05)
    # One K for the floor and for the stresses on the way: so narrow a tube holds six spheres across.
    assert loads.measured == pytest.approx(loads.janssen, rel=0.25)
    sine = math.sin(math.atan(janssen.FRICTION))
    assert (1.0 - sine) / (1.0 + sine) < loads.janssen < (1.0 + sine) / (1.0 - sine)
    assert loads.share < 0.6


def test_exponent_and_constant_come_back_from_beverloos_law():
    flows = [(outlet, 0.6 * (outlet - 1.4) ** beverloo.EXPONENT) for outlet in (6.0, 8.0, 10.0)]
    assert beverloo.exponent(flows, 1.4) == pytest.approx(beverloo.EXPONENT, rel=1e-9)
    assert beverloo.rate_constant(flows, 1.4) == pytest.approx(0.6, rel=1e-9)
    # A correction that is too large makes small outlets look too good.
    assert beverloo.exponent(flows, 1.6) < beverloo.EXPONENT - 0.05


def test_bins_differ_in_size_only():
    small, large = (beverloo.hopper_case(outlet, 0.2, 1).scene for outlet in (6, 9))
    for name in ("diameter", "fill_depth", "outlet"):
        assert getattr(large, name) == pytest.approx(1.5 * getattr(small, name))
    # Their cross-sections are 2.25 to 1, and so are the grains a second.
    assert large.rain_rate == pytest.approx(2.25 * small.rain_rate)


def test_a_kind_of_heap_passes_only_when_the_whole_interval_is_within_the_margin():
    rng = np.random.default_rng(1)
    base, same = 25.0 + rng.normal(size=(2, 60))
    verdicts = {}
    # The interval of 60 against 60 heaps with a deviation of 1 degree reaches 0.36 degrees to either side.
    for moved in (0.0, 0.9, 2.0):
        compared = heap_angle.shift(same - same.mean() + base.mean() + moved, base)
        verdicts[moved] = [row.passed for row in heap_angle.shift_rows("heaps", "moved", compared)]
    assert verdicts == {0.0: [True, True], 0.9: [False, False], 2.0: [False, False]}


def test_a_heap_without_an_angle_is_left_out_of_the_comparison():
    base = np.array([25.0, 26.0, 24.5])
    compared = heap_angle.shift(np.array([25.0, np.nan, 26.0, 24.5]), base)
    assert (compared.a.n, compared.difference) == (3, 0.0)


def test_kinds_of_heaps_change_the_numerics_or_the_tube_alone():
    case = load_study(scale="bench").case({}, 3)
    half, double, mesh = (change(case) for change in heap_angle.KINDS.values())
    assert half.time_step == pytest.approx(0.5 * case.time_step)
    assert double.numerics.precision == "double"
    assert (half.scene, half.seed, double.scene, mesh.numerics) == (case.scene, 3, case.scene, case.numerics)
    tube, round_tube = mesh.scene.walls(0.0)[1], case.scene.walls(0.0)[1]
    assert isinstance(tube, Mesh)
    assert tube.triangle_count == 2 * heap_angle.SEGMENTS
    # The corners of a regular polygon of the same area stand outside the circle, by a third of (pi / n)^2.
    corner = np.linalg.norm(tube.vertices[:, :2], axis=1)
    assert corner == pytest.approx(
        round_tube.radius * (1.0 + (math.pi / heap_angle.SEGMENTS) ** 2 / 3.0), rel=1e-5
    )


def test_a_corner_at_the_whole_rayleigh_time_is_flagged_and_stored(tmp_path, monkeypatch):
    study = load_study(scale="bench")
    runs = stability.corners(study)
    assert len(runs) == 12
    case, store = heap_angle.with_numerics(runs[2], time_step_fraction=1.0), Store(tmp_path)
    (result,) = stored.finished_cases([case], "cpu", store)
    assert result.status == "diverged"
    assert stability.ended_in_order(result)
    assert "lower time_step_fraction" in stability.outcome(result)
    assert not stability.ended_in_order(replace(result, reason="diverged"))
    assert np.isnan(stored.repose_angles(study, [result])).all()

    def only_what_is_missing(cases, *args, **settings):
        assert cases == []
        return simulate(cases, "cpu")

    monkeypatch.setattr(stored, "simulate", only_what_is_missing)
    (again,) = stored.finished_cases([case], "cpu", store)
    assert (again.status, again.reason) == (result.status, result.reason)
