"""Measured points of a shear test: stresses that they give, and what is refused with its replicate."""

from collections.abc import Callable
from pathlib import Path

import pytest
from small_study import ANGLE, TUBE

from dem_warp.scenes.shear_points import LOADS, SHEAR_OBSERVABLES
from experiments.io.errors import InputError, StudyError
from experiments.measurement import profile_responses
from experiments.measurement.measured_file import read_measured
from experiments.measurement.profile_files import read_shear_points
from experiments.studyfile import load_study
from experiments.studyfile.observables import PROFILES, SHEAR_PROFILE, Instrument, instrument_of

STRESS = 2e3
SHEAR = f'[scene.shear]\nwidth = "40 mm"\nfill_depth = "30 mm"\nstress = "{STRESS} Pa"\n'
TARGET = '[target]\nobservable = "shear_points"\nprofiles = "p.csv"\n'


def drawn(name: str, slope: float = 0.5, parts: tuple[float, ...] = (0.2, 0.5, 0.8)) -> str:
    """Return points of a yield locus, and a pre-shear below it."""
    rows = [(part, 100.0 + slope * part * STRESS) for part in parts] + [(1.0, 0.9 * slope * STRESS)]
    return "".join(f"{name},{part * STRESS} Pa,{shear / 1e3} kPa\n" for part, shear in reversed(rows))


def file(folder: Path, text: str) -> Path:
    path = folder / "p.csv"
    path.write_text(f"replicate,normal,shear\n{text}", encoding="utf-8")
    return path


def test_points_give_the_shear_stress_at_each_load(tmp_path: Path) -> None:
    _, kept, shears, _ = read_shear_points(file(tmp_path, drawn("1")), STRESS)
    # A straight locus, whatever its points; the pre-shear is not a part of it.
    assert kept == [0, 1, 2, 3, 4]
    assert shears[0] == pytest.approx([*(100.0 + 0.5 * part * STRESS for part in LOADS), 900.0])
    narrow = file(tmp_path, drawn("1") + drawn("2", 0.6, (0.4, 0.6)))
    assert read_shear_points(narrow, STRESS).stations == [1, 2, 4]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1,0.1,2 kPa\n", r"p.csv:2: normal: needs a unit of pressure"),
        (",2 kPa,2 kPa\n", r"p.csv:2: replicate: needs a label"),
        ("1,5 kPa,1 kPa\n", r"replicate 1: the largest stress must be that of the study, 2000 Pa, got"),
        ("1,1 kPa,1 kPa\n1,2 kPa,1 kPa\n", r"needs 2 different normal stresses or more below that of the"),
        ("1,1 kPa,1 kPa\n1,1 kPa,2 kPa\n1,2 kPa,1 kPa\n", r"needs 2 different normal stresses"),
        (drawn("1") + drawn("2"), r"replicate 2 is a copy of replicate 1"),
        ("", r"p.csv: has no rows below"),
    ],
)
def test_bad_points_are_refused(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_shear_points(file(tmp_path, text), STRESS)


def test_points_become_responses_in_pascal(write_study: Callable[..., Path], tmp_path: Path) -> None:
    file(tmp_path, "".join(drawn(str(n), 0.5 + 0.01 * n * (-1) ** n) for n in (1, 2, 3, 4)))
    study = profile_responses.with_profiles(load_study(write_study((TUBE, SHEAR), (ANGLE, TARGET))))
    first = study.target.responses[0]
    assert (first.unit, first.part_of) == ("Pa", "shear_points")
    assert {name for name, _ in first.weights} == set(PROFILES[SHEAR_PROFILE])
    of_heap = load_study(write_study((ANGLE, TARGET)))
    with pytest.raises(InputError, match=r'"shear_points" of a shear test .*, got shear_points of lifted-'):
        profile_responses.with_profiles(of_heap)


def test_a_search_reads_the_points_of_a_condition(write_study: Callable[..., Path], tmp_path: Path) -> None:
    file(tmp_path, drawn("1"))
    conditions = '[condition.base]\n\n[condition.wall]\nscene.shear.base = "smooth"\n'
    study = load_study(write_study((TUBE, SHEAR), (ANGLE, ""), add=conditions))
    assert study.under("wall").case({}, 1).scene.is_smooth
    table = tmp_path / "measured.csv"
    head = "condition,replicate,observable,value,unit,profile\n"
    table.write_text(f"{head}base,1,shear_points,,,p.csv\nbase,1,cohesion,40,Pa,\n", encoding="utf-8")
    assert {*PROFILES[SHEAR_PROFILE], "cohesion"} <= set(read_measured(table, study).observables)


def test_what_a_shear_tester_measures_has_its_instrument(write_study: Callable[..., Path]) -> None:
    study = load_study(write_study((TUBE, SHEAR), (ANGLE, "")))
    tested = {each.name for each in study.measurable if instrument_of(each) is Instrument.SHEAR_TESTER}
    assert tested == set(SHEAR_OBSERVABLES) - {"wall_friction_angle"}


def test_a_study_refuses_impossible_shear_tests(write_study: Callable[..., Path]) -> None:
    for key, value, message in (
        ("speed", "5 m/s", r"scene: Shear.speed: must be below .* an inertial number of 0.01"),
        ("width", "4 mm", r"Shear.width: must be at least .* 6 grains"),
        ("base", "soft", r"base"),
    ):
        kept = "".join(f"{line}\n" for line in SHEAR.splitlines() if not line.startswith(key))
        with pytest.raises(StudyError, match=message):
            load_study(write_study((TUBE, f'{kept}{key} = "{value}"\n'), (ANGLE, "")))
