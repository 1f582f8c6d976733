"""The benchmarks' instruments: scene, counts, record. Speeds are not tested."""

from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import warp as wp

from dem_warp.batch import Batch
from dem_warp.rollback import Rollback
from dem_warp.solver import CHUNK, Solver
from dem_warp.walls import Cylinder, Disc, Plane
from experiments.cases.workers.batches import device_bytes
from experiments.evidence.performance import columns as scene
from experiments.evidence.performance.columns import Columns, reference_case
from experiments.evidence.performance.contact_counts import count_contacts, placed_centers
from experiments.evidence.performance.heap_throughput import speed_tables
from experiments.evidence.performance.performance_record import record_page
from experiments.evidence.performance.result_pages import parse_counts
from experiments.evidence.performance.roofline import step_traffic
from experiments.evidence.performance.timing import run_in, start, time_steps
from experiments.evidence.record_page import markdown_table
from experiments.studyfile import load_study

DEVICE = "cpu"


@pytest.mark.parametrize("scale", ["bench", "soft", "printed"])
def test_columns_hold_the_study_s_centre_point_in_one_size(scale: str) -> None:
    case, ours = load_study(scale=scale).case({}, 3), reference_case(scale, 3)
    assert (ours.scene, ours.numerics, ours.seed) == (case.scene, case.numerics, case.seed)
    assert ours.grains == replace(case.grains, size_sd=0.0)
    for name in ("grain_grain", "grain_wall"):
        # the study takes the middle of a range, which rounds
        assert asdict(getattr(ours, name)) == pytest.approx(asdict(getattr(case, name)), rel=1e-15)


def test_an_unknown_scale_is_refused() -> None:
    with pytest.raises(ValueError, match="scale: must be one of printed, soft, bench, got 'huge'"):
        reference_case("huge")


def test_moments_are_what_their_names_say(small_columns: Columns) -> None:
    tube = small_columns.cases[0].scene
    filling, settled, lifting = (small_columns.moments(phase, 1)[0] for phase in scene.MOMENTS)
    waiting = filling.setup.grains.release_steps > 0
    assert 0 < np.count_nonzero(waiting) < filling.setup.grains.count
    # rain falls at its speed until it is released
    np.testing.assert_allclose(filling.setup.grains.velocities[waiting, 2], -tube.rain_speed, rtol=1e-6)
    assert np.abs(settled.setup.grains.velocities).max() < 10.0 * tube.rest_speed
    # caught at the first look after the moment; a look is due every chunk
    late = CHUNK * lifting.setup.time_step * tube.lift_speed / tube.diameter
    rise = lifting.setup.walls[scene.TUBE][0].point[2] / tube.diameter
    share = scene.MOMENTS["lifting"][0]
    assert share <= rise < share + late
    assert lifting.tube_motion.velocity == (0.0, 0.0, tube.lift_speed)


def test_worlds_take_all_moments_before_they_repeat(small_columns: Columns) -> None:
    waiting = [
        np.count_nonzero(moment.setup.grains.release_steps) for moment in small_columns.moments("filling", 5)
    ]
    assert waiting[:4] == sorted(set(waiting), reverse=True)
    assert waiting[4] == waiting[0]


def test_a_settled_column_goes_on_at_rest(small_columns: Columns) -> None:
    tube = small_columns.cases[0].scene
    solver = start(small_columns.moments("settled", 1), DEVICE)
    run_in(solver)
    timing = time_steps(solver, 256, stretches=1)
    assert timing.rebuilds == 0.0
    assert timing.free_spheres == 9 * tube.grain_count
    assert np.abs(solver.view([0])[0].velocities).max() < tube.rest_speed


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
    solver._prepare_cycle(2, 0)
    paths = solver.neighbours.near.path.numpy()
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


def memory_bytes(solver: Solver) -> int:
    """Bytes of all device arrays of a solver."""
    neighbours = solver.neighbours
    lists = (neighbours, neighbours.near, neighbours.reactions)
    holders = (solver, solver.model, *solver.grains, *lists, solver.cells)
    return sum(
        value.capacity for holder in holders for value in vars(holder).values() if isinstance(value, wp.array)
    )


@pytest.mark.parametrize("precision", ["mixed", "double"])
def test_the_memory_of_a_world_is_predicted(write_study: Callable[..., Path], precision: str) -> None:
    path = write_study(("modulus_scale = 400.0", f'modulus_scale = 400.0\nprecision = "{precision}"'))
    case = load_study(path).case({}, 1)
    batch = Batch([case], "cpu")
    kept = sum(array.capacity for array in Rollback(batch.solver)._kept)
    taken = memory_bytes(batch.solver) + kept
    assert 0.8 < device_bytes(case) / taken < 1.5, (device_bytes(case), taken)
