"""The folder contract: what a program finds, what it answers, and every way to fail."""

import csv
import json
import math
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from commandline import dem_warp
from small_study import ANGLE, TUBE

from dem_warp import SCENES, Case, CaseResult
from dem_warp.clumps import ClumpShape
from experiments.cases.engines.contract import command_program, heap_result, read_heap, write_case
from experiments.cases.engines.engine import NO_ANSWER
from experiments.cases.engines.engines import engine_of
from experiments.cases.engines.program import AnswerError, ProgramEngine
from experiments.cases.engines.surfaces import triangles_of
from experiments.io.errors import InputError
from experiments.studyfile import Study, load_study, write_template
from imaging import heap_angle

HOPPER = '[scene.hopper]\ndiameter = "28 mm"\nfill_depth = "16 mm"\noutlet = "20 mm"\n'
CONES = Path(__file__).with_name("cone_program.py")
Write = Callable[..., Path]


def engine(way: str = "", **limits: float) -> ProgramEngine:
    program = command_program(f"'{sys.executable}' '{CONES}' {way}", Path(), "command")
    return ProgramEngine(program, **limits)


def run_one(study: Study, folder: Path, way: str, seed: int = 1, **limits: float) -> CaseResult:
    [result] = engine(way, **limits)([study.case({}, seed)], checkpoint=folder / "unfinished")
    return result


def seeds_run(folder: Path) -> list[int]:
    return list(map(int, (folder / "runs.txt").read_text().split()))


@pytest.mark.parametrize("test", SCENES)
def test_a_program_is_given_every_test(tmp_path: Path, test: str) -> None:
    case = load_study(write_template("grain", tmp_path, test)).case({}, seed=1)
    write_case(case, tmp_path / "case")
    document = json.loads((tmp_path / "case" / "case.json").read_text())
    assert document["scene"]["kind"] == test
    assert set(document["stop"]) == {"rest_speed", "rest_time"}
    assert len(document["walls"]) == len(list((tmp_path / "case").glob("wall-*.stl"))) > 0


def test_a_case_is_written_in_si_with_its_clump_and_its_walls(write_study: Write, tmp_path: Path) -> None:
    clump = tmp_path / "pair.txt"
    clump.write_text("0 0 0 2\n3 0 0 1\n", encoding="utf-8")
    study = load_study(write_study(('sphere = "2 mm"', 'clump = "pair.txt"')))
    case = study.case({"E": 0.37}, seed=7)
    write_case(case, tmp_path / "case")
    document = json.loads((tmp_path / "case" / "case.json").read_text())
    assert (document["seed"], document["gravity"]) == (7, [0.0, 0.0, -9.81])
    assert document["contact"]["grain-grain"]["static_friction"] == 0.37
    assert document["scene"]["rain_rate"] == case.scene.grains_per_second(case)
    assert (
        document["scene"] | {"kind": "lifted-cylinder", "diameter": 0.028, "height": 0.028}
        == document["scene"]
    )
    assert document["grain"]["material"]["shear_modulus"] == pytest.approx(10e6 / 400)
    [shape], [entry] = case.grains.mixture.shapes, document["grain"]["clumps"]
    assert entry["mass"] == pytest.approx(700 * shape.volume)
    with (tmp_path / "case" / entry["file"]).open() as file:
        rows = [[float(row[name]) for name in "xyzr"] for row in csv.DictReader(file)]
    np.testing.assert_array_equal(rows, np.column_stack([shape.centers, shape.radii]))
    assert [wall["kind"] for wall in document["walls"]] == ["plane", "cylinder"]
    assert all(
        (tmp_path / "case" / wall["file"]).read_text().startswith("solid") for wall in document["walls"]
    )


def test_triangles_of_a_tube_have_its_area(small_study: Study) -> None:
    plate, tube = small_study.case({}, 0).scene.walls(0.0)
    for wall, area in ((plate, 4 * 0.1**2), (tube, 2 * math.pi * tube.radius * tube.length)):
        a, b, c = np.moveaxis(triangles_of(wall, 0.1), 1, 0)
        # The sides of a polygon of 180 are 5e-5 shorter than the circle.
        assert 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() == pytest.approx(area, rel=1e-4)


def test_a_heap_comes_back_as_the_spheres_that_were_written(tmp_path: Path) -> None:
    rows = np.random.default_rng(1).uniform(0.001, 0.01, (5, 4))
    text = "\n".join(" ".join(map(repr, row)) for row in rows.tolist())
    (tmp_path / "heap.csv").write_text(f"x y z r\n{text}\n")
    spheres, grains = read_heap(tmp_path / "heap.csv")
    result = heap_result(spheres, grains, {}, {})
    np.testing.assert_array_equal(grains, range(5))
    np.testing.assert_allclose(result.sphere_centers, rows[:, :3], rtol=0, atol=1e-18)
    np.testing.assert_array_equal(result.sphere_radii, rows[:, 3])


