"""``dem-warp reading``: values, errors, lines that a study takes, and what it refuses."""

import json
import math
import tomllib
from pathlib import Path

import pytest
from commandline import dem_warp, refused

from experiments.commands import reading
from experiments.grains.bench_readings import METHODS
from experiments.studyfile import load_study

STUDY = Path(__file__).parents[3] / "experiments" / "studies" / "buckwheat" / "curve_to_point.toml"
GIVEN = {
    "incline": ["20", "21", "22 deg"],
    "sledge": ["angle=20", "--sd", "angle=1", "-n", "5"],
    "rolling-start": ["2.5", "2.6"],
    "rolling-run": ["slope=30", "distance=100 mm", "run=900", "820"],
    "rebound": ["first=300 ms", "0.31", "second=0.14", "0.15"],
    "rebound-45": ["fall=300", "height_1=150", "distance_1=140", "height_2=300", "distance_2=210", "212"],
    "pendulum": ["release=60", "striker=8", "struck=51", "--sd", "struck=1", "-n", "1"],
    "value": ["0.31", "0.33"],
}


@pytest.mark.parametrize("method", METHODS)
def test_every_method_gives_value_error_and_lines(method: str) -> None:
    code, out, _ = dem_warp("reading", method, *GIVEN[method])
    assert code == 0
    assert "standard error" in out
    code, found, _ = dem_warp("reading", method, *GIVEN[method], "--json")
    facts = json.loads(found)
    assert facts["se"] == pytest.approx(facts["sd"] / math.sqrt(facts["n"]))
    (section,) = tomllib.loads(out.partition("\n\n")[2])["direct"]
    assert section["by"] == method
    for formula in METHODS[method]:
        assert all(name in (reading.reading.__doc__ or "") for name in formula.quantities if name != "value")


def test_a_study_takes_the_lines(tmp_path: Path) -> None:
    (tmp_path / "clump.txt").write_bytes((STUDY.parent / "clump.txt").read_bytes())
    table = tmp_path / "incline.csv"
    table.write_text("angle\n14 deg\n15 deg\n16 deg\n", encoding="utf-8")
    _, given, _ = dem_warp("reading", "incline", "14", "15", "16", "--parameter", "F")
    _, filed, _ = dem_warp("reading", "incline", "--file", table, "--parameter", "F")
    study = tmp_path / "study.toml"
    samples = []
    for out in (given, filed):
        study.write_text(STUDY.read_text(encoding="utf-8") + out.partition("\n\n")[2], encoding="utf-8")
        samples.append(load_study(study).direct[0].measured)
    assert samples[0] == samples[1]
    assert samples[0].mean == pytest.approx(0.268, abs=1e-3)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["inclined", "20"], "METHOD: must be a method"),
        (["incline"], "needs values or --file"),
        (["incline", "20", "--sd", "1"], "needs values or --file"),
        (["incline", "20,5", "21"], 'must have no comma, but a decimal point if any: "20.5"'),
        (["rebound", "fall=300", "61"], "rebound needs fall and height, or first and second, got fall"),
        (["incline", "angle=95", "20"], "incline: angle must be between 0 and 90 deg, got 95"),
    ],
)
def test_bad_readings_are_refused(words: list[str], message: str) -> None:
    assert message in refused("reading", *words)
