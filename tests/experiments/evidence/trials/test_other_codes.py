"""A second reality: inputs say what was hidden, films are read as they were drawn, codes run them."""

import math
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dem_warp import Case
from dem_warp.laws.capillary import CapillaryBridge
from dem_warp.laws.jkr import JKR
from dem_warp.scenes.surfaces import bed_level
from doe.discrepancy import Point
from experiments.cases import OwnWorkers
from experiments.cases.engines.program import AnswerError
from experiments.cases.store.outcome_table import OutcomeTable
from experiments.evidence.trials.generate_trials import STUDY
from experiments.evidence.trials.other_codes import dump_reading
from experiments.evidence.trials.other_codes.code_effects import DECLARED, OUTSIDE, UNSEEN
from experiments.evidence.trials.other_codes.code_simulator import OtherCodeSimulator
from experiments.evidence.trials.other_codes.code_surfaces import Bench
from experiments.evidence.trials.other_codes.generate_other import PLAN, in_turn, plan_for
from experiments.evidence.trials.other_codes.liggghts_trials import energy_density, liggghts_files, wetting
from experiments.evidence.trials.other_codes.making import MADE
from experiments.evidence.trials.other_codes.setting import Setting
from experiments.evidence.trials.truth import Kind, Label
from experiments.evidence.trials.truths import Plan
from experiments.io.errors import InputError
from experiments.studyfile import load_study
from experiments.studyfile.observables import NAMES, OUTLINE

THETA = {"mu_gg": 0.6, "mu_gw": 0.5, "e_gg": 0.3}
COUNT = 24
SMALL = {"scene": {"lifted-cylinder": {"grain_count": COUNT, "height": "25 mm"}}}
SETTING = Setting(1.0, 1000.0, 48, 4e-3, "cdt")
G = 9.81


def case_of() -> Case:
    """Return a test of few grains, in the setting of LIGGGHTS's workshop."""
    case = load_study(STUDY, "bench", SMALL).case(THETA, seed=3)
    return SETTING.of(case)


SHAPE = case_of().grains.mixture.shapes[0]


def rows_of(positions: np.ndarray, sizes: np.ndarray, seed: int, velocity: np.ndarray) -> np.ndarray:
    """Rows of a dump of turned grains that move alike, in a strange order."""
    rng = np.random.default_rng(seed)
    turns = Rotation.random(len(positions), random_state=seed)
    rows = []
    for number, (place, size) in enumerate(zip(positions, sizes, strict=True)):
        centers = place + turns[number].apply(SHAPE.centers * size)
        for sphere, (center, radius) in enumerate(zip(centers, SHAPE.radii * size, strict=True)):
            identity = number * SHAPE.sphere_count + sphere + 1
            rows.append([identity, number + 1, *center, *velocity, radius])
    return rng.permutation(np.array(rows))


def test_a_grain_is_found_by_its_spheres() -> None:
    rng = np.random.default_rng(1)
    places, sizes = rng.uniform(-0.01, 0.01, (7, 3)), rng.uniform(0.9, 1.1, 7)
    velocity = np.array([0.1, -0.2, 0.3])
    frame = dump_reading.Grasp(SHAPE).frame(5, rows_of(places, sizes, 2, velocity))
    # nine digits of metres in, double precision through
    assert frame.positions == pytest.approx(places, abs=1e-12)
    assert frame.sizes == pytest.approx(sizes, rel=1e-12)
    assert frame.velocities == pytest.approx(np.tile(velocity, (7, 1)), abs=1e-12)
    assert frame.spheres.shape == (7, SHAPE.sphere_count, 4)


def test_spheres_that_are_no_grain_are_refused() -> None:
    rows = rows_of(np.zeros((1, 3)), np.ones(1), 2, np.zeros(3))
    rows[0, 2] += 1e-4
    with pytest.raises(AnswerError, match="not where its shape has them"):
        dump_reading.Grasp(SHAPE).frame(0, rows)
    with pytest.raises(AnswerError, match="every grain must have 3 spheres"):
        dump_reading.Grasp(SHAPE).frame(0, rows[:2])


def test_a_film_that_breaks_off_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "film.dump"
    with pytest.raises(AnswerError, match=r"wrote no film\.dump"):
        list(dump_reading.read_film(path, SHAPE))
    head = "ITEM: TIMESTEP\n{}\nITEM: NUMBER OF ATOMS\n3\nITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\n"
    row = " ".join(["0.0"] * 9)
    path.write_text(head.format(4) + f"ITEM: ATOMS id mol x y z vx vy vz radius\n{row}\n{row}\n")
    with pytest.raises(AnswerError, match="step 4 must have 3 rows, got 2"):
        list(dump_reading.read_film(path, SHAPE))
    (tmp_path / "balance.txt").write_text("# step force\n# second\n100 -0.5\n150 -0.25\n")
    assert dump_reading.read_balance(tmp_path / "balance.txt") == {100: -0.5, 150: -0.25}


