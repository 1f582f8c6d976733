"""Observables of a heap, on drawn truth."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from dem_warp import SCENES, CaseResult, Drum, LiftedCylinder
from experiments.measurement.case_observables import measure, observe
from experiments.studyfile.observables import (
    BY_NAME,
    NAMES,
    OBSERVABLES,
    OUTLINE,
    PHOTOGRAPHED,
    READINGS,
    observables_of,
)
from experiments.studyfile.study import MeasurementSection

BALANCE = {name: 0.1 * index for index, name in enumerate(NAMES) if name not in PHOTOGRAPHED}
SETTINGS = MeasurementSection(azimuths=4, pixels=400)
BASE, RADIUS = 20e-3, 0.5e-3
"""Radius of the drawn cone, and of its spheres [m]."""

Cone = Callable[..., CaseResult]


def heap(cone: Cone, shift: float = 0.0) -> CaseResult:
    """Draw a cone of slope 0.5, its lower parts sheared along x by their distance from the top."""
    result = cone(0.5, radius=0.5e-3)
    positions = result.positions + np.outer(0.5 * BASE - result.positions[:, 2], [shift, 0.0, 0.0])
    return replace(result, positions=positions, observables=BALANCE | {"time_to_rest": 2.0})


def test_there_are_twelve_and_a_photograph_shows_six() -> None:
    assert len(OBSERVABLES) == len(set(NAMES)) == 12
    assert NAMES[:6] == PHOTOGRAPHED


def test_a_cone_has_the_numbers_of_a_cone(cone: Cone) -> None:
    values, reason = measure(SETTINGS, heap(cone))
    found = dict(zip(NAMES, values, strict=True))
    assert reason == ""
    # Spheres of 0.5 mm on a cone of 20 mm by 10 mm: its surface is known to their radius.
    assert found["flank_angle"] == pytest.approx(np.degrees(np.arctan(0.5)), abs=1.5)
    assert found["height"] == pytest.approx(10e-3, abs=1.5 * RADIUS)
    assert found["concavity"] == pytest.approx(0.0, abs=2.0 * RADIUS / 10e-3)
    # Of a cone of radius R the share 3 s^2 - 2 s^3 lies within s R: 0.5 within 0.5 R, 0.9 within 0.804 R.
    assert found["r50"] == pytest.approx(0.5 * BASE, abs=1.5 * RADIUS)
    assert found["r90"] == pytest.approx(0.804 * BASE, abs=1.5 * RADIUS)
    # The drawn grid of spheres begins at -R and ends a step before +R.
    assert found["asymmetry"] == pytest.approx(0.0, abs=RADIUS / BASE)
    assert {name: found[name] for name in BALANCE} == BALANCE


def test_every_reading_of_a_cone_is_its_angle(cone: Cone) -> None:
    found = observe(SETTINGS, heap(cone)).observables
    for each in READINGS:
        # The spheres add their radius, 5 % of the height, everywhere: 15 % of the volume, 3.3 degrees.
        assert found[each.column] == pytest.approx(np.degrees(np.arctan(0.5)), abs=3.5), each.name


def test_a_heap_that_leans_along_x_differs_from_its_mirror_image(cone: Cone) -> None:
    right, left = (measure(SETTINGS, heap(cone, shift))[0][NAMES.index("asymmetry")] for shift in (0.4, -0.4))
    # The foot of the right flank is farther out by 0.4 x 10 mm of 20 mm: the areas differ by 0.4 x 10 / 20.
    assert right == pytest.approx(0.2, abs=2.0 * RADIUS / BASE)
    assert left == pytest.approx(-right, abs=2.0 * RADIUS / BASE)


def test_a_lean_along_y_does_not_show_along_x(cone: Cone) -> None:
    leaning = heap(cone, 0.4)
    turned = replace(leaning, positions=leaning.positions[:, [1, 0, 2]])
    assert measure(SETTINGS, turned)[0][NAMES.index("asymmetry")] == pytest.approx(0.0, abs=RADIUS / BASE)


def test_a_campaign_is_given_the_same_values_as_a_search(cone: Cone) -> None:
    high = heap(cone)
    del high.observables["t75"]
    searched = dict(zip(NAMES, measure(SETTINGS, high)[0], strict=True))
    observed = observe(SETTINGS, high).observables
    assert {each.name: observed[each.column] for each in OBSERVABLES} == searched
    assert observed["t75"] == high.observables["time_to_rest"]


def test_observables_of_a_scene_have_one_definition_each() -> None:
    named = LiftedCylinder.observables
    known = observables_of(named, leaves_a_heap=True)
    assert set(known) == {*named, "bulk_density"} | {
        each.column for each in (*OBSERVABLES, *READINGS, *OUTLINE)
    }
    for name, (unit, meaning) in named.items():
        assert known[name].unit == unit
        assert known[name].definition.startswith(meaning)
    assert BY_NAME["angle"] is BY_NAME["flank_angle"]
    # A name that a picture shows is no test's own.
    declared = {name for scene in SCENES.values() for name in scene.observables}
    assert not declared & {each.name for each in (*READINGS, *OUTLINE)}
    assert "dynamic_angle" in observables_of(Drum.observables, leaves_a_heap=False)


def test_a_failed_case_has_a_reason_and_no_numbers(cone: Cone) -> None:
    values, reason = measure(SETTINGS, cone(status="failed", reason="the tube is clogged"))
    assert np.isnan(values).all()
    assert reason == "the tube is clogged"


def test_a_single_layer_is_no_heap(cone: Cone) -> None:
    flat = replace(heap(cone), positions=np.zeros((0, 3)), orientations=np.zeros((0, 4)))
    flat = replace(flat, sizes=np.zeros(0), shapes=np.zeros(0, dtype=int))
    values, reason = measure(SETTINGS, flat)
    assert np.isnan(values).all()
    assert reason.startswith("no heap: ")
