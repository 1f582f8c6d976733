"""A bridge to another solver: corrected, verified, written as a card, and refused where it cannot be."""

import json
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from commandline import dem_warp, refused
from cone_engine import SEEDS, cone_engine, without_pages

from doe import Factor, Sample, central_composite, fit_surface
from experiments import api
from experiments.bridge.crossing import cross
from experiments.bridge.result import BridgeOutcome
from experiments.bridge.source import Source, read_source
from experiments.cases import engine_of
from experiments.cases.engines import engines
from experiments.io.units import Quantity
from experiments.studyfile import load_card, load_study

CONES = Path(__file__).parents[1] / "cases" / "engines" / "cone_program.py"
COMMAND = f"'{sys.executable}' '{CONES}'"
OTHER = """
name = "other"
material = "{card}"

[scene.lifted-cylinder]
diameter = "28 mm"
height = "28 mm"
grain_count = 30
"""
Write = Callable[..., Path]


@pytest.fixture(scope="module")
def card(tmp_path_factory: pytest.TempPathFactory, small_text: str) -> Path:
    """Calibrate a card on cones of 15 degrees and 30 more for a friction of 1; the target is 30."""
    folder = tmp_path_factory.mktemp("card")
    study = folder / "small.toml"
    study.write_text(small_text, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(engines._DRIVERS, "cones", cone_engine)
        patch.setenv(SEEDS, str(folder / "seeds.txt"))
        without_pages(patch)
        api.calibrate(study, folder / "out", device="cpu", engine="cones")
    return folder / "out" / "material.toml"


def test_a_card_is_corrected_for_another_solver_and_verified_there(card: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = (card, "--command", f"{COMMAND} flatter", "--out", out, "--workers", 2, "--runs", 8, "--fresh", 3)
    code, text, said = dem_warp("bridge", *words, "--json")
    assert code == 0, said
    found = json.loads(text)
    assert found["outcome"] == "met"
    # Where the cones of the card stand at 30 degrees, those of the other solver stand at 12 + 33/2 = 28.5.
    low, high = found["shift_interval"]
    assert low - 0.2 < -1.5 < high + 0.2, "a cone laid out on half a millimetre reads some tenths off"
    assert found["scale_interval"][0] < 1.1 < found["scale_interval"][1]
    assert found["point"]["E"] == pytest.approx(found["card_point"]["E"] + 1.5 / 33.0, abs=0.015)
    assert abs(found["fresh"]["difference"]) < 0.5
    runs = pd.read_csv(out / "runs.csv")
    assert runs["stage"].value_counts().to_dict() == {"bridge": 8, "verification": 3}
    assert runs["seed"].is_unique

    corrected = tomllib.loads((out / "material.toml").read_text())
    assert corrected["bridge"]["runs"] == 11
    friction = load_card(out / "material.toml").contact.grain_grain.static_friction
    assert friction == pytest.approx(found["point"]["E"])
    assert refused("bridge", out / "material.toml", "--command", COMMAND), "it is not corrected again"
    assert dem_warp("export", out / "material.toml", "--to", "edem", "--out", tmp_path / "sheet")[0] == 0
    head = (tmp_path / "sheet" / "values.md").read_text().splitlines()[:4]
    assert any("WARNING: the card was corrected for" in line for line in head), "it holds in the other solver"

    other = tmp_path / "other.toml"
    other.write_text(OTHER.format(card=(out / "material.toml").as_posix()), encoding="utf-8")
    said = refused("heap", other, "--out", tmp_path / "heap")
    assert f'card_solver = "{corrected["bridge"]["engine"]}"' in said
    there = load_study(other, changes={"engine": {"command": f"{COMMAND} flatter"}})
    assert engine_of(there) is not None, "in the solver of the bridge the values hold"

    log = out / "cases" / "runs.txt"
    before = log.read_text()
    assert dem_warp("bridge", *words, "--resume")[0] == 0
    assert log.read_text() == before, "a bridge that goes on repeats no run"


def test_a_card_is_corrected_by_heaps_that_a_person_types_in(card: Path, tmp_path: Path) -> None:
    """The person's program stands at 12 + 33 E degrees: 1.5 below the card's cones where those have 30."""
    out, rng = tmp_path / "out", np.random.default_rng(1)
    words = ("bridge", card, "--engine", "hand", "--out", out, "--runs", 8, "--fresh", 3)
    code, _, said = dem_warp(*words)
    for _ in range(4):
        assert code == 0, said
        if (out / "runs.csv").is_file():
            break
        sheet = max((out / "by-hand").glob("*.csv"))
        runs = pd.read_csv(sheet, comment="#")
        runs["angle [deg]"] = 12.0 + 33.0 * runs["E [1]"] + rng.normal(0.0, 0.1, len(runs))
        runs.to_csv(sheet, index=False)
        code, _, said = dem_warp(*words, "--resume")
    corrected = tomllib.loads((out / "material.toml").read_text(encoding="utf-8"))
    # Five standard errors of a shift by eight runs.
    assert Quantity.parse(corrected["bridge"]["shift"]).number == pytest.approx(-1.5, abs=0.3)
    assert corrected["bridge"]["engine"] == "a program by hand"


def test_the_card_holds_the_surface_that_was_fitted(card: Path) -> None:
    source = read_source(card)
    results = json.loads((card.parent / "results.json").read_text())["campaign"]
    fitted = results["surface"]["responses"]["angle"]
    surface = fitted["reduced"]
    assert source.surface.coefficients.to_dict() == pytest.approx(surface["coefficients"], rel=1e-9)
    assert source.surface.unselected.r2 == pytest.approx(fitted["full"]["r2"], rel=1e-9)
    assert [factor.name for factor in source.study.factors] == ["E"]


MU = Factor.around("mu", 0.4, 0.08)
ROLL = Factor.around("roll", 0.06, 0.02)


@pytest.fixture
def source(write_study: Write, tmp_path: Path) -> Source:
    second = """
[[factor]]
name = "roll"
label = "rolling"
parameter = "contact.grain-grain.rolling_friction"
low = 0.04
high = 0.08
"""
    among = "rolling_friction = 0.05\n\n[contact.grain-wall]"
    changes = (('name = "E"', 'name = "mu"'), (among, "\n[contact.grain-wall]"))
    study = load_study(write_study(*changes, add=second))
    design = central_composite((MU, ROLL), "rotatable", 5)
    noise = np.random.default_rng(1).normal(0.0, 0.4, len(design.coded))
    surface = fit_surface(design, truth(design.natural) + noise).reduce(0.05)
    point = dict(surface.nearest(28.5, extent=1.4))
    target = Sample(28.5, 0.5, 5)
    return Source(tmp_path / "material.toml", {}, study, "angle", "angle", "deg", target, surface, point)


def truth(points: pd.DataFrame) -> np.ndarray:
    x, y = (factor.to_coded(points[factor.name]).to_numpy() for factor in (MU, ROLL))
    return 28.0 + 2.5 * x + 1.2 * y - 0.4 * x**2


def solver(shift: float, scale: float, fails: int = 0) -> Callable[[pd.DataFrame, str], pd.DataFrame]:
    def run(table: pd.DataFrame, title: str) -> pd.DataFrame:
        noise = [np.random.default_rng(seed).normal(0.0, 0.6) for seed in table["seed"]]
        angle = 28.5 + shift + scale * (truth(table) - 28.5) + noise
        failed = np.arange(len(table)) < fails
        status = np.where(failed, "no-answer", "finished")
        reason = np.where(failed, "no license was found", "")
        return table.assign(angle=np.where(failed, np.nan, angle), status=status, reason=reason)

    return run


def test_bridges_of_two_factors_meet_the_target_as_their_intervals_say(source: Source) -> None:
    misses, inside = [], []
    for seed in range(4):
        found = cross(source, solver(-1.8, 0.85), "a formula", 12, 5, 0.5, seed)
        assert found.outcome == BridgeOutcome.MET
        assert found.carried is not None
        low, high = found.carried.intervals()["shift"]
        inside.append(low < -1.8 < high)
        there = 28.5 - 1.8 + 0.85 * (truth(pd.DataFrame([found.point])) - 28.5)
        misses.append(float(there[0]) - 28.5)
    # The noise of 12 runs leaves 0.6 / sqrt(12) = 0.17, and 0.3 with what shift and scale share.
    assert np.sqrt(np.mean(np.square(misses))) < 0.5
    assert sum(inside) >= 3, "of four intervals of .95 two miss in one of seventy trials"


def test_a_failed_run_is_left_out_and_too_many_end_the_bridge(source: Source) -> None:
    found = cross(source, solver(-1.0, 1.0, fails=1), "a formula", 12, 5, 0.5, 1)
    assert (found.outcome, found.carried.response.size) == (BridgeOutcome.MET, 10)
    found = cross(source, solver(-1.0, 1.0, fails=4), "a formula", 12, 5, 0.5, 1)
    assert found.outcome == BridgeOutcome.TOO_MANY_FAILED_RUNS
    assert "2 of 6 runs gave the angle" in found.reason
    assert "no license was found" in found.reason
    assert (found.point, len(found.runs)) == (None, 6)


def test_a_target_that_the_corrected_surface_does_not_reach_ends_the_bridge(source: Source) -> None:
    found = cross(source, solver(-20.0, 0.3), "a formula", 12, 5, 0.5, 1)
    assert found.outcome == BridgeOutcome.OUT_OF_REACH
    assert "Widen the ranges of the factors" in found.reason
    assert found.to_dict()["point"] is None


def test_a_point_that_fresh_runs_do_not_confirm_is_missed(source: Source) -> None:
    good = solver(-1.0, 1.0)

    def drifting(table: pd.DataFrame, title: str) -> pd.DataFrame:
        cases = good(table, title)
        return cases.assign(angle=cases["angle"] - 4.0 * (title == "verification"))

    found = cross(source, drifting, "a formula", 12, 5, 0.5, 1)
    assert found.outcome == BridgeOutcome.MISSED
    assert "not within 0.50 deg plus noise" in found.reason


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "a bridge needs another solver"),
        (("--engine", "rocky"), "must be one of"),
        (("--engine", "liggghts", "--command", "x"), "cannot have both a name and a command"),
        (("--command", "no-such-solver"), "must begin with a program"),
        (("--command", COMMAND, "--runs", 3), "must be at least 6"),
        (("--command", COMMAND, "--fresh", 1), "must be at least 2"),
        (("--command", COMMAND, "--margin", 0), "must be a positive number"),
        (("--command", COMMAND, "--time-limit", "10 furlongs"), "needs a unit of time"),
    ],
)
def test_a_wrong_order_ends_with_code_2_and_leaves_nothing(
    card: Path, tmp_path: Path, words: tuple[object, ...], said: str
) -> None:
    assert said in refused("bridge", card, *words, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_card_without_its_surface_is_refused(card: Path, tmp_path: Path) -> None:
    text = card.read_text(encoding="utf-8")
    start = text.index("[surface.angle]")
    (tmp_path / "material.toml").write_text(
        text[:start] + text[text.index("[material.grain]") :], encoding="utf-8"
    )
    said = refused("bridge", tmp_path / "material.toml", "--command", COMMAND)
    assert "a bridge needs a card with the surface of one response" in said