FALL_STEPS, LOOK = 4000, 50


def _film(case: Case, places: np.ndarray) -> Iterator[dump_reading.Frame]:
    """Film of a bed that shrinks to a tenth of its height at one rate, and then lies still."""
    still = round((case.scene.lift_time + case.scene.rest_time + 0.1) / case.time_step)
    for step in range(0, FALL_STEPS + still, LOOK):
        fallen = min(step / FALL_STEPS, 1.0)
        now = places * np.array([1.0, 1.0, 1.0 - 0.9 * fallen])
        speed = 0.0 if fallen == 1.0 else 0.9 / (FALL_STEPS * case.time_step)
        velocity = np.stack([0 * places[:, 2], 0 * places[:, 2], -speed * places[:, 2]], axis=1)
        numbers, sizes = np.arange(1, len(places) + 1), np.ones(len(places))
        spheres = now[:, None] + SHAPE.centers[None]
        radii = np.broadcast_to(SHAPE.radii[None, :, None], (len(places), SHAPE.sphere_count, 1))
        yield dump_reading.Frame(
            step, numbers, now, velocity, sizes, np.concatenate([spheres, radii], axis=2)
        )


def test_times_and_drag_of_a_drawn_film_are_those_it_was_drawn_with() -> None:
    case = case_of()
    rng = np.random.default_rng(4)
    radius = case.scene.diameter / 2
    places = np.column_stack([rng.uniform(-0.6, 0.6, (60, 2)) * radius, rng.uniform(0.002, 0.02, 60)])
    mass = 60 * case.grain_material.density * SHAPE.volume
    # a quarter of the weight hangs on the tube in every step
    frames = list(_film(case, places))
    forces = {frame.step: -0.25 * mass * G for frame in frames[1:]}
    seen, last, failure = dump_reading.filmed_observables(case, iter(frames), forces)
    assert failure == ""
    assert seen["wall_drag"] == pytest.approx(0.25, rel=1e-6)
    reach = case.grains.grain_reach
    top = bed_level(places, (radius, radius), reach)
    assert seen["fill_height"] == pytest.approx(top, rel=1e-12)
    # the level is half a grain above tops that sink at one rate; between two looks it is straight
    half = 0.5 * reach
    for name, part in (("t75", 0.75), ("t55", 0.55)):
        fallen = (1.0 - (part * top - half) / (top - half)) / 0.9
        assert seen[name] == pytest.approx(fallen * FALL_STEPS * case.time_step, rel=1e-9)
    assert seen["centre_height"] == pytest.approx(0.1 * places[:, 2].mean(), rel=1e-6)
    assert seen["rolled_fraction"] == pytest.approx(0.0, abs=1e-12)
    assert len(last.numbers) == 60


def test_the_energy_density_parts_spheres_as_hard_as_jkr() -> None:
    work, radius, modulus = 0.02, 1.35e-3, 1.2e5
    reduced = radius / 2
    density = energy_density(1.5 * math.pi * work * reduced, reduced, modulus)
    overlap = np.linspace(0.0, 1e-4, 400_001)
    force = 4 / 3 * modulus * math.sqrt(reduced) * overlap**1.5 - density * 2 * math.pi * reduced * overlap
    # the grid is fine enough for six digits at a minimum
    assert -force.min() == pytest.approx(1.5 * math.pi * work * reduced, rel=1e-6)


def test_bridges_pull_alike_where_spheres_touch_and_break_alike() -> None:
    bridge = CapillaryBridge(surface_tension=0.01, bridge_volume=5e-11)
    radius = 1.35e-3
    part, tension = wetting(bridge, radius)
    # LIGGGHTS takes of each sphere the part of its liquid in the cap that the other one covers
    cap = 0.5 * (1.0 - math.sqrt(1.0 - 0.25))
    volume = 2 * cap * part * 4 / 3 * math.pi * radius**3
    assert volume == pytest.approx(bridge.bridge_volume, rel=1e-12)
    scaled = math.log(volume / radius**3)
    force = math.pi * tension * radius * (math.exp(0.48 - 0.0082 * scaled) + 0.078 + 0.0018 * scaled)
    assert force == pytest.approx(2 * math.pi * radius * bridge.surface_tension, rel=1e-12)


