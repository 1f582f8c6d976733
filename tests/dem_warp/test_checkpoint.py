"""Cases that are interrupted, killed or moved to another batch end in the same bits as others."""

import logging
import os
import re
import shutil
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import worlds
from worlds import DEVICE, SMALL_TUBE, assert_same_bits, assert_same_result, pile, small_case, solve, state

import dem_warp.batch
import dem_warp.checkpoint
import dem_warp.simulation
from dem_warp import Case, CaseResult, simulate
from dem_warp.batch import Batch
from dem_warp.checkpoint import Checkpoints
from dem_warp.device import resolve_device
from dem_warp.scenes.lifted_cylinder import LiftState
from dem_warp.snapshot import put_snapshot, take_snapshot
from dem_warp.solver import CHUNK

NEVER, ALWAYS = 1e9, 0.0
"""Times between two checkpoints [s]: no checkpoint at all, and one after every look of a controller."""

DIVERGING = replace(
    small_case(time_step_fraction=1.0, scene=replace(SMALL_TUBE, grain_count=10)),
    grain_grain=replace(small_case().grain_grain, restitution=1e-6),
    grain_wall=replace(small_case().grain_wall, restitution=1e-6),
)
"""With four times the usual step the explicit damping of almost plastic impacts overshoots."""

CASE = small_case(scene=replace(SMALL_TUBE, grain_count=20))  # fewer grains

ENDLESS = [small_case(seed, replace(SMALL_TUBE, duration=3600.0)) for seed in (1, 2)]
"""Cases whose end no test waits for."""


def start(*cases: Case, folder: Path | None = None, every: float = NEVER) -> Batch:
    """Start a batch that continues from the checkpoints of a folder."""
    kept = Checkpoints(folder, every) if folder else None
    return Batch(cases, resolve_device(DEVICE), kept)


def handful(seed: int) -> Case:
    """Return a case of three to six grains, with a friction and a time step of its own."""
    scene = replace(SMALL_TUBE, grain_count=3 + seed % 4)
    case = small_case(seed, scene, modulus_scale=100.0 + 10.0 * (seed % 5))
    return replace(case, grain_grain=replace(case.grain_grain, static_friction=0.1 + 0.02 * seed))


@pytest.fixture(scope="module")
def alone() -> tuple[CaseResult, dict[str, np.ndarray]]:
    """Return result and final state of the small case by itself and never interrupted."""
    batch = start(CASE)
    return worlds.finish(batch)[0], state(batch.solver)


