"""Measured profiles of a drum: what a file says, and what is refused with its row."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from small_study import ANGLE, TUBE

from experiments.io.errors import InputError, StudyError
from experiments.measurement import measured_target, profile_files, profile_responses
from experiments.studyfile import load_study

DRUM = '[scene.drum]\ndiameter = "60 mm"\nlength = "20 mm"\nrotation_rate = "30 1/min"\n'
TARGET = '[target]\nobservable = "surface"\nprofiles = "p.csv"\n'
LINE = "".join(f"1,{x} mm,{-0.5 * x} mm\n" for x in range(-20, 21, 5))


def file(folder: Path, text: str) -> Path:
    path = folder / "p.csv"
    path.write_text(f"replicate,x,z\n{text}", encoding="utf-8")
    return path


def test_a_profile_is_read_at_the_stations_that_it_spans(tmp_path: Path) -> None:
    _, kept, heights, _ = profile_files.read_drum_profiles(file(tmp_path, LINE), 0.03)
    assert kept == [1, 2, 3, 4, 5, 6, 7]
    places = np.array([-0.8, -0.6, -0.4, -0.2, 0.0, 0.2, 0.4, 0.6, 0.8])[kept] * 0.03
    assert heights[0] == pytest.approx(-0.5 * places, abs=1e-12)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1,29 mm,29 mm\n", r"p.csv:2: x, z: must be in the drum, within 30 mm .*got x 29 mm, z 29 mm"),
        ("1,2,3\n", r"p.csv:2: x: needs a unit of length"),
        (",2 mm,3 mm\n", r"p.csv:2: replicate: needs a label"),
        ("1,2 mm,3 mm\n1,2 mm,4 mm\n", r"p.csv:3: x: appears twice"),
        ("1,0 mm,0 mm\n1,5 mm,1 mm\n", r"must span 3 stations of the drum, got 1 in all of 1 profiles"),
        ("", r"p.csv: has no rows below the names of the columns"),
        (
            "".join(f"1,{x} mm,0 mm\n" for x in (-20, -14, -8, 0, 6, 12, 18)),
            r"p.csv:2: x: points must be at most 7.5 mm apart, got none between -8 and 0 mm",
        ),
        (
            LINE + "".join(f"2,{x} mm,{0.5 * x} mm\n" for x in range(-20, 21, 5)),
            r"p.csv:11: x, z: .*must be high on the left .*got a rise of 26.6 deg",
        ),
        (LINE + LINE.replace("1,", "2,"), r"p.csv:11: replicate 2 is a copy of replicate 1 \(.*p.csv:2\)"),
    ],
)
def test_a_bad_profile_is_refused_with_its_row(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        profile_files.read_drum_profiles(file(tmp_path, text), 0.03)


def test_a_profile_alone_has_no_scatter_to_weigh_it_by(
    write_study: Callable[..., Path], tmp_path: Path
) -> None:
    file(tmp_path, LINE)
    study = load_study(write_study((TUBE, DRUM), (ANGLE, TARGET)))
    with pytest.raises(
        InputError, match=r"p.csv: replicate: needs profiles of 3 or more replicates, got 1: 1"
    ):
        profile_responses.with_profiles(study)
    with pytest.raises(StudyError, match="with_measurements must first"):
        _ = study.target


def test_a_slope_beside_profiles_of_the_same_test_is_told(
    write_study: Callable[..., Path], tmp_path: Path
) -> None:
    rows = (
        f"{n},{x} mm,{n - 0.5 * x + 0.1 * n * (x % 10)} mm\n" for n in (1, 2, 3) for x in range(-20, 21, 5)
    )
    file(tmp_path, "".join(rows))
    slope = '[[response]]\nobservable = "dynamic_angle"\nmean = "30 deg"\nsd = "1 deg"\nn = 5\n'
    alone, both = (load_study(write_study((TUBE, DRUM), (ANGLE, TARGET), add=add)) for add in ("", slope))
    assert measured_target.with_measurements(alone)[1] == ()
    assert measured_target.with_measurements(both)[1] == (
        "dynamic_angle counts twice if it was read from the profiles of the same test",
    )


def test_profiles_of_another_test_or_observable_are_refused(write_study: Callable[..., Path]) -> None:
    bare = load_study(write_study((ANGLE, '[target]\nobservable = "outline"\n')))
    with pytest.raises(InputError, match=r'"outline" needs profiles, a file of them, or a twin'):
        profile_responses.with_profiles(bare)
    heap = load_study(write_study((ANGLE, TARGET)))
    with pytest.raises(InputError, match=r'the "surface" of a drum, .*, got surface of lifted-cylinder'):
        profile_responses.with_profiles(heap)
    other = load_study(write_study((TUBE, DRUM), (ANGLE, TARGET.replace('"surface"', '"mass_angle"'))))
    with pytest.raises(
        InputError, match=r'profiles need the observable "surface" or "outline" or .*, got mass_angle'
    ):
        profile_responses.with_profiles(other)


@pytest.mark.parametrize(
    ("weights", "rule"),
    [
        ("{ surface_1 = 1.0, surfase_2 = 1.0 }", "did you mean 'surface_"),
        ("{ surface_1 = 1.0, mass_angle = 1.0 }", "must name observables of one unit"),
    ],
)
def test_a_weighted_sum_of_what_is_not_there_is_refused(
    write_study: Callable[..., Path], weights: str, rule: str
) -> None:
    target = f'[target]\nobservable = "mix"\nweights = {weights}\nmean = "1 mm"\nsd = "1 mm"\nn = 3\n'
    with pytest.raises(StudyError, match=rule) as caught:
        load_study(write_study((TUBE, DRUM), (ANGLE, target)))
    assert caught.value.problems[0].place.endswith(": target.weights")
