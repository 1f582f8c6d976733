"""Plans of ``--dry-run``, and the findings of ``dem-warp doctor``, before anything runs."""

import json
import platform
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import warp as wp
from commandline import dem_warp

from experiments import api
from experiments.cases import Resources
from experiments.cases.forecast import speed
from experiments.runs import examination
from imaging import save_picture

Write = Callable[..., Path]

TRIAL = Path(api.__file__).parent / "studies" / "trial" / "study.toml"


@pytest.fixture(autouse=True)
def _noted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let twelve batches of a million sphere-steps a second be noted."""
    monkeypatch.setattr(speed, "noted_speed", lambda *_: (1.0e6, tuple(range(12))))


def planned(*words: object) -> dict:
    code, out, err = dem_warp(*words, "--device", "cpu", "--workers", 2, "--dry-run", "--json")
    assert code == 0, err
    return json.loads(out)


def test_a_calibration_is_planned_and_nothing_is_written(write_study: Write, tmp_path: Path) -> None:
    study, out = write_study(), tmp_path / "out"
    plan = planned("calibrate", study, "--out", out)
    assert not out.exists()
    batches = {batch["name"]: batch for batch in plan["batches"]}
    # Five replicates and eight runs of the screening; six steps twice, once or twice over; a line of two
    # points with five at its centre; five fresh cases.
    assert batches["target, noise floor, screening"]["cases"] == 5 + 8
    assert (batches["climb"]["cases"], batches["climb"]["most"]) == (12, 24)
    assert batches["verification"]["cases"] == 5
    assert batches["climb"]["grains"] == batches["climb"]["spheres"] == 30
    assert plan["cases"] == sum(batch["cases"] for batch in plan["batches"])
    assert batches["climb"]["seconds"] == pytest.approx(6 * batches["climb"]["steps"] * 30 / 1.0e6, rel=0.01)
    assert plan["memory"] > 1e8
    assert plan["disk"] > 0


def test_cases_that_a_study_fixes_are_planned_in_the_batch_they_run_in(write_study: Write) -> None:
    fixed = 'selection.keep = ["E"]\nsurface.half_range = { E = 0.1 }\n'
    open_, all_fixed = (
        planned("calibrate", write_study(add=f"[campaign]\n{fixed}{more}"))
        for more in ("", "surface.center = { E = 0.5 }\n")
    )
    names = [batch["name"] for batch in all_fixed["batches"]]
    assert names == ["target, noise floor, screening, surface", "climb, verification", "start, report"]
    assert (all_fixed["cases"], all_fixed["most"]) == (open_["cases"], open_["most"])


TWICE = """
[response-scene.again.lifted-cylinder]
diameter = "28 mm"
height = "28 mm"
grain_count = 60