def test_spheres_of_a_grain_belong_together(tmp_path: Path) -> None:
    text = "grain,x,y,z,r\n7,0,0,0,1\n3,5,0,0,2\n7,2,0,0,1\n"
    (tmp_path / "heap.csv").write_text(text)
    result = heap_result(*read_heap(tmp_path / "heap.csv"), {}, {})
    np.testing.assert_array_equal(result.sphere_centers, [[5, 0, 0], [0, 0, 0], [2, 0, 0]])
    np.testing.assert_array_equal(result.sphere_radii, [2, 1, 1])
    np.testing.assert_array_equal(result.sphere_grain, [0, 1, 1])


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("", "heap.csv: is empty"),
        ("x,y,z,r\n", "has no spheres"),
        ("x,y,z\n1,2,3\n", "not a file of spheres"),
        ("x,y,z,r\n1,2,3\n", "line 2: a sphere must be x y z r"),
        ("x,y,z,r\n1,2,3,0.1\n1,2,3,-1\n", "line 3: a sphere must be x y z r: four finite numbers, r > 0"),
        ("x,y,z,r\n1,2,inf,0.1\n", "line 2: a sphere must be x y z r"),
    ],
)
def test_a_malformed_heap_is_named_by_its_line(tmp_path: Path, text: str, rule: str) -> None:
    (tmp_path / "heap.csv").write_text(text)
    with pytest.raises(AnswerError, match=rule):
        read_heap(tmp_path / "heap.csv")


def test_several_cases_run_at_once_and_come_back_in_order(small_study: Study, tmp_path: Path) -> None:
    cases = [small_study.case({"E": friction}, seed=2) for friction in (0.2, 0.4, 0.6)]
    seen: list[int] = []
    results = engine(workers=2)(
        cases, on_result=lambda index, _: seen.append(index), checkpoint=tmp_path / "unfinished"
    )
    angles = [heap_angle(r.sphere_centers, r.sphere_radii, azimuths=2, pixels=300).mean for r in results]
    assert sorted(seen) == [0, 1, 2]
    noise = 0.3 * math.sin(12.9898 * 2)
    # A cone laid out on half a millimetre: a degree.
    assert angles == pytest.approx([21.0 + noise, 27.0 + noise, 33.0 + noise], abs=1.0)
    assert results[0].provenance["program"] == "cones 1.0"
    assert results[0].provenance["laws"] == small_study.case({}, 1).laws.to_dict()


@pytest.mark.parametrize(
    ("way", "status", "reason"),
    [
        ("crash", NO_ANSWER, "the exit code 1; its last line: no license was found"),
        ("silent", NO_ANSWER, "the program wrote no result.json"),
        ("nan", NO_ANSWER, "heap.csv, line 2: a sphere must be x y z r"),
        ("status", NO_ANSWER, "status must be one of finished, failed, diverged, overflow, got 'fine'"),
        ("observable", NO_ANSWER, "result.json: observables.grain_cuont: must be one of"),
        ("infinite", NO_ANSWER, "result.json: observables.grain_count: must be a finite number, got inf"),
        ("huge", NO_ANSWER, "result.json: observables.grain_count: must be a finite number, got 1000"),
        ("deep", NO_ANSWER, "result.json: must be JSON: maximum recursion depth"),
        ("diverged", "diverged", "a grain was too fast"),
    ],
)
def test_a_failure_is_a_status_with_its_reason(
    small_study: Study, tmp_path: Path, way: str, status: str, reason: str
) -> None:
    result = run_one(small_study, tmp_path, way)
    assert result.status == status
    assert reason in result.reason
    assert len(result.sphere_radii) == 0
    kept = list(tmp_path.glob("failed/*/case.json"))
    assert len(kept) == (1 if status == NO_ANSWER else 0), "whoever looks for the cause finds the folder"


def test_a_program_is_ended_at_its_time_limit(small_study: Study, tmp_path: Path) -> None:
    started = time.monotonic()
    result = run_one(small_study, tmp_path, "sleep", time_limit=1.0)
    assert (result.status, "its time limit of 1 s" in result.reason) == (NO_ANSWER, True)
    assert time.monotonic() - started < 300.0, "the program sleeps for ten minutes"


def test_a_finished_case_is_not_run_twice_and_a_failed_one_is(small_study: Study, tmp_path: Path) -> None:
    cases, folder = [small_study.case({}, seed) for seed in (1, 2, 3)], tmp_path / "unfinished"
    first = engine("crash-odd")(cases, checkpoint=folder)
    assert [result.status for result in first] == [NO_ANSWER, "finished", NO_ANSWER]
    assert sorted(seeds_run(tmp_path)) == [1, 2, 3]
    again = engine("crash-odd")(cases, checkpoint=folder)
    assert sorted(seeds_run(tmp_path)[3:]) == [1, 3]
    np.testing.assert_array_equal(first[1].positions, again[1].positions)