def test_each_stranger_changes_the_case_and_keeps_the_mass_of_all_grains() -> None:
    case = case_of()

    def mass(case: Case) -> float:
        return case.scene.grain_count * sum(t.fraction * t.mass for t in Bench(case).templates)

    for name, effect in OUTSIDE.items():
        changed = effect.change(case, effect.maximum)
        assert changed != case
        if name == "wet_patches":
            with pytest.raises(InputError):
                Bench(changed)
            continue
        # a number of grains is whole
        assert mass(changed) == pytest.approx(mass(case), rel=0.5 / COUNT)
    assert [each.name for each in DECLARED] == list(OUTSIDE)


def test_a_stranger_is_in_our_world_as_it_is_declared() -> None:
    case = case_of()
    weight = G * case.grain_material.density * SHAPE.volume
    worlds = {
        name: OUTSIDE[name].change(case, size)
        for name, size in (("two_densities", 3.0), ("static_charge", 2.0), ("wet_patches", 4.0))
    }
    [dense], [charged], [wet] = (each.scene.prepare([each], "cpu") for each in worlds.values())
    found, counts = np.unique(dense.grains.densities, return_counts=True)
    assert found == pytest.approx(case.grain_material.density * np.array([0.5, 1.5]), rel=1e-12)
    assert counts.tolist() == [COUNT / 2, COUNT / 2]
    radius = float(np.mean(SHAPE.radii)) * case.grains.size_mean
    for world, wall, weights in ((charged, 0, 2.0), (charged, 1, 2.0), (wet, 2, 4.0)):
        _, contact = world.walls[wall]
        [bridge] = world.contacts[contact].mechanisms
        # the pull on a sphere that touches a wall
        pull = 2.0 * math.pi * radius * bridge.surface_tension
        assert pull == pytest.approx(weights * weight, rel=1e-3)
    assert not wet.contacts[wet.walls[0][1]].mechanisms


def liggghts_text(case: Case) -> str:
    return liggghts_files(Bench(case))["lift.in"]


def test_liggghts_is_friction_what_is_hidden() -> None:
    case = case_of()
    assert "cohesion" not in liggghts_text(case)
    adhesive = replace(case, mechanisms=(JKR(between="grains", work_of_adhesion=0.02),))
    text = liggghts_text(adhesive)
    # among grains alone: the walls' laws have no adhesion
    assert "pair_style gran model hertz tangential history cohesion sjkr" in text
    assert "wall/gran model hertz tangential history rolling_friction" in text
    jerk = liggghts_text(OUTSIDE["jerk"].change(case, 0.2))
    first, then = map(float, re.findall(r"fix lift all .* linear 0 0 (\S+)", jerk))
    look = Bench(case).look_steps * case.time_step
    assert first * look == pytest.approx(0.2 * case.scene.height, rel=1e-6)
    assert then == pytest.approx(case.scene.lift_speed, rel=1e-6)
    charged = liggghts_text(OUTSIDE["static_charge"].change(case, 1.0))
    rows = charged.split("cohesionEnergyDensity peratomtypepair 3 ")[1].split("\n")[0].split()
    density = np.array(rows, float).reshape(3, 3)
    assert density == pytest.approx(density.T)
    assert density[0, 0] == 0.0 < density[0, 1] == density[0, 2]
    assert "wall/gran model hertz tangential history cohesion sjkr" in charged
    shaken = replace(case, scene=replace(case.scene, vibration_amplitude=1e-4))
    assert "wiggle amplitude 0 0 0.0001 period 0.02" in liggghts_text(shaken)


def test_a_bowed_tube_is_right_at_both_ends() -> None:
    case = OUTSIDE["bent_tube"].change(case_of(), 0.5)
    numbers = re.findall(r"vertex (\S+) (\S+) (\S+)", liggghts_files(Bench(case))["tube.stl"])
    corners = np.array(numbers, dtype=float)
    for part, shift in ((0.0, 0.0), (0.5, 0.5), (1.0, 0.0)):
        ring = corners[np.isclose(corners[:, 2], part * case.scene.height)]
        ends = ring[:, 0].min(), ring[:, 0].max()
        # nine digits are written
        assert np.mean(ends) == pytest.approx(shift * case.scene.diameter, abs=1e-9)


def test_a_setting_is_the_trials_own_and_always_the_same() -> None:
    settings = {Setting.drawn(seed) for seed in range(30)}
    assert len(settings) == 30
    assert {setting.rolling for setting in settings} == {"cdt", "epsd2"}
    assert Setting.drawn(7) == Setting.drawn(7)
    ours, theirs = load_study(STUDY, "bench").case(THETA, 1), Setting.drawn(7)
    case = theirs.of(ours)
    assert case.time_step == pytest.approx(theirs.step_share * ours.time_step)
    assert case.laws.sliding == "spring_free"


