"""The benchmarks' instruments: scene, counts, export to another code, record. Speeds are not tested."""

from __future__ import annotations

import stat
import sys
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from dem_warp import LiftedCylinder
from dem_warp.device import resolve_device
from dem_warp.solver import CHUNK
from dem_warp.walls import Cylinder, Disc, Plane
from experiments.benchmarks import columns as scene
from experiments.benchmarks.columns import Columns, Moment, reference_case
from experiments.benchmarks.contacts import count_contacts, placed_centers
from experiments.benchmarks.grain_cost import bed
from experiments.benchmarks.heap_throughput import speed_tables
from experiments.benchmarks.peers import liggghts
from experiments.benchmarks.record import record_page
from experiments.benchmarks.roofline import step_traffic, world_contacts
from experiments.benchmarks.tables import markdown_table, parse_counts
from experiments.benchmarks.timing import run_in, start, time_steps
from experiments.study import load_study

DEVICE = "cpu"
SMALL = LiftedCylinder(0.020, 0.020, scene.STEEL, rain_rate=300.0, grain_count=60)


@pytest.fixture(scope="module")
def small_columns(tmp_path_factory: pytest.TempPathFactory) -> Columns:
    """One column of sixty grains, simulated and kept."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(scene.SCALES, "small", (SMALL, 400.0))
        return Columns("small", 1, resolve_device(DEVICE), tmp_path_factory.mktemp("columns"))


@pytest.mark.parametrize("scale", ["bench", "soft", "paper"])
def test_columns_hold_the_study_s_centre_point_in_one_size(scale: str) -> None:
    case, ours = load_study(scale=scale).case({}, 3), reference_case(scale, 3)
    assert (ours.scene, ours.numerics, ours.seed) == (case.scene, case.numerics, case.seed)
    assert ours.grains == replace(case.grains, size_sd=0.0)
    for name in ("grain_grain", "grain_wall"):
        # the study takes the middle of a range, which rounds
        assert asdict(getattr(ours, name)) == pytest.approx(asdict(getattr(case, name)), rel=1e-15)


def test_an_unknown_scale_is_refused() -> None:
    with pytest.raises(ValueError, match="scale: must be one of paper, soft, bench, got 'huge'"):
        reference_case("huge")


# ---- moments -----------------------------------------------------------------------------------------------


def test_moments_are_what_their_names_say(small_columns: Columns) -> None:
    filling, settled, lifting = (small_columns.moments(phase, 1)[0] for phase in scene.MOMENTS)
    waiting = filling.setup.grains.release_steps > 0
    assert 0 < np.count_nonzero(waiting) < filling.setup.grains.count
    # rain falls at its speed until it is released
    np.testing.assert_allclose(filling.setup.grains.velocities[waiting, 2], -SMALL.rain_speed, rtol=1e-6)
    assert np.abs(settled.setup.grains.velocities).max() < 10.0 * SMALL.rest_speed
    # caught at the first look after the moment; a look is due every chunk
    late = CHUNK * lifting.setup.time_step * SMALL.lift_speed / SMALL.diameter
    rise = lifting.setup.walls[scene.TUBE][0].point[2] / SMALL.diameter
    share = scene.MOMENTS["lifting"][0]
    assert share <= rise < share + late
    assert lifting.tube_motion.velocity == (0.0, 0.0, SMALL.lift_speed)


def test_worlds_take_all_moments_before_they_repeat(small_columns: Columns) -> None:
    waiting = [
        np.count_nonzero(moment.setup.grains.release_steps) for moment in small_columns.moments("filling", 5)
    ]
    assert waiting[:4] == sorted(set(waiting), reverse=True)
    assert waiting[4] == waiting[0]


def test_a_settled_column_goes_on_at_rest(small_columns: Columns) -> None:
    solver = start(small_columns.moments("settled", 1), DEVICE)
    run_in(solver)
    timing = time_steps(solver, 256, stretches=1)
    assert timing.rebuilds == 0.0
    assert timing.free_spheres == 9 * SMALL.grain_count
    assert np.abs(solver.view([0])[0].velocities).max() < SMALL.rest_speed


def test_waiting_grains_count_neither_as_work_nor_in_the_lists(small_columns: Columns) -> None:
    solver = start(small_columns.moments("filling", 1), DEVICE)
    free = int(np.count_nonzero(solver.view([0])[0].released))
    timing = time_steps(solver, 256, stretches=1)
    after = int(np.count_nonzero(solver.view([0])[0].released))
    assert timing.free_spheres == 9 * (free + after) / 2


def test_the_table_has_every_phase_and_adds_up(small_columns: Columns) -> None:
    *_, last = speed_tables(small_columns, [1, 2], 256)
    (_, text, table), (_, _, traffic) = last
    assert list(table["worlds"]) == [1, 1, 1, 2, 2, 2]
    assert list(table["phase"]) == 2 * ["filling", "settled", "lifting"]
    for speed, grains in (("million sphere-steps/s", "grains"), ("of free grains", "free grains")):
        spheres = 9 * table["worlds"] * table[grains]
        np.testing.assert_allclose(table[speed] * table["us a step"], spheres, rtol=1e-12)
    settled = table[table["phase"] == "settled"].iloc[-1]
    assert settled["B a grain"] == (traffic["bytes"] * traffic["elements"] * traffic["moves"]).sum()
    assert "small" in text


# ---- counts ------------------------------------------------------------------------------------------------


def test_contacts_are_pairs_of_different_grains_and_walls() -> None:
    centers = np.array([[0.0, 0.0, 0.9], [1.5, 0.0, 0.9], [3.6, 0.0, 1.1], [9.5, 0.0, 5.0]])
    grain = np.array([0, 0, 1, 2])
    walls = [Plane(), Cylinder((0.0, 0.0, 0.0), 10.0, 8.0)]
    # spheres 0 and 1 overlap but are one grain's; 1 and 2 are 2.1 apart, 3 overlaps the tube alone
    counts = count_contacts(centers, np.ones(4), grain, walls)
    assert (counts.grain_pairs, counts.wall_pairs) == (0, 3)
    counts = count_contacts(centers, np.full(4, 1.06), grain, walls)
    assert (counts.grain_pairs, counts.wall_pairs) == (1, 3)
    assert (counts.entries(mutual=True), counts.entries(mutual=False)) == (5, 4)
    with pytest.raises(ValueError, match="must be planes and cylinders, got Disc"):
        count_contacts(centers, np.ones(4), grain, [Disc((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 1.0)])


def test_near_is_what_may_touch_within_the_paths_of_both(small_columns: Columns) -> None:
    solver = start(small_columns.moments("settled", 1), DEVICE)
    solver._look_ahead(2, 0)
    paths = solver.hood.near.path.numpy()
    # all at rest: every path is the least one
    assert paths.min() == paths.max()
    setup, margin = solver.worlds[0], 2.0 * float(paths[0])
    grains, shape = setup.grains, setup.shapes[0]
    centers = placed_centers(shape, grains.positions, grains.orientations, grains.sizes)
    radii, grain = np.tile(shape.radii, grains.count), np.repeat(np.arange(grains.count), 9)
    among = count_contacts(centers, radii + margin / 2, grain, [])
    on_walls = count_contacts(centers, radii + margin / 2, grain, [wall for wall, _ in setup.walls])
    # on a CPU, each pair in one list
    listed = (among.grain_pairs + on_walls.wall_pairs) / grains.count
    # a pair at the very edge may fall to either side in fixed point
    assert step_traffic(solver).list_length == pytest.approx(listed, abs=2 / grains.count)


# ---- another code ------------------------------------------------------------------------------------------

FAKE = '''\
#!{python}
"""Places the grains of the input by itself and says that its runs took 0.5 s, 0.6 s, ..."""
import re, sys
import numpy as np
text = open("column.in").read()
clump = np.loadtxt("clump.txt")
number = r"([-+.\\de]+)"
boxes = re.findall(r"region at\\d+ block " + " ".join([number] * 6), text)
turns = re.findall(r"orientation constant " + " ".join([number] * 4), text)
rows = []
for box, turn in zip(boxes, turns, strict=True):
    low, high = np.array(box, dtype=float).reshape(3, 2).T
    w, x, y, z = map(float, turn)
    matrix = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])
    rows += [(*((low + high) / 2 + matrix @ sphere[:3]), sphere[3]) for sphere in clump]
for name in ("start", "end"):
    with open(name + ".txt", "w") as file:
        print("ITEM: ATOMS id x y z radius", file=file)
        for i, row in enumerate(rows):
            print(i + 1, *map(repr, map(float, row)), file=file)
with open("column.log", "w") as log:
    print("LIGGGHTS (Version LIGGGHTS-PUBLIC 3.8.0, compiled)", file=log)
    for i, steps in enumerate(re.findall(r"^run (\\d+)", text, re.MULTILINE)):
        print(f"    Step energy\\n  {{i}}  1.5e-9", file=log)
        print(f"Loop time of {{0.5 + 0.1 * i}} on 1 procs for {{steps}} steps", file=log)
        print(f"Neighbor list builds = {{i}}", file=log)
'''


@pytest.fixture
def column(small_columns: Columns) -> Moment:
    return small_columns.moments("settled", 1)[0]


def test_liggghts_gets_the_column_and_its_times_are_read(
    small_columns: Columns, column: Moment, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = tmp_path / "liggghts"
    program.write_text(FAKE.format(python=sys.executable))
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setattr(liggghts, "PROGRAM", str(program))
    done = liggghts.run(tmp_path / "run", small_columns.cases[0], column, [1e-4, 2e-4], 700, 300, 2)
    # the regions are SPOT wide, and numbers are written with fifteen digits
    assert done.placement_error < liggghts.SPOT
    assert done.contacts == world_contacts(start([column], DEVICE), 0)
    assert done.version == "LIGGGHTS-PUBLIC 3.8.0"
    assert done.kinetic_energy == 1.5e-9
    # runs 0 to 2 are the insertion, its dump and the running in
    assert done.timings[1e-4].seconds == pytest.approx((0.8, 0.9))
    assert done.timings[2e-4].seconds == pytest.approx((1.0, 1.1))
    assert done.timings[2e-4].steps == 300
    assert done.timings[2e-4].rebuilds == pytest.approx((5 + 6) / 600)
    assert done.timings[2e-4].free_spheres == 9 * SMALL.grain_count


def test_liggghts_gets_the_materials_of_the_case(
    small_columns: Columns, column: Moment, tmp_path: Path
) -> None:
    case = small_columns.cases[0]
    liggghts.write_input(tmp_path, case, column, [1e-4], 700, 300, 2)
    text = (tmp_path / "column.in").read_text()
    modulus = 2.0 * 34.325e6 / 400.0 * 1.29  # E = 2 G (1 + v), softened
    found = {
        name: [float(word) for word in text.split(f"global {name} ")[1].splitlines()[0].split()[1:]]
        for name in ("youngsModulus", "poissonsRatio", "coefficientRestitution", "coefficientFriction")
    }
    assert found["youngsModulus"] == pytest.approx([modulus, 2.0 * 70e9 * 1.3])
    assert found["poissonsRatio"] == [0.29, 0.30]
    assert found["coefficientRestitution"] == [2, 0.18, 0.5, 0.5, 0.5]
    assert found["coefficientFriction"] == [2, 0.46, 0.38, 0.38, 0.38]
    mass = float(text.split(" mass ")[1].split()[0])
    assert mass == pytest.approx(698.0 * column.setup.shapes[0].volume)


def test_a_peer_that_cannot_run_is_refused(
    small_columns: Columns, column: Moment, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = small_columns.cases[0]
    grains = replace(column.setup.grains, sizes=np.linspace(0.9, 1.0, column.setup.grains.count))
    mixed = replace(column, setup=replace(column.setup, grains=grains))
    with pytest.raises(ValueError, match="peer: grains must be of one size, got 60 sizes from"):
        liggghts.write_input(tmp_path, case, mixed, [1e-4], 1, 1, 1)
    monkeypatch.setattr(liggghts, "PROGRAM", str(tmp_path / "nowhere"))
    with pytest.raises(ValueError, match="nowhere must be installed"):
        liggghts.run(tmp_path, case, column, [1e-4], 1, 1, 1)


# ---- beds, tables, record ----------------------------------------------------------------------------------


def test_a_bed_starts_apart_inside_its_tube() -> None:
    setup = bed(200)
    shape, positions = setup.shapes[0], setup.grains.positions
    gaps = np.linalg.norm(positions[:, None] - positions[None], axis=2) + np.eye(200)
    assert gaps.min() >= 2.0 * shape.bounding_radius * (1.0 - 1e-12)  # rounding
    tube = setup.walls[1][0]
    assert isinstance(tube, Cylinder)
    assert np.linalg.norm(positions[:, :2], axis=1).max() + shape.bounding_radius <= tube.radius
    assert positions[:, 2].min() >= shape.bounding_radius


def test_counts_are_read_from_a_list() -> None:
    assert parse_counts("1, 12,31") == [1, 12, 31]
    for wrong in ("", "0", "1,,2", "-1", "two"):
        with pytest.raises(ValueError, match="must be positive integers separated by commas, got"):
            parse_counts(wrong)


def test_a_record_replaces_the_page_of_its_name_alone(tmp_path: Path) -> None:
    folder, record, readme = tmp_path / "out", tmp_path / "record", tmp_path / "README.md"
    folder.mkdir()
    record.mkdir()
    marks = "<!-- begin cost-cpu -->\n{}<!-- end cost-cpu -->\n"
    readme.write_text("before\n" + marks.format("old\n") + "<!-- begin cost-gpu -->\nkept\n")
    (folder / "cost.md").write_text("new\n")
    (folder / "cost.csv").write_text("a\n1\n")
    (folder / "cost.png").write_bytes(b"picture")
    for _ in range(2):  # the second time changes nothing
        record_page(folder, "cost-cpu", readme, record)
        shown = "new\n\n![cost-cpu](record/cost-cpu.png)\n"
        assert readme.read_text() == "before\n" + marks.format(shown) + "<!-- begin cost-gpu -->\nkept\n"
    assert (record / "cost-cpu.csv").read_text() == "a\n1\n"
    with pytest.raises(ValueError, match="must hold the lines '<!-- begin cost-gpu -->'"):
        record_page(folder, "cost-gpu", readme, record)


def test_tables_read_well() -> None:
    table = pd.DataFrame({"phase": ["settled"], "n": [12], "us": [54.4321], "none": [np.nan], "J": [1.2e-9]})
    assert markdown_table(table).splitlines()[2] == "| settled | 12 | 54.43 |  | 1.2e-09 |"