def test_an_interrupt_ends_the_programs_and_loses_no_finished_case(
    small_study: Study, tmp_path: Path
) -> None:
    cases, folder = [small_study.case({}, seed) for seed in (2, 1)], tmp_path / "unfinished"

    def interrupt(index: int, result: CaseResult) -> None:
        raise KeyboardInterrupt

    before = set(threading.enumerate())  # those of other tests may end at any time
    with pytest.raises(KeyboardInterrupt):
        engine("sleep-odd", workers=2)(cases, on_result=interrupt, checkpoint=folder)
    assert set(threading.enumerate()) <= before
    assert sorted(seeds_run(tmp_path)) in ([1, 2], [2])
    run = engine("sleep-odd", workers=1, time_limit=1.0)(cases, checkpoint=folder)
    assert [result.status for result in run] == ["finished", NO_ANSWER]
    assert seeds_run(tmp_path).count(2) == 1


@pytest.mark.parametrize(
    ("section", "rule", "place"),
    [
        ('command = "no-such-solver --case x"', "must begin with a program on the PATH", "engine.command"),
        ('command = "\'open"', "must close every quotation mark", "engine.command"),
        ('command = " "', "must name a program", "engine.command"),
        ('name = "rocky"', "must be one of", "engine.name"),
        ('name = "liggghts"\ncommand = "x"', "must have a name, a command or by", "engine"),
        ("workers = 2", "must have a name, a command or by", "engine"),
        ('command = "python3"\nworkers = 0', "must be greater than or equal to 1", "engine.workers"),
        ('command = "python3"\ntime_limit = "0 s"', "must be greater than 0", "engine.time_limit"),
        ('command = "python3"\nobservables = ["angle"]', "the heap shows the others", "engine.observables"),
        ('name = "liggghts"\nversion = "2"', "settings of a command", "engine"),
    ],
)
def test_a_wrong_engine_is_refused_with_rule_and_place(
    write_study: Write, section: str, rule: str, place: str
) -> None:
    with pytest.raises(InputError) as caught:
        engine_of(load_study(write_study(add=f"\n[engine]\n{section}\n")))
    assert rule in str(caught.value)
    assert place in caught.value.place


def test_a_test_that_leaves_no_heap_needs_its_own_observables_and_no_heap_file(
    write_study: Write, tmp_path: Path
) -> None:
    command = f"command = \"'{sys.executable}' '{CONES}' no-heap\"\nobservables = [\"flow_rate\"]"
    path = write_study((TUBE, HOPPER), (ANGLE, ""), add=f"\n[engine]\n{command}\n")
    assert engine_of(load_study(path)).observables == ("flow_rate",)
    # the whole way: simulated, measured and written
    code, out, err = dem_warp("heap", path, "--out", tmp_path / "out", "--json")
    assert (code, json.loads(out)["observables"]) == (0, {"flow_rate": 0.0125}), err
    # a lifted cylinder leaves a heap, which the angle is measured on
    answer = run_one(load_study(write_study()), tmp_path, "no-heap")
    assert answer.status == NO_ANSWER
    assert "wrote no heap.csv" in answer.reason


def test_a_command_finds_files_next_to_the_study_and_is_read_by_no_shell(
    write_study: Write, tmp_path: Path
) -> None:
    (tmp_path / "solver.py").write_text("pass")
    command = f"{Path(sys.executable).as_posix()} solver.py '$HOME; rm x' *"
    study = load_study(write_study(add=f'\n[engine]\ncommand = "{command}"\n'))
    found = engine_of(study)
    assert isinstance(found, ProgramEngine)
    assert found.program.words[1:] == (str(tmp_path / "solver.py"), "$HOME; rm x", "*")


def test_another_script_or_version_makes_other_cases(write_study: Write, tmp_path: Path) -> None:
    from experiments.cases import Store

    script = tmp_path / "solver.py"
    keys = set()
    for text, more in (("a", ""), ("b", ""), ("b", 'version = "2"'), ("b", 'version = "2"\nworkers = 3')):
        script.write_text(text)
        section = f'\n[engine]\ncommand = "{Path(sys.executable).as_posix()} solver.py"\n{more}\n'
        study = load_study(write_study(add=section))
        keys.add(Store(tmp_path / "cases", engine_of(study)).key(study.case({}, 1)))
    assert len(keys) == 3, "the number of workers changes no result"


def test_a_case_of_a_mixture_names_every_clump(write_study: Write, tmp_path: Path) -> None:
    parts = '[grain.shapes.a]\nsphere = "2 mm"\n[grain.shapes.b]\nsphere = "1 mm"\nfraction = 0.25\n'
    study = load_study(write_study(('sphere = "2 mm"\n', ""), add=f"\n{parts}"))
    case: Case = study.case({}, 1)
    write_case(case, tmp_path / "case")
    document = json.loads((tmp_path / "case" / "case.json").read_text())["grain"]["clumps"]
    assert [(entry["file"], entry["fraction"]) for entry in document] == [
        ("clump-1.csv", 0.75),
        ("clump-2.csv", 0.25),
    ]
    assert all(isinstance(shape, ClumpShape) for shape in case.grains.mixture.shapes)
