"""The rotating drum: the slope of a bed that flows."""

import math
from dataclasses import replace

import numpy as np
import pytest
from worlds import STEEL, assert_measured_as_declared, ball_case, run_batch

from dem_warp import Case, CaseResult, Drum, Interaction, Material, WallPart
from dem_warp.model import GRAVITY
from dem_warp.scenes.drum_surface import STATIONS, DrumView, bed_volume, surface_angles, surface_heights

DRUM = Drum(
    diameter=0.05,
    length=0.018,
    wall_material=STEEL,
    rotation_rate=1.0,
    rain_rate=3e3,
    start_up=0.25,
    revolutions=0.75,
    # Without friction a bed rocks to and fro for long: it is at rest when it is slow.
    rest_speed=0.05,
)
FRICTIONS = (0.0, 0.6)


def drum_case(friction: float) -> Case:
    return ball_case(DRUM, friction)


@pytest.fixture(scope="module")
def runs() -> dict[float, CaseResult]:
    results = run_batch([drum_case(friction) for friction in FRICTIONS])
    return {friction: results[i] for i, friction in enumerate(FRICTIONS)}


@pytest.mark.parametrize("friction", FRICTIONS)
def test_a_drum_turns_for_as_long_as_it_should_and_loses_nothing(runs, friction):
    run, seen = runs[friction], runs[friction].observables
    assert (run.status, run.reason) == ("finished", "")
    assert_measured_as_declared(drum_case(friction), run)
    times = {phase["name"]: phase["time"] for phase in run.phases}
    assert list(times) == ["fill", "settle", "start up", "turn"]
    # It looks some forty times a revolution.
    assert times["turn"] == pytest.approx(DRUM.revolutions / DRUM.rotation_rate, abs=0.05)
    assert seen["grains_lost"] == 0
    assert len(run.positions) == seen["grain_count"]
    # A ball sinks into the shell and the ends by less than a tenth of its radius.
    from_axis = np.hypot(run.positions[:, 0], run.positions[:, 2] - DRUM.diameter / 2)
    assert (from_axis + 0.9 * run.sphere_radii < DRUM.diameter / 2).all()
    assert (np.abs(run.positions[:, 1]) + 0.9 * run.sphere_radii < DRUM.length / 2).all()


def test_a_bed_without_friction_stays_level(runs):
    seen = runs[0.0].observables
    # It still rocks: half the height of a ball over the half of its surface is 2.5 degrees.
    assert abs(seen["mass_angle"]) < 2.5
    assert abs(seen["dynamic_angle"]) < 2.5


def test_a_bed_with_friction_is_steep(runs):
    for name in ("dynamic_angle", "mass_angle", "upper_angle", "lower_angle"):
        level, high = (runs[friction].observables[name] for friction in FRICTIONS)
        # Three quarters of a revolution turn the bed over about twice: its angle is good to a few degrees.
        assert high > level + 10.0
    # The drum is narrow, so its ends carry some of the bed: it may pass the angle of friction, 31 degrees.
    assert 25.0 < runs[0.6].observables["dynamic_angle"] < 55.0
    assert runs[0.6].observables["dynamic_angle_sd"] < 10.0


def test_the_level_of_the_filling_encloses_its_part_of_the_drum():
    space = math.pi / 4 * DRUM.diameter**2 * DRUM.length
    for filling in (0.05, 0.35, 0.5):
        drum = replace(DRUM, filling=filling)
        # The level is interpolated in a table of 10,000 angles.
        assert drum.volume == pytest.approx(filling * space, rel=1e-6)
    assert replace(DRUM, filling=0.5).brim == pytest.approx(DRUM.diameter / 2, rel=1e-6)
    assert DRUM.volume_below(DRUM.diameter) == pytest.approx(space, rel=1e-12)


HALF_TURNED = replace(DRUM, revolutions=0.5)
DEEP, INCLINED = (
    replace(HALF_TURNED, filling=0.7),
    replace(HALF_TURNED, filling=0.4, inclination=math.radians(30.0)),
)


@pytest.fixture(scope="module")
def beds() -> dict[Drum, CaseResult]:
    """Return results of a drum filled above its axis, and of one whose axis is inclined."""
    return {scene: run_batch([ball_case(scene, 0.3)])[0] for scene in (DEEP, INCLINED)}


@pytest.mark.parametrize("scene", [DEEP, INCLINED])
def test_a_bed_that_is_not_level_fills_its_part_of_the_drum(beds, scene):
    run, seen = beds[scene], beds[scene].observables
    assert (run.status, run.reason) == ("finished", "")
    assert_measured_as_declared(ball_case(scene, 0.3), run)
    assert seen["grains_lost"] == 0
    # The last grains to land, some ten a look, and those that then roll are within a twentieth of the bed.
    assert seen["fill_height"] == pytest.approx(scene.brim, rel=0.05)
    assert 0.5 < seen["solid_fraction"] < 0.7
    from_axis = np.hypot(run.positions[:, 0], run.positions[:, 2] - scene.diameter / 2)
    assert (from_axis + 0.9 * run.sphere_radii < scene.diameter / 2).all()