[[response]]
name = "other"
observable = "angle"
scene = "again"
mean = "30 deg"
sd = "0.5 deg"
n = 5
"""


def test_the_share_of_each_test_in_the_work_is_told(write_study: Write) -> None:
    study = write_study(add=TWICE)
    shares = planned("calibrate", study)["shares"]
    # twice the grains, and as much time or more
    assert sum(shares.values()) == pytest.approx(1.0)
    assert shares["again"] >= 2.0 * shares["target"]
    said = dem_warp("calibrate", study, "--dry-run")[1]
    assert f"Work of a setting: target {shares['target']:.0%}, again {shares['again']:.0%}." in said
    assert planned("calibrate", write_study())["shares"] == {"target": 1.0}


def test_a_plan_reads_well(write_study: Write, tmp_path: Path) -> None:
    code, out, _ = dem_warp("calibrate", write_study(), "--device", "cpu", "--workers", 2, "--dry-run")
    assert code == 0
    assert "verification" in out
    assert "Nothing was run, nothing was written." in out
    assert out.count("from 12 batches on this machine") == 1
    assert "start, report" in out
    assert "Not counted: compiling kernels" in out


def test_a_time_that_nobody_knows_is_unknown(write_study: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(speed, "noted_speed", lambda *_: None)
    words = ("calibrate", write_study(), "--device", "cpu", "--workers", 2, "--dry-run")
    code, out, _ = dem_warp(*words)
    assert (code, "Time: unknown until the first batch." in out) == (0, True)
    assert json.loads(dem_warp(*words, "--json")[1])["seconds"] is None
    noted = lambda _, like: (1.0e6, (1,)) if like.spheres > 1.0 else None  # noqa: E731
    monkeypatch.setattr(speed, "noted_speed", noted)
    said = dem_warp(*words)[1]
    assert "Time: unknown" not in said
    assert "from 1 batch on this machine, without start and report. Not counted" in said


def test_a_search_is_planned(tmp_path: Path) -> None:
    plan = planned("discover", TRIAL, "--scale", "bench", TRIAL.with_name("tilted-bench.csv"))
    assert [batch["name"] for batch in plan["batches"]] == ["fresh runs", "start, report"], (
        "the bank ships with the study"
    )
    assert 0 < plan["cases"] < plan["most"]


def test_the_plan_of_a_search_reads_the_data() -> None:
    heaps = Path(__file__).parents[1] / "discover" / "data" / "nothing-missing.csv"
    plan = planned("discover", TRIAL, "--scale", "bench", heaps)
    assert (plan["cases"], plan["most"]) == (0, 0), "heaps without a gap ask for no fresh run"


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
    words = ("heap", write_study(), "--set", "E=0.3", "--device", "cpu", "--dry-run", "--json")
    plan = json.loads(dem_warp(*words)[1])
    assert plan["cases"] == plan["most"] == 1


def test_a_campaign_and_one_of_its_heaps_have_forecasts_that_agree(write_study: Write) -> None:
    campaign = planned("calibrate", write_study())
    heap = json.loads(dem_warp("heap", write_study(), "--device", "cpu", "--dry-run", "--json")[1])
    each = [2 * batch["seconds"] / batch["cases"] for batch in campaign["batches"] if batch["cases"]]
    one = heap["batches"][0]["seconds"]
    assert 1 / 1.5 < np.average(each) / one < 1.5  # two workers share the campaign
    assert all(1 / 1.5 < seconds / one < 1.5 for seconds in each)


def test_after_a_campaign_the_time_of_one_of_its_heaps_is_known(
    write_study: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    # no heap has run: the time of its start and report is unknown, that of its case is the campaign's
    noted = lambda _, like: (1.0e6, (0,)) if like.kind != "heap" else None  # noqa: E731
    monkeypatch.setattr(speed, "noted_speed", noted)
    campaign = planned("calibrate", write_study())
    heap = json.loads(dem_warp("heap", write_study(), "--device", "cpu", "--dry-run", "--json")[1])
    each = [2 * batch["seconds"] / batch["cases"] for batch in campaign["batches"] if batch["cases"]]
    assert 1 / 1.5 < np.average(each) / heap["seconds"] < 1.5  # two workers share the campaign
    assert heap["source"] == "from 1 batch on this machine, without start and report"


def test_jobs_are_not_submitted_for_a_plan(write_study: Write, tmp_path: Path) -> None:
    profile = tmp_path / "cluster.toml"
    profile.write_text('[cluster]\nkind = "slurm"\nworkers = 4\nqueue = "main"\n', encoding="utf-8")
    words = ("calibrate", write_study(), "--cluster", profile, "--dry-run")
    code, out, _ = dem_warp(*words)
    assert code == 0
    assert "4 workers of slurm" in out


def test_the_doctor_tells_what_there_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("experiments.runs.examination.noted_speed", lambda _: None)
    code, out, err = dem_warp("doctor", "--device", "cpu", "--workers", 2, "--json")
    assert code == 0, err
    found = {finding["name"]: finding for finding in json.loads(out)}
    for name in ("versions", "cores", "memory", "kernel cache", "simulation", "OpenGL", "clusters"):
        assert name in found
    assert found["simulation"]["good"]
    assert found["will be used"]["text"].startswith("cpu, 2 at once")
    assert not found["speed"]["good"], "nothing like it was noted"


@pytest.mark.parametrize(
    ("driver", "release", "visible", "card", "text", "cure"),
    [
        (None, "6.1", None, False, "no NVIDIA GPU: cases run on the CPU", "None is needed. Warp"),
        (None, "6.1", None, True, "an NVIDIA card without a driver", "Install NVIDIA's driver. Warp"),
        (None, "5.15-microsoft-standard-WSL2", None, False, "no NVIDIA driver in WSL", "in Windows"),
        ((12, 4), "6.1", None, True, "the driver of CUDA 12.4 is too old", "needs a driver of CUDA 13.0"),
        ((13, 1), "6.1", "", True, "CUDA_VISIBLE_DEVICES= hides every GPU", "Unset it."),
        ((13, 1), "6.1", None, True, "the driver of CUDA 13.1 finds no GPU", "nvidia-smi"),
    ],
)
def test_each_state_without_a_gpu_has_its_cause_and_its_cure(
    driver: tuple[int, int] | None,
    release: str,
    visible: str | None,
    card: bool,
    text: str,
    cure: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name, value in (("vendor", "0x10de\n"), ("class", "0x030200\n")) if card else ():
        (tmp_path / "one").mkdir(exist_ok=True)
        (tmp_path / "one" / name).write_text(value, encoding="ascii")
    monkeypatch.setattr(examination, "DEVICES", tmp_path)
    monkeypatch.setattr(wp, "get_cuda_driver_version", lambda: driver)
    monkeypatch.setattr(wp, "get_cuda_toolkit_version", lambda: (13, 4))
    monkeypatch.setattr(platform, "release", lambda: release)
    monkeypatch.delenv("CUDA_VISIBLE_DEVICES", raising=False)
    if visible is not None:
        monkeypatch.setenv("CUDA_VISIBLE_DEVICES", visible)
    found = examination._no_gpu(75)
    assert not found.good
    assert text in found.text
    assert cure in found.cure


def test_a_card_that_is_too_old_for_warp_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    old = SimpleNamespace(name="GTX 1080", alias="cuda:0", arch=61, free_memory=7e9, total_memory=8e9)
    monkeypatch.setattr(wp, "get_cuda_devices", lambda: [old])
    monkeypatch.setattr(wp, "get_cuda_supported_archs", lambda: {75, 80, 120})
    [found] = examination._gpus()
    assert (found.name, found.good) == ("cuda:0", False)
    assert "compute capability 6.1" in found.text
    assert "needs 7.5 or later" in found.cure


@pytest.mark.parametrize(("noted", "good"), [(1.0e5, False), (1.0e7, True), (1.0e9, False)])
def test_a_speed_is_compared_with_what_is_normal(
    noted: float, good: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(examination, "noted_speed", lambda _: (noted, (0,)))
    found = examination._speed(Resources("cpu"))
    assert (found.good, bool(found.cure)) == (good, not good)
    assert "normal: 2 to 50" in found.text


def test_an_error_of_a_check_is_its_finding() -> None:
    def check() -> list[examination.Finding]:
        raise PermissionError(13, "Permission denied", "/proc/x")

    [found] = examination._tried("memory", check)
    assert (found.good, "Permission denied" in found.text) == (False, True)


def test_the_doctors_exit_code_tells_that_nothing_can_be_simulated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("in the way", encoding="utf-8")
    monkeypatch.setattr(wp.config, "kernel_cache_dir", str(tmp_path / "file" / "cache"))
    code, out, _ = dem_warp("doctor", "--device", "cpu")
    assert code == 1
    assert "FAIL kernel cache" in out
    assert "Set WARP_CACHE_PATH" in out
    assert "ok   simulation" in out, "in a temporary cache"