@pytest.fixture(scope="module")
def left(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Return a folder for each phase in which the small case was left, with its checkpoint."""
    folder = tmp_path_factory.mktemp("running")
    batch, folders = start(CASE, folder=folder), {}
    while "lift" not in folders:
        batch.advance()
        phase = batch.phase(0)
        if phase not in folders:
            batch.save()
            folders[phase] = tmp_path_factory.mktemp(phase)
            shutil.copytree(folder, folders[phase], dirs_exist_ok=True)
    return folders


def the_file(folder: Path) -> Path:
    [path] = folder.iterdir()
    return path


def marked(folder: Path, *cases: Case) -> None:
    """Leave a mark in checkpoints: it comes out in the results of those that are continued."""
    for case in cases:
        batch = start(case)
        kept = Checkpoints(folder)
        state, snapshot = kept.load(case, batch.maker)
        state["observables"]["taken_up"] = 1.0
        kept.save(case, batch.maker, LiftState(**state), snapshot)


def without_mark(result: CaseResult) -> CaseResult:
    """Return the result of a case that was continued, the mark removed."""
    observables = dict(result.observables)
    assert observables.pop("taken_up") == 1.0
    return replace(result, observables=observables)


@pytest.mark.parametrize("phase", ["fill", "lift"])
def test_a_case_that_was_left_in_any_phase_ends_in_the_same_bits(alone, left, phase):
    batch = start(CASE, folder=left[phase])
    assert batch.steps[0] > 0
    assert batch.phase(0) == phase
    assert_same_result(worlds.finish(batch)[0], alone[0])
    assert_same_bits(state(batch.solver), alone[1])


def test_a_diverging_case_ends_with_its_reason():
    [result] = simulate([DIVERGING], device=DEVICE, workers=1)
    assert result.status == "diverged"
    assert "lower time_step_fraction" in result.reason


def test_a_killed_simulation_goes_on_to_the_same_bits(tmp_path):
    """Kill its processes with it; both cases continue from where they were, in one batch this time."""
    code = """
import sys
from test_checkpoint import ALWAYS, DEVICE, ENDLESS, simulate
settings = {"workers": 2, "checkpoint": sys.argv[1], "checkpoint_every": ALWAYS}
simulate(ENDLESS, DEVICE, on_progress=lambda p: print(p.phase_counts.get("lift", 0), flush=True), **settings)
"""
    command = [sys.executable, "-c", code, str(tmp_path)]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(os.path.abspath, sys.path))}
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE) as process:
        while process.stdout.readline() != b"2\n":
            assert process.poll() is None
        process.send_signal(signal.SIGKILL)
        # The other end of the pipe is closed when the last of the processes has ended.
        process.communicate(timeout=60.0)
        assert process.returncode == -signal.SIGKILL
    resumed = start(*ENDLESS, folder=tmp_path)
    left_at = list(resumed.steps)
    assert [resumed.phase(w) for w in (0, 1)] == ["lift", "lift"]
    for _ in range(8):
        resumed.advance()
    for w, case in enumerate(ENDLESS):
        whole = start(case)
        while whole.steps[0] < resumed.steps[w]:
            whole.advance()
        assert whole.steps[0] == resumed.steps[w] > left_at[w] > 0
        assert resumed.controllers[w].state == whole.controllers[0].state
        assert_same_bits(state(resumed.solver, w), state(whole.solver))


def test_an_interrupted_simulation_goes_on(alone, tmp_path, monkeypatch):
    monkeypatch.setattr(dem_warp.simulation, "REPORT_EVERY", 0.0)
    settings = {"device": DEVICE, "workers": 1, "checkpoint": tmp_path, "checkpoint_every": ALWAYS}

    def interrupt(progress):
        if "lift" in progress.phase_counts:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate([CASE], on_progress=interrupt, **settings)
    marked(tmp_path, CASE)
    [result] = simulate([CASE], **settings)
    assert_same_result(without_mark(result), alone[0])
    assert list(tmp_path.iterdir()) == []


def test_processes_take_up_their_cases(alone, left, tmp_path):
    shutil.copytree(left["lift"], tmp_path, dirs_exist_ok=True)
    marked(tmp_path, CASE)
    ended = []
    results = simulate(
        [handful(5), CASE],
        device=DEVICE,
        workers=2,
        on_result=lambda index, _: ended.append((index, len(list(tmp_path.iterdir())))),
        checkpoint=tmp_path,
    )
    assert "taken_up" not in results[0].observables
    assert_same_result(without_mark(results[1]), alone[0])
    # A checkpoint stays until its result has been handed over.
    assert dict(ended)[1] == 1
    assert list(tmp_path.iterdir()) == []


def test_a_result_that_could_not_be_kept_leaves_its_checkpoint(left, tmp_path):
    shutil.copytree(left["lift"], tmp_path, dirs_exist_ok=True)

    def full(index, result):
        raise OSError("no space left on device")

    with pytest.raises(OSError, match="no space"):
        simulate([CASE], device=DEVICE, workers=1, on_result=full, checkpoint=tmp_path)
    assert start(CASE, folder=tmp_path).steps[0] > 0


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def flip_a_bit(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def put_other_arrays(path: Path) -> None:
    np.savez(path, positions=np.zeros((3, 3)))


@pytest.mark.parametrize("damage", [cut, flip_a_bit, put_other_arrays])
def test_a_damaged_checkpoint_is_named_and_only_its_case_starts_afresh(left, tmp_path, caplog, damage):
    shutil.copytree(left["settle"], tmp_path, dirs_exist_ok=True)
    damage(the_file(tmp_path))
    other = start(handful(5), folder=tmp_path, every=ALWAYS)
    other.advance()
    with caplog.at_level(logging.WARNING):
        batch = start(handful(5), CASE, folder=tmp_path)
    assert batch.steps == [other.steps[0], 0]
    assert str(Checkpoints(tmp_path).path(CASE)) in caplog.text
    assert "starts again: the file is damaged" in caplog.text
    assert_same_bits(take_snapshot(batch.solver, 1), take_snapshot(start(CASE).solver, 0))


@pytest.mark.parametrize(
    ("module", "name", "value", "reason"),
    [
        (dem_warp.batch, "engine_fingerprint", lambda *_: "newer", "engine '.*' instead of 'newer'"),
        (dem_warp.batch, "provenance", lambda *_: {"device": "another"}, "device '.*' instead of 'another'"),
        (dem_warp.checkpoint, "FORMAT", 99, "format 1 instead of 99"),
    ],
)
def test_a_checkpoint_of_another_maker_is_not_used(left, caplog, monkeypatch, module, name, value, reason):
    monkeypatch.setattr(module, name, value)
    with caplog.at_level(logging.WARNING):
        assert start(CASE, folder=left["fill"]).steps == [0]
    assert caplog.messages[0].startswith(str(the_file(left["fill"])))
    assert re.search(reason, caplog.text)


def test_a_checkpoint_is_that_of_its_case_alone(left):
    others = (replace(CASE.numerics, **one) for one in ({"skin": 1.6e-3}, {"time_step_fraction": 0.2}))
    for other in (replace(CASE, seed=2), *(replace(CASE, numerics=numerics) for numerics in others)):
        assert start(other, folder=left["fill"]).steps == [0]


def test_a_run_goes_on_if_no_checkpoint_can_be_written(tmp_path, caplog):
    (tmp_path / "file").write_text("in the way", encoding="utf-8")
    batch = start(handful(1), folder=tmp_path / "file", every=ALWAYS)
    with caplog.at_level(logging.WARNING):
        batch.advance()
    assert batch.steps[0] > 0
    assert "cannot write the checkpoint" in caplog.text


def test_a_snapshot_of_another_world_is_refused_and_changes_nothing():
    solver = solve(pile(), pile(3), precision="mixed")
    untouched, snapshot = take_snapshot(solver, 0), take_snapshot(solver, 1)
    for bad, message in (
        (take_snapshot(solve(pile(count=20), precision="mixed"), 0), "at most .* for each of 36 grains"),
        (take_snapshot(solve(pile(), precision="double"), 0), "must be float32"),
        ({name: array for name, array in snapshot.items() if name != "grains.spin"}, "grains.spin"),
        (snapshot | {"grains.smell": snapshot["grains.spin"]}, "grains.smell"),
        (snapshot | {"world.walls": snapshot["world.walls"][:1]}, "world.walls"),
        ({}, "neighbours.count"),
    ):
        with pytest.raises(ValueError, match=message):
            put_snapshot(solver, 0, bad)
        assert_same_bits(take_snapshot(solver, 0), untouched)


def test_a_world_goes_on_in_the_rain_in_a_batch_at_its_start():
    case = small_case(scene=replace(SMALL_TUBE, grain_count=60, rain_rate=300.0))
    first, second = start(case), start(case)
    released = int(first.setups[0].grains.release_steps[20])
    first.solver.advance(released // CHUNK)
    second.solver.advance(1)
    assert 0.2 < first.solver.neighbours.near.afar.numpy().mean() < 0.8
    put_snapshot(second.solver, 0, take_snapshot(first.solver, 0))
    for batch in (first, second):
        batch.solver.advance(2)
        assert batch.solver.flags.numpy()[0] == 0
    assert_same_bits(state(second.solver), state(first.solver))
