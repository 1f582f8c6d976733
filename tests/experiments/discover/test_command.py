"""``dem-warp discover``, run as a person runs it on the trial study and its shipped bank."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commandline import dem_warp
from emulated import EmulatedSimulator, emulated_heaps

from dem_warp import CaseResult
from doe.discrepancy import Outcomes, Point, fit_emulator
from experiments.discover.engine_simulator import EngineSimulator
from experiments.discover.search import Search
from experiments.runs.choices import measured_study, prepare
from experiments.runs.request import RunRequest
from experiments.runs.run_folder import OUTCOMES
from experiments.runs.search import SearchData, run_search
from experiments.studyfile import Study, load_study, loading
from experiments.studyfile.observables import BY_NAME, PHOTOGRAPHED
from experiments.studyfile.places import Places

TRIAL = Path(__file__).parents[3] / "experiments" / "studies" / "trial"
STUDY = TRIAL / "study.toml"
DATA = Path(__file__).parent / "data"


def discover(*arguments: object) -> tuple[int, str, str]:
    """Run the command at bench scale."""
    return dem_warp("discover", STUDY, *arguments, "--scale", "bench", "--device", "cpu")


def test_a_search_builds_its_study_and_each_condition_when_a_file_is_read_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    built, build = [], loading.build_study

    def counted(document: dict[str, Any], places: Places) -> Study:
        built.append(places)
        return build(document, places)

    monkeypatch.setattr(loading, "build_study", counted)
    data = tmp_path / "measured.csv"
    data.write_text("condition,replicate,observable,value,unit\nbase,1,t75,400,ms\n", encoding="utf-8")
    code, _, err = discover(data, "--dry-run")
    assert code == 0, err
    assert 0 < len(built) <= 12


def test_heaps_that_lack_nothing_raise_no_alarm_with_photographs_only(tmp_path: Path) -> None:
    out = tmp_path / "out"
    code, said, err = discover(DATA / "nothing-missing.csv", "--out", out, "--photographs-only", "--json")
    assert code == 0
    assert "Nothing is missing that these data could show. " in err
    names = {path.name for path in out.iterdir()} - {OUTCOMES, ".live", ".lock"}
    assert names == {"files.json", "report.html", "results.json", "settings.json", "study.json", "tables"}
    found = json.loads(said)["discovery"]
    assert found["verdict"] == "none"
    # Only what a photograph shows is left.
    means = np.array(found["data"]["means"], dtype=float)
    assert np.isfinite(means).sum(axis=1).tolist() == [len(PHOTOGRAPHED)] * len(means)


def test_a_tilted_plate_is_found_and_added_to_the_study(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cone: Callable[..., CaseResult]
) -> None:
    # As many points as the model has parameters; half of them would leave the noise of the runs too large.
    few = {"refinement_points": 4, "refinement_rounds": 1, "shortlist": 1, "direct_runs": 4}
    trial = load_study(STUDY, "bench", {"discover": {"settings": few}})
    world = EmulatedSimulator(fit_emulator(Search.of(trial).read_bank(TRIAL / "bank-bench.npz")))

    def fresh(engine: EngineSimulator, points: Sequence[Point], _: object = None) -> Outcomes:
        known = world(points).values
        values = np.full((len(points), len(engine.observables)), np.nan)
        values[:, : known.shape[1]] = known
        return Outcomes(values, ("",) * len(points))

    monkeypatch.setattr(EngineSimulator, "__call__", fresh)
    monkeypatch.setattr(EngineSimulator, "heaps", lambda engine, points: [cone() for _ in points])
    request = RunRequest(out=tmp_path / "out", device="cpu", workers=1)
    data = tmp_path / "measured.csv"
    theta = tuple(factor.center for factor in trial.factors)
    measured = emulated_heaps(world, theta, {"plate_tilt": 5.0}, 8, 1)
    lines = [
        f"{condition},{number},{name},{value!r},{BY_NAME[name].unit.removeprefix('1')}"
        for condition, rows in measured.values.items()
        for number, row in enumerate(rows.tolist(), 1)
        for name, value in zip(measured.observables, row, strict=True)
    ]
    data.write_text("\n".join(["condition,replicate,observable,value,unit", *lines]), encoding="utf-8")
    ended = run_search(prepare(trial, request), SearchData(data))
    found = ended.discovery
    assert found is not None
    assert found.named == ("plate_tilt",)
    assert found.chosen is not None
    [size] = found.chosen.sizes
    # Hidden: 5 degrees. Half a 90 % interval is 1.64 standard errors, so its full width holds 99.9 %.
    width = size.high - size.low
    assert size.value - width < 5.0 < size.value + width
    training, held_out = found.before_after
    assert training.after.value < training.before.value
    # The noise of the heaps alone is left in the condition that took no part.
    assert held_out.after.low < held_out.degrees_of_freedom < held_out.after.high
    again = load_study(tmp_path / "out" / "study-with-plate_tilt.toml")
    measured_study(again)
    assert again.factors[-1].name == "plate_tilt"