def test_the_plan_holds_200_trials_of_what_the_code_can_make() -> None:
    plan = plan_for(PLAN)
    assert plan.mechanisms == tuple(MADE)
    # four of its mechanisms may be named at that scale, two may not
    singles = 4 * plan.strong + 2 * plan.unresolved
    assert plan.nulls + singles + plan.pairs + plan.outside * (len(OUTSIDE) - len(UNSEEN)) == 200
    with pytest.raises(InputError, match="liggghts makes only"):
        plan_for(Plan(mechanisms=("air_drag",)))


def test_trials_are_measured_evenly_over_their_classes() -> None:
    rng = np.random.default_rng(3)
    drawn = [(Kind.NULL, ())] * 20 + [(Kind.PAIR, ("a", "b")), (Kind.PAIR, ("a", "c"))] * 3
    drawn += [
        (kind, (name,)) for kind, name in ((Kind.SINGLE, "a"), (Kind.SINGLE, "b"), (Kind.OUTSIDE, "d"))
    ] * 4
    labels = [
        Label(f"t-{n:02d}", drawn[at][0], (), tuple((name, 1.0) for name in drawn[at][1]), (), n, "")
        for n, at in enumerate(rng.permutation(len(drawn)))
    ]
    order = in_turn(labels)
    assert {label.trial for label in order} == {label.trial for label in labels}
    for kind in Kind:
        seen = np.cumsum([label.kind is kind for label in order])
        even = seen[-1] * (np.arange(len(order)) + 1) / len(order)
        # each class is half a trial off its share at most, and no kind here has more than two
        assert np.abs(seen - even).max() < 2.0


Sizes = tuple[tuple[str, float], ...]
"""Effects of a test with their sizes."""


def observed(folder: Path, *sizes: Sizes, seed: int = 12) -> list[dict[str, float] | str]:
    """Observables of small tests that a code runs, each with some effects; or why one has no heap."""
    study, table = load_study(STUDY, "bench", SMALL), OutcomeTable(folder / "outcomes.sqlite")
    points = [Point(tuple(THETA.values()), own, "base", seed) for own in sizes]
    with OtherCodeSimulator(study, SETTING, table, OwnWorkers("cpu", 1)) as simulator:
        outcomes = simulator(points)
    rows = [dict(zip(simulator.observables, row, strict=True)) for row in outcomes.values]
    return [reason or row for row, reason in zip(rows, outcomes.reasons, strict=True)]


@pytest.mark.program("liggghts")
def test_a_code_makes_a_heap_that_our_functions_read(tmp_path: Path) -> None:
    [seen] = observed(tmp_path, ())
    assert not isinstance(seen, str)
    assert set(seen) == {*NAMES, *(each.name for each in OUTLINE)}
    assert np.isfinite(list(seen.values())).all()
    scene = case_of().scene
    assert 0.0 < seen["t75"] < seen["t55"] < scene.lift_time
    # grains of 2.3 mm reach, 24 of them in a tube of 14 mm: two or three layers and more
    assert 0.5e-2 < seen["fill_height"] < scene.height
    assert 0.0 < seen["wall_drag"] < 1.0
    # it is kept: no program is asked for again
    assert len(OutcomeTable(tmp_path / "outcomes.sqlite")) == 1
    assert observed(tmp_path, ()) == [seen]


@pytest.mark.program("liggghts")
def test_a_code_makes_every_effect(tmp_path: Path) -> None:
    left = {name: _largest(name) for name in MADE}
    left |= {name: effect.maximum for name, effect in OUTSIDE.items() if name not in UNSEEN}
    # so few grains may leave no heap that can be read: another filling decides then
    for seed in (12, 13, 14, 15):
        effects = tuple(((name, size),) for name, size in left.items())
        without, *with_one = observed(tmp_path, (), *effects, seed=seed)
        if isinstance(without, str):
            continue
        for name, seen in zip(tuple(left), with_one, strict=True):
            if not isinstance(seen, str):
                assert np.isfinite(list(seen.values())).all(), name
                assert seen != without, name
                del left[name]
        if not left:
            break
    assert not left


def _largest(effect: str) -> float:
    from experiments.discover.mechanism_files import library_for

    [mechanism] = [each for each in library_for(load_study(STUDY, "bench")) if each.name == effect]
    return mechanism.maximum
