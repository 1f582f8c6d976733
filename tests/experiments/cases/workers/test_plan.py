"""Plans and times told before anything runs: ``--dry-run``, the time left, and ``dem-warp doctor``."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import warp as wp
from commandline import dem_warp

from dem_warp import Case, Progress
from experiments import api
from experiments.cases import OwnWorkers
from experiments.cases.forecast.cost import EMPTY, Cost, cost_of
from experiments.cases.workers.speed import (
    OF_STUDIES,
    SPEEDS,
    TYPICAL,
    Speed,
    measure_speed,
    scaled_speed,
    split_costs,
    store_speed,
    stored_speed,
    user_folder,
    wave_seconds,
)
from experiments.cases.workers.wave import WaveProgress
from experiments.commands.console import describe_progress
from imaging import save_picture

Write = Callable[..., Path]

SPEED = Speed(step=1.0e-4, sphere_step=1.0e-6, start=2.0, on="2026-01-02, 2 workers")

TRIAL = Path(api.__file__).parent / "studies" / "trial" / "study.toml"


@pytest.fixture(autouse=True)
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A user's folder of the test's own, with the speed of this machine in it."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    for workers in (1, 2):
        store_speed(OwnWorkers("cpu", workers).machine, SPEED)


# ---- speed -------------------------------------------------------------------------------------------------


def test_a_wave_takes_what_its_workers_share_and_no_less_than_its_longest_case() -> None:
    small, large = Cost(10, 100, 1000.0), Cost(10, 900, 10000.0)
    one = 1000.0 * 2.0e-4
    assert wave_seconds([small] * 8, SPEED, 2, on_gpu=False) == pytest.approx(2.0 + 4 * one)
    assert wave_seconds([small, large], SPEED, 2, on_gpu=False) == pytest.approx(2.0 + 10000.0 * 1.0e-3)
    assert wave_seconds([], SPEED, 1, on_gpu=True) == 0.0


GPU = Speed(3.0e-5, 1.0e-10, 0.5, grain_step=1.5e-9, mesh=2.0, world_step=2.5e-7, world_start=1.0e-3)


def launched(grains: int, worlds: int = 1, **about: Any) -> float:
    """Time of a step of a wave of balls on one GPU, beyond the looks of the host [s]."""
    wave = [Cost(grains, grains, 1000.0, **about)] * worlds
    begun = GPU.start + worlds * GPU.world_start
    return (wave_seconds(wave, GPU, 1, on_gpu=True) - begun) / 1000.0 - worlds * GPU.world_step


def test_a_launch_that_fills_no_gpu_takes_its_kernels_time_whatever_its_grains() -> None:
    assert launched(10) == pytest.approx(GPU.step, rel=1e-5)
    # a few grains hide behind the kernels, even those that meshes or a law make dearer
    for more in (launched(2_000), launched(1_000, meshed=True), launched(1_000, law=2.0)):
        assert GPU.step < more < 1.01 * GPU.step


def test_a_full_gpu_takes_twice_as_long_for_twice_as_many_grains_or_dearer_ones() -> None:
    full = launched(1_000, worlds=300)
    for twice in (launched(1_000, 600), launched(1_000, 300, meshed=True), launched(1_000, 300, law=2.0)):
        assert twice == pytest.approx(2.0 * full, rel=0.01)
    # it makes no difference to the device which worlds grains are in, and grains that are gone cost less
    assert launched(3_000, worlds=100) == pytest.approx(full)
    assert launched(1_000, worlds=300, present=0.0) < 0.25 * full


def test_every_world_of_a_launch_takes_the_host_its_time() -> None:
    wave = [Cost(1, 1, 1000.0)]
    alone, many = (wave_seconds(wave * worlds, GPU, 1, on_gpu=True) for worlds in (1, 1001))
    assert many - alone == pytest.approx(1000.0 * (1000 * GPU.world_step + GPU.world_start), rel=0.01)
    dear = [Cost(1, 1, 1000.0, tended=3.0)] * 1001
    more = wave_seconds(dear, GPU, 1, on_gpu=True) - many
    assert more == pytest.approx(1000.0 * 1001 * 2.0 * GPU.world_step, rel=1e-6)
    # two GPUs have half of the worlds each, and more than a launch holds come one launch after another
    two = wave_seconds(wave * 2000, GPU, 2, on_gpu=True)
    assert two == pytest.approx(wave_seconds(wave * 1000, GPU, 1, on_gpu=True))
    rounds = wave_seconds(wave * 2000, GPU, 1, on_gpu=True)
    assert rounds - GPU.start == pytest.approx(2.0 * (two - GPU.start))


def test_launches_that_share_a_gpu_hide_the_hosts_time_but_not_one_anothers_kernels() -> None:
    def step(cost: Cost, worlds: int, sharing: int) -> float:
        """Time of a step of the worlds, in as many launches as share the GPU [s]."""
        wave = [cost] * worlds
        seconds = wave_seconds(wave, GPU, sharing, on_gpu=True, sharing=sharing) - GPU.start
        return (seconds - worlds / sharing * GPU.world_start) / cost.steps

    # the host takes most of the time: two of them take half
    looked_after = Cost(1, 1, 1000.0)
    alone, shared = (step(looked_after, 1024, sharing) for sharing in (1, 2))
    assert shared - GPU.step == pytest.approx(0.5 * (alone - GPU.step), rel=0.01)
    # the device does: a launch waits for the other's kernels, which together take as long
    full = Cost(3_000, 3_000, 1000.0)
    assert step(full, 100, 2) == pytest.approx(step(full, 100, 1) - 100 * GPU.world_step, rel=0.02)


def gpu_as_typical(host: float = 1.0, grains: float = 1.0, mesh: float = 1.0) -> Speed:
    """Speed of a GPU that takes so many times what a typical one does."""
    typical = TYPICAL[True]
    hosted = {name: host * getattr(typical, name) for name in ("step", "start", "world_step", "world_start")}
    by_grains = {name: grains * getattr(typical, name) for name in ("grain_step", "sphere_step")}
    return replace(typical, **hosted, **by_grains, mesh=mesh * typical.mesh)


@pytest.mark.parametrize("factors", [(1.0, 1.0, 1.0), (0.5, 2.0, 1.0), (2.0, 2.0, 1.5)])
def test_the_measurement_finds_the_factors_of_gpus_that_keep_to_them(factors: tuple[float, ...]) -> None:
    made, now = gpu_as_typical(*factors), [0.0]

    def simulate(cases: Sequence[Case[Any]]) -> list[Any]:
        """Take a third more steps than are told."""
        assert len({case.seed for case in cases}) == len(cases)
        told = cost_of(cases[0])
        costs = [replace(told, steps=4.0 / 3.0 * told.steps)] * len(cases)
        # the reference takes less than studies
        now[0] += wave_seconds(costs, made, 2, on_gpu=True) / OF_STUDIES
        return [SimpleNamespace(phases=[{"steps": cost.steps}]) for cost in costs]

    workers: Any = SimpleNamespace(count=2, on_gpu=True, sharing=1, simulate=simulate)
    found = asdict(measure_speed(workers, lambda: now[0]))
    assert str(found.pop("on")).endswith(", 2 workers")
    # the pull towards 1 takes up to a tenth of such factors, and nothing where all are 1
    near = 0.1 if max(factors) > 1.0 else 1e-6
    assert found == {
        name: pytest.approx(value, rel=near) for name, value in asdict(made).items() if name != "on"
    }


def test_a_factor_that_no_wave_tells_of_stays_one() -> None:
    few, many = Cost(1, 1, 10000.0), Cost(2_000, 2_000, 10000.0)
    slow, typical = gpu_as_typical(host=2.0, grains=2.0), TYPICAL[True]

    def told(*waves: list[Cost]) -> Speed:
        return scaled_speed([(wave, wave_seconds(wave, slow, 1, on_gpu=True)) for wave in waves])

    by_host = told([few], [few] * 32)
    assert by_host.step == pytest.approx(slow.step, rel=0.03)  # the pull takes 2 % where two waves tell
    assert by_host.grain_step == pytest.approx(typical.grain_step, rel=1e-3)
    assert by_host.mesh == pytest.approx(typical.mesh, rel=1e-6)
    with_grains = told([few], [many] * 128)
    assert with_grains.grain_step == pytest.approx(slow.grain_step, rel=0.05)
    assert with_grains.mesh == pytest.approx(typical.mesh, rel=1e-6)
    # meshes make no wall cheaper, whatever noise there is
    meshed = [replace(many, meshed=True)] * 128
    at_once = (meshed, 0.1 * wave_seconds(meshed, typical, 1, on_gpu=True))
    plain = ([many] * 128, wave_seconds([many] * 128, typical, 1, on_gpu=True))
    assert scaled_speed([plain, at_once]).mesh == 1.0


def test_the_cost_of_a_step_is_split_into_what_it_was_made_of() -> None:
    made = (4.0e-6, 1.8e-7, 4.4e-7)
    for copies in (1, 1024):
        sizes = [(30.0, 0.0), (copies * 250.0, copies * 17.7), (copies * 100.0, copies * 64.1)]
        taken = [made[0] + grains * made[1] + looked * made[2] for grains, looked in sizes]
        assert split_costs(sizes, taken) == pytest.approx(made)
        # noise makes no cost negative
        assert min(split_costs(sizes, [taken[0], 0.5 * taken[0], 0.1 * taken[0]])) >= 0.0


def test_a_step_costs_its_grains_and_neighbours_and_more_under_some_laws_and_beside_meshes() -> None:
    speed = Speed(4.0e-6, 0.0, 2.0, grain_step=1.8e-7, look_step=4.4e-7, mesh=1.6)
    case = Cost(250, 2250, 10.0, present=0.8, looked=30.0)
    grains = (200 + 50 * EMPTY) * 1.8e-7 + 30.0 * 4.4e-7
    assert speed.seconds(case) == pytest.approx(10.0 * (4.0e-6 + grains))
    dear = replace(case, law=1.5, meshed=True)
    assert speed.seconds(dear) == pytest.approx(10.0 * (4.0e-6 + 1.5 * 1.6 * grains))


def test_speeds_are_stored_for_each_machine_and_a_damaged_file_is_none() -> None:
    store_speed("another", SPEED)
    assert stored_speed("another") == SPEED
    assert stored_speed("never seen") is None
    # one that was measured before meshes were is measured anew
    (user_folder() / "speeds.json").write_text(
        '{"old": {"step": 1.0, "sphere_step": 1.0, "start": 1.0}}', encoding="utf-8"
    )
    assert stored_speed("old") is None
    # and so is a GPU whose times were measured one by one; a core's are as before
    core = asdict(Speed(4.0e-6, 0.0, 2.0, grain_step=1.8e-7, look_step=4.4e-7, mesh=1.6))
    (user_folder() / "speeds.json").write_text(
        json.dumps({"core": core, "GPU": asdict(GPU)}), encoding="utf-8"
    )
    assert stored_speed("core") == Speed(**core)
    assert stored_speed("GPU") is None
    store_speed("GPU", GPU)
    assert (stored_speed("GPU"), stored_speed("core")) == (GPU, Speed(**core))
    (user_folder() / "speeds.json").write_text('{"GPU": "fast"}', encoding="utf-8")
    assert stored_speed("GPU") is None
    (user_folder() / "speeds.json").write_text('{"another": {"step": 1}', encoding="utf-8")
    assert stored_speed("another") is None


def test_the_time_left_is_told_before_the_first_case_has_ended() -> None:
    begun = WaveProgress(0, 10, 0.0, {"waiting": 10}, 4.0, expected=100.0)
    assert describe_progress(begun).startswith("1 min 36 s left")
    # What was expected has passed, and nothing shows yet.
    late = WaveProgress(0, 10, 0.0, {"fill": 2}, 200.0, expected=100.0)
    assert describe_progress(late).startswith("10 s left")
    # Once well begun, the speed so far counts alone.
    half = WaveProgress(5, 10, 0.5, {"lift": 2}, 300.0, expected=100.0)
    assert describe_progress(half).startswith("5 min 0 s left")
    assert "left" not in describe_progress(Progress(0, 10, 0.0, {}, 4.0))


# ---- plans -------------------------------------------------------------------------------------------------


def planned(*words: object) -> dict:
    code, out, err = dem_warp(*words, "--device", "cpu", "--workers", 2, "--dry-run", "--json")
    assert code == 0, err
    return json.loads(out)


def test_a_calibration_is_planned_and_nothing_is_written(write_study: Write, tmp_path: Path) -> None:
    study, out = write_study(), tmp_path / "out"
    plan = planned("calibrate", study, "--out", out)
    assert not out.exists()
    waves = {wave["name"]: wave for wave in plan["waves"]}
    # Five replicates and eight runs of the screening; six steps twice, once or twice over; a line of two
    # points with five at its centre; five fresh cases.
    assert waves["target, noise floor, screening"]["cases"] == 5 + 8
    assert (waves["climb"]["cases"], waves["climb"]["most"]) == (12, 24)
    assert waves["verification"]["cases"] == 5
    assert waves["climb"]["grains"] == waves["climb"]["spheres"] == 30
    assert plan["cases"] == sum(wave["cases"] for wave in plan["waves"])
    seconds = SPEED.start + 12 / 2 * waves["climb"]["steps"] * (SPEED.step + 30 * SPEED.sphere_step)
    assert waves["climb"]["seconds"] == pytest.approx(seconds, rel=0.01)
    assert plan["memory"] > 1e8
    assert plan["disk"] > 0


def test_published_runs_are_planned_before_the_campaign_or_alone() -> None:
    runs = {
        "screening": 12,
        "climb": 6,
        "composite": 13,
        "verification": 3,
    }  # Tables 3, 5 and 6, and the heaps beside
    words = ("calibrate", "--scale", "bench", "--paper-replicates", 2)
    alone = planned(*words, "--only-paper")
    both = planned(*words, "--follow-paper")
    cases = {wave["name"]: wave["cases"] for wave in alone["waves"]}
    assert cases == {f"paper, {stage}": 2 * count for stage, count in runs.items()}
    assert both["cases"] == alone["cases"] + planned("calibrate", "--scale", "bench")["cases"]
    assert both["seconds"] > alone["seconds"] > 0


def test_a_plan_reads_well(write_study: Write, tmp_path: Path) -> None:
    code, out, _ = dem_warp("calibrate", write_study(), "--device", "cpu", "--workers", 2, "--dry-run")
    assert code == 0
    assert "verification" in out
    assert "Nothing was run, nothing was written." in out
    assert "Speed measured on 2026-01-02, 2 workers" in " ".join(out.split())
    assert "Not counted: compiling kernels for a grain or law that is new here" in out


def test_a_plan_that_measures_the_speed_says_where_it_stored_it(
    write_study: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (user_folder() / SPEEDS).unlink()
    monkeypatch.setattr("experiments.runs.plan.measure_speed", lambda _: SPEED)
    words = ("calibrate", write_study(), "--device", "cpu", "--out", tmp_path / "out", "--dry-run")
    code, out, _ = dem_warp(*words)
    told = f"It was stored in {user_folder() / SPEEDS}; no case was run, and no folder of results touched."
    assert code == 0
    assert "".join(told.split()) in "".join(out.split())
    assert "nothing was written" not in out
    assert not (tmp_path / "out").exists()
    assert "Nothing was run, nothing was written." in dem_warp(*words)[1]


def test_cases_that_cannot_begin_have_no_plan(write_study: Write) -> None:
    study = write_study(("grain_count = 30", 'grain_count = 30\nrain_rate = "1e12 1/s"'))
    code, _, err = dem_warp("calibrate", study, "--device", "cpu", "--workers", 2, "--dry-run")
    assert (code, "the rain finds no free place" in err) == (2, True), err


def test_a_search_is_planned(tmp_path: Path) -> None:
    plan = planned("discover", TRIAL, "--scale", "bench", TRIAL.with_name("tilted-bench.csv"))
    assert [wave["name"] for wave in plan["waves"]] == ["fresh runs"], "the bank ships with the study"
    assert 0 < plan["cases"] < plan["most"]


def test_the_plan_of_a_search_reads_the_data(tmp_path: Path) -> None:
    heaps = Path(__file__).parents[2] / "discover" / "data" / "nothing-missing.csv"
    plan = planned("discover", TRIAL, "--scale", "bench", heaps)
    assert (plan["cases"], plan["most"]) == (0, 0), "heaps without a gap ask for no fresh run"
    wrong = tmp_path / "measured.csv"
    wrong.write_text("condition,replicate,observable,value\nnone,1,height,0.01\n", encoding="utf-8")
    for file, said in ((wrong, "measured.csv:2: condition"), (tmp_path / "absent.csv", "absent.csv")):
        words = ["discover", TRIAL, "--scale", "bench", file, "--device", "cpu", "--dry-run"]
        code, out, err = dem_warp(*words)
        assert (code, out) == (2, "")
        assert said in err


def test_plans_tell_what_was_set_aside(
    write_study: Write, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    save_picture(tmp_path / "wall.png", np.full((300, 500), 200, np.uint8))
    rows = "condition,replicate,observable,value,unit,picture\nbase,1,angle,25,deg,\nbase,2,angle,26,deg,\n"
    rows += "base,1,height,40,m,\nbase,2,flank_angle,,,wall.png\n"
    (tmp_path / "measured.csv").write_text(rows, encoding="utf-8")
    target = ('mean = "30 deg"\nsd = "0.5 deg"\nn = 5\n', 'file = "measured.csv"\n')
    planned("calibrate", write_study(target, add="[condition.base]\n"))
    calibration, _ = caplog.text, caplog.clear()
    planned("discover", TRIAL, "--scale", "bench", tmp_path / "measured.csv")
    for said in (calibration, caplog.text):
        assert "row 4: height must be between" in said
        assert "row 5: the picture cannot be measured" in said


def test_a_heap_is_planned_with_its_settings(write_study: Write) -> None:
    plan = planned_heap(write_study())
    assert plan["cases"] == plan["most"] == 1


def planned_heap(study: Path) -> dict:
    code, out, err = dem_warp("heap", study, "--set", "E=0.3", "--device", "cpu", "--dry-run", "--json")
    assert code == 0, err
    return json.loads(out)


def test_jobs_are_not_submitted_for_a_plan(write_study: Write, tmp_path: Path) -> None:
    profile = tmp_path / "cluster.toml"
    profile.write_text('[cluster]\nkind = "slurm"\nworkers = 4\nqueue = "main"\n', encoding="utf-8")
    words = ("calibrate", write_study(), "--cluster", profile, "--dry-run")
    code, _, err = dem_warp(*words)
    assert code == 2
    assert "dem-warp doctor --measure" in " ".join(err.split())
    store_speed("slurm, queue main, CPU", SPEED)
    code, out, _ = dem_warp(*words)
    assert code == 0
    assert "4 workers of slurm" in out


# ---- doctor ------------------------------------------------------------------------------------------------


def test_the_doctor_tells_what_there_is() -> None:
    code, out, err = dem_warp("doctor", "--device", "cpu", "--workers", 2, "--json")
    assert code == 0, err
    found = {finding["name"]: finding for finding in json.loads(out)}
    for name in ("versions", "cores", "memory", "kernels' cache", "simulation", "OpenGL", "clusters"):
        assert name in found
    assert found["simulation"]["good"]
    assert found["will be used"]["text"].startswith("cpu, 2 at once")
    assert "100 us a step" in found["speed"]["text"]


def test_the_doctors_exit_code_tells_that_nothing_can_be_simulated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("in the way", encoding="utf-8")
    monkeypatch.setattr(wp.config, "kernel_cache_dir", str(tmp_path / "file" / "cache"))
    code, out, _ = dem_warp("doctor", "--device", "cpu")
    assert code == 1
    assert "FAIL kernels' cache" in out


def test_a_device_that_is_not_there_ends_with_2() -> None:
    code, _, err = dem_warp("doctor", "--device", "cuda:7")
    assert code == 2
    assert "--device" in err
