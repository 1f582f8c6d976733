"""Measured curves of a press: strains that they give, and what is refused with its replicate."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from small_study import ANGLE, TUBE

from dem_warp.scenes.press_curve import LOADED, UNLOADED
from experiments.io.errors import InputError, StudyError
from experiments.measurement import profile_files, profile_responses
from experiments.measurement.measured_file import read_measured
from experiments.studyfile import load_study
from experiments.studyfile.observables import Instrument, instrument_of

STRESS = 2e3
PRESS = f'[scene.compression]\ndiameter = "40 mm"\nfill_depth = "30 mm"\nstress = "{STRESS} Pa"\n'
TARGET = '[target]\nobservable = "stress_strain"\nprofiles = "p.csv"\n'
HEIGHT = 0.05
"""Strain at the largest stress of a drawn curve; it goes with the root of the stress, and half comes back."""


def drawn(name: str, softness: float = 1.0, unloading: bool = True) -> str:
    down = np.linspace(0.0, 1.0, 101)
    up = down[-2::-1] if unloading else down[:0]
    strains = np.append(HEIGHT * np.sqrt(down), HEIGHT * (1 + np.sqrt(up)) / 2) * softness
    points = zip(strains, STRESS * np.append(down, up), strict=True)
    return "".join(f"{name},{strain:.9f},{stress:.6f} Pa\n" for strain, stress in points)


def file(folder: Path, text: str) -> Path:
    path = folder / "p.csv"
    path.write_text(f"replicate,strain,stress\n{text}", encoding="utf-8")
    return path


def test_a_curve_gives_its_strains_from_the_seat_of_the_piston(tmp_path: Path) -> None:
    _, kept, strains, _ = profile_files.read_press_curves(file(tmp_path, drawn("1")), STRESS)
    given = HEIGHT * np.append(np.sqrt(LOADED), (1 + np.sqrt(UNLOADED)) / 2)
    seat = 1 - HEIGHT * 0.1
    # Straight lines between points at every hundredth of the stress.
    assert strains[0] == pytest.approx(1 - (1 - given) / seat, abs=1e-4)
    assert kept == list(range(9))
    loading = file(tmp_path, drawn("1", unloading=False))
    assert profile_files.read_press_curves(loading, STRESS).stations == list(range(5))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1,0.1,2\n", r"p.csv:2: stress: needs a unit of pressure"),
        ("1,5,2 kPa\n", r"p.csv:2: strain: must be a part of the height, between -1 and 1"),
        (",0.1,2 kPa\n", r"p.csv:2: replicate: needs a label"),
        (
            "1,0,0 kPa\n1,0.1,5 kPa\n",
            r"replicate 1: the largest stress must be that of the study, 2000 Pa, got",
        ),
        (drawn("1") + drawn("2"), r"replicate 2 is a copy of replicate 1"),
        ("", r"p.csv: has no rows below"),
    ],
)
def test_a_bad_curve_is_refused(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        profile_files.read_press_curves(file(tmp_path, text), STRESS)


def test_curves_become_responses_without_a_unit(write_study: Callable[..., Path], tmp_path: Path) -> None:
    file(tmp_path, "".join(drawn(str(n), 1 + 0.01 * n * (-1) ** n) for n in (1, 2, 3, 4)))
    study = profile_responses.with_profiles(load_study(write_study((TUBE, PRESS), (ANGLE, TARGET))))
    first = study.target.responses[0]
    assert (first.unit, first.part_of) == ("1", "stress_strain")
    assert {name for name, _ in first.weights} == {f"strain_{n}" for n in range(1, 10)}
    of_heap = load_study(write_study((ANGLE, TARGET)))
    with pytest.raises(
        InputError, match=r'"stress_strain" of a compression, .*, got stress_strain of lifted-'
    ):
        profile_responses.with_profiles(of_heap)


def test_a_search_reads_the_curve_of_a_condition(write_study: Callable[..., Path], tmp_path: Path) -> None:
    file(tmp_path, drawn("1"))
    light = 'scene.compression.stress = "1 kPa"\nscene.compression.taps = 20\n'
    conditions = f"[condition.base]\n\n[condition.light]\n{light}"
    study = load_study(write_study((TUBE, PRESS), (ANGLE, ""), add=conditions))
    assert study.under("light").case({}, 1).scene.taps == 20
    table = tmp_path / "measured.csv"
    head = "condition,replicate,observable,value,unit,profile\n"
    table.write_text(f"{head}base,1,stress_strain,,,p.csv\nbase,1,modulus,40,kPa,\n", encoding="utf-8")
    data = read_measured(table, study)
    assert {f"strain_{n}" for n in range(1, 10)} | {"modulus"} <= set(data.observables)
    table.write_text(f"{head}light,1,stress_strain,,,p.csv\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"must be that of the study, 1000 Pa, got 2000 Pa"):
        read_measured(table, study)


def test_what_a_press_measures_has_its_instrument(write_study: Callable[..., Path]) -> None:
    study = load_study(write_study((TUBE, f"{PRESS}taps = 9\n"), (ANGLE, "")))
    seen = {each.name: each for each in study.measurable}
    pressed = {"modulus", "unloading_modulus", "rebound", "base_share", "pressed_density", "strain_5"}
    assert {name for name in seen if instrument_of(seen[name]) is Instrument.PRESS} >= pressed
    assert instrument_of(seen["tapped_density"]) is Instrument.BALANCE
    assert seen["strain_5"].part_of == "stress_strain"


def test_a_study_names_unlikely_pistons_and_refuses_impossible_ones(write_study: Callable[..., Path]) -> None:
    doubts = load_study(write_study((TUBE, PRESS), (ANGLE, ""))).doubts()
    assert any("times softer than stated" in doubt for doubt in doubts)
    for wrong, message in (
        ('speed = "5 m/s"\n', r"scene: Compression.speed: must be below .* an inertial number of 0.01"),
        ('diameter = "3 mm"\n', r"must be at least .* grains wide"),
    ):
        text = PRESS.replace('diameter = "40 mm"\n', "") if "diameter" in wrong else PRESS
        with pytest.raises(StudyError, match=message):
            load_study(write_study((TUBE, text + wrong), (ANGLE, "")))
