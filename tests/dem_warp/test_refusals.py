"""Impossible cases and forged checkpoints: each ends with its reason, and harms no other."""

import io
import json
import math
import zipfile
from dataclasses import asdict, replace

import numpy as np
import pytest
from worlds import SMALL_TUBE, assert_same_bits, assert_same_result, small_case

from dem_warp import Case, simulate
from dem_warp.batch import Batch
from dem_warp.checkpoint import Checkpoints
from dem_warp.reading import read_arrays
from dem_warp.snapshot import COUNT, ENTRY, STEP, take_snapshot

FEW = replace(SMALL_TUBE, grain_count=3)


def few(**changes) -> Case:
    return small_case(scene=replace(FEW, **changes))


@pytest.fixture(scope="module")
def alone():
    return simulate([few()], device="cpu", workers=1)[0]


IMPOSSIBLE = {
    "skin": (small_case(skin=1000.0), "skin: must be smaller"),
    "tall": (few(height=1.0e4, grain_count=None), "must be at most"),
    "narrow": (few(diameter=0.002), "no free place for the rain"),
    "many": (few(grain_count=10**9), "must be at most 14,913,080 grains of 9 spheres"),
    "fast": (few(rain_speed=100.0), "too fast for the neighbour lists"),
}


def test_a_case_that_cannot_be_fails_alone(alone):
    cases = [few(), *(case for case, _ in IMPOSSIBLE.values())]
    [whole, *others] = simulate(cases, device="cpu", workers=1)
    assert_same_result(whole, alone)
    for result, (name, (_, reason)) in zip(others, IMPOSSIBLE.items(), strict=True):
        assert result.status == "failed", name
        assert reason in result.reason


@pytest.fixture(scope="module")
def halfway():
    batch = Batch([few()], "cpu")
    for _ in range(3):
        batch.advance()
    return batch


@pytest.fixture
def kept(halfway, tmp_path):
    """Return a batch half-way, and a folder for its checkpoint."""
    return halfway, Checkpoints(tmp_path)


def assert_not_used(checkpoints, caplog):
    """Require that a batch begins as without a checkpoint, and warns."""
    begun, fresh = Batch([few()], "cpu", checkpoints), Batch([few()], "cpu")
    assert "starts again" in caplog.text
    assert begun.steps == [0]
    assert_same_bits(take_snapshot(begun.solver, 0), take_snapshot(fresh.solver, 0))


def forged(kept, name, change):
    """Save a checkpoint with one array changed, as a program would that knows the format."""
    batch, checkpoints = kept
    snapshot = take_snapshot(batch.solver, 0)
    snapshot[name] = np.array(snapshot[name])
    change(snapshot[name])
    checkpoints.save(batch.cases[0], batch.maker, batch.controllers[0].state, snapshot)
    return checkpoints


def put(value):
    return lambda array: array.__setitem__((0,) * array.ndim, value)


def put_field(name, value):
    return lambda array: array[name].__setitem__((0,) * array.ndim, value)


@pytest.mark.parametrize(
    ("name", "change"),
    [
        (ENTRY, put(-1)),
        (ENTRY, put(2**31 - 1)),
        (COUNT, put(10**6)),
        (STEP, put(255)),
        ("grains.position", put(np.nan)),
        ("neighbours.history", put(np.nan)),
        ("world.walls", put_field("pair", 99)),
    ],
)
def test_a_forged_checkpoint_is_not_used(kept, caplog, name, change):
    assert_not_used(forged(kept, name, change), caplog)


@pytest.mark.parametrize(
    "change",
    [{"phase": "elsewhere"}, {"surface": ["high"]}, {"mass": math.nan}, {"more": 1}],
)
def test_a_forged_state_is_not_used(kept, caplog, change):
    batch, checkpoints = kept
    state = asdict(batch.controllers[0].state) | change
    path = checkpoints.path(batch.cases[0])
    record = json.dumps({"format": 1, "maker": batch.maker, "state": state}).encode()
    path.parent.mkdir(exist_ok=True)
    np.savez(path, **take_snapshot(batch.solver, 0), record=np.frombuffer(record, dtype=np.uint8))
    assert_not_used(checkpoints, caplog)


def test_a_small_archive_takes_little_memory(tmp_path):
    bomb, liar = tmp_path / "bomb.npz", tmp_path / "liar.npz"
    np.savez_compressed(bomb, zeros=np.zeros(10**7))
    few_numbers = io.BytesIO()
    np.save(few_numbers, np.zeros(3))
    with zipfile.ZipFile(liar, "w") as archive:
        archive.writestr("few.npy", few_numbers.getvalue().replace(b"(3,), }      ", b"(3000000,), }"))
    for path in (bomb, liar, tmp_path, tmp_path / "none"):
        with pytest.raises(ValueError, match="not a valid archive of arrays"):
            read_arrays(path)