def test_gravity_is_turned_and_the_bed_rests_against_the_lower_end(beds):
    assert np.hypot(*INCLINED.gravity[1:]) == pytest.approx(GRAVITY, rel=1e-12)
    assert INCLINED.gravity[1] == pytest.approx(-GRAVITY / 2, rel=1e-12)
    # The surface of a bed that ran level would fall by tan 30 over the length; friction keeps a part of it.
    assert beds[INCLINED].positions[:, 1].mean() < -0.03 * INCLINED.length
    assert abs(beds[DEEP].positions[:, 1].mean()) < 0.01 * DEEP.length


def test_every_wall_part_has_its_own_contact_and_the_special_name_wins():
    case = ball_case(DRUM, 0.4)
    glass, felt = Material(2500.0, 1e9, 0.2), Material(300.0, 1e6, 0.3)
    smooth, rough = Interaction(0.5, 0.0, 0.0), Interaction(0.5, 0.9, 0.2)
    parts = (WallPart("ends", felt, rough), WallPart("front", glass, smooth))
    contacts, holds = DRUM.surfaces(replace(case, wall_parts=parts), 3)
    assert holds == [1, 3, 2]
    assert [contacts[i].static_friction for i in holds] == [0.4, 0.0, 0.9]
    assert contacts[3].modulus > contacts[2].modulus
    assert DRUM.surfaces(case, 3) == (case.contacts(STEEL), [1, 1, 1])


def slab(tilt: float, back: float = 0.0) -> np.ndarray:
    """Return a dense bed below a plane through the drum's axis, higher by `back` at the far end [m]."""
    step = 1e-3
    x, y, z = np.meshgrid(*[np.arange(-0.025, 0.025, step)] * 3, indexing="ij")
    points = np.column_stack([x.ravel(), 0.36 * y.ravel(), z.ravel()])
    x, y, z = points.T
    level = -math.tan(math.radians(tilt)) * x + back * (y / 0.018 + 0.5)
    return points[(np.hypot(x, z) < 0.0245) & (z < level)]


def test_a_camera_sees_the_highest_line_against_the_light_and_the_near_one_by_its_grains():
    bed, reach = slab(20.0, back=6e-3), 5e-4
    tops = {}
    for picture, distance in (("end", None), ("silhouette", None), ("silhouette", 0.05)):
        seen = DrumView(0.025, 0.018, picture, distance).seen(bed, reach)
        tops[picture, distance] = seen[np.abs(seen[:, 0]) < 1e-3, 2].max()
    # A bed that rises by 6 mm to the far end: near grains are at its foot, the outline is at its top.
    assert tops["end", None] == pytest.approx(0.3e-3, abs=1e-3)
    assert tops["silhouette", None] == pytest.approx(6e-3, abs=1e-3)
    # From 50 mm the far end, 18 mm behind, looks smaller by 50 / 68.
    assert tops["silhouette", 0.05] == pytest.approx(6e-3 * 50 / 68, abs=1e-3)


def test_the_volume_below_a_bed_is_that_of_the_drum_below_its_plane():
    # Half the drum at any slope: within half a grain over the surface, 0.25 of 19.6 mm.
    half = math.pi / 2 * 0.025**2 * 0.018
    for tilt in (0.0, 30.0):
        assert bed_volume(slab(tilt), 0.025, 0.018, 5e-4) == pytest.approx(half, rel=0.05)
    assert bed_volume(np.empty((0, 3)), 0.025, 0.018, 5e-4) == 0.0


@pytest.mark.parametrize("picture", ["depth", "silhouette", "end"])
@pytest.mark.parametrize("tilt", [0.0, 50.0])
def test_every_picture_of_a_plane_bed_shows_its_slope_and_heights(picture, tilt):
    view, bed = DrumView(0.025, 0.018, picture), slab(tilt)
    # The heights of a lattice of 1 mm over a surface of 40 mm.
    assert surface_angles(bed, 0.025, 5e-4, view).dynamic_angle == pytest.approx(tilt, abs=1.0)
    heights = surface_heights(bed, 0.025, 5e-4, view)
    x = 0.025 * np.array(STATIONS)
    wall = np.sqrt(0.025**2 - x**2)
    plane = np.clip(-math.tan(math.radians(tilt)) * x, -wall, wall)
    # A lattice of 1 mm, whose balls reach 0.3 mm less to the shell than the plane does.
    assert heights == pytest.approx(plane, abs=0.9e-3 / math.cos(math.radians(tilt)))


def test_a_drum_measures_its_surface_from_end_to_end(runs):
    level, steep = ([runs[f].observables[f"surface_{i}"] for i in range(1, 10)] for f in (0.0, 0.6))
    # Without friction the bed is level from -0.6 to 0.6 of the radius, to half a ball; with it, it falls.
    assert np.ptp(level[2:7]) < 2e-3
    assert all(np.diff(steep[2:7]) < 0.0)
