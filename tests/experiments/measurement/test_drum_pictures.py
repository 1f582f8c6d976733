"""Pictures of rotating drums as targets, in measured files, in files of profiles and on the command line."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from commandline import dem_warp
from drawn_drums import draw_drum
from drawn_heaps import DrawnHeap, draw
from small_study import TUBE

from experiments.io.errors import InputError
from experiments.measurement.measured_file import read_measured
from experiments.measurement.measured_target import with_measurements
from experiments.measurement.measured_template import write_measured_template
from experiments.measurement.profile_files import read_drum_profiles
from experiments.studyfile import load_study
from imaging import save_picture

DRUM = '[scene.drum]\ndiameter = "60 mm"\nlength = "20 mm"\nrotation_rate = "30 1/min"\n'
ANGLES = (30.0, 32.0, 35.0)
LEVEL = -0.15
"""Height of the turned surface of the drawn drums [radii]."""
INNER = np.linspace(-0.6, 0.6, 7) * 0.042
"""Stations of a drum of 84 mm that the drawn surfaces span [m]."""
NUMBERS = 'mean = "30 deg"\nsd = "0.5 deg"\nn = 5\n'


@pytest.fixture
def drums(tmp_path: Path) -> Path:
    """Three drawn drums in a folder next to the study; the last turns the other way."""
    folder = tmp_path / "drums"
    folder.mkdir()
    for number, angle in enumerate(ANGLES):
        save_picture(folder / f"{number}.png", draw_drum(angle, LEVEL, speckle=0.1, mirrored=number == 2))
    return folder


def target(observable: str) -> tuple[tuple[str, str], ...]:
    return (TUBE, DRUM), (NUMBERS, f'observable = "{observable}"\npictures = "drums"\n')


def heights(angle: float, radius: float, places: np.ndarray) -> np.ndarray:
    """Heights of the drawn surface at places from the axis [m]."""
    turn = np.radians(angle)
    return (LEVEL * radius - places * np.sin(turn)) / np.cos(turn)


def test_pictures_of_a_drum_are_the_target(write_study: Callable[..., Path], drums: Path) -> None:
    study, notes = with_measurements(load_study(write_study(*target("dynamic_angle"))))
    measured = study.target.leading.measured
    # The promise for drawn drums; notes would say what was left out.
    assert (measured.n, notes) == (3, ())
    assert measured.mean == pytest.approx(np.mean(ANGLES), abs=0.3)


def test_pictures_of_a_drum_are_a_profile(write_study: Callable[..., Path], drums: Path) -> None:
    study, _ = with_measurements(load_study(write_study(*target("surface"))))
    leading = study.target.leading
    weights = dict(leading.weights)
    assert weights.keys() == {f"surface_{number}" for number in range(1, 10)}
    places = np.linspace(-0.8, 0.8, 9) * 0.03
    shell = np.sqrt(0.03**2 - places**2)
    drawn = [np.clip(heights(angle, 0.03, places), -shell, shell) for angle in ANGLES]
    # .3 mm at a drum of 84 mm is .2 mm at this one, in each of nine heights whose weights have the length 1.
    seen = [list(weights.values()) @ each for each in drawn]
    np.testing.assert_allclose(leading.measurements, seen, atol=0.6e-3)


def test_heaps_are_no_target_of_a_drum(write_study: Callable[..., Path], drums: Path) -> None:
    with pytest.raises(InputError, match=r"target.pictures: .* dynamic_angle or surface .*, got upper_angle"):
        with_measurements(load_study(write_study(*target("upper_angle"))))
    for number in range(3):
        save_picture(drums / f"{number}.png", draw(DrawnHeap(30 + number, 31)))
    with pytest.raises(InputError, match=r"0\.png: no drum"):
        with_measurements(load_study(write_study(*target("dynamic_angle"))))


def test_files_of_measurements_and_profiles_name_pictures(
    write_study: Callable[..., Path], drums: Path, tmp_path: Path
) -> None:
    path = write_study((TUBE, DRUM), add="[condition.base]\n")
    (path.parent / "m.csv").write_text(
        "condition,replicate,observable,picture\nbase,1,,drums/0.png\nbase,2,dynamic_angle,drums/1.png\n",
        encoding="utf-8",
    )
    measured = read_measured(path.parent / "m.csv", load_study(path))
    column = measured.observables.index("dynamic_angle")
    np.testing.assert_allclose(measured.values["base"][:, column], ANGLES[:2], atol=0.3)
    assert "surface_5" in measured.observables
    (tmp_path / "p.csv").write_text(
        "replicate,picture\n1,drums/0.png\n1,drums/1.png\n2,drums/2.png\n", encoding="utf-8"
    )
    found = read_drum_profiles(tmp_path / "p.csv", 0.042)
    assert (found.names, len(found.views[0])) == (["1", "2"], 2)
    # The promise: .3 mm.
    np.testing.assert_allclose(found.heights[1][1:8], heights(ANGLES[2], 0.042, INNER), atol=0.3e-3)


def test_a_doubtful_or_missing_picture_is_refused_with_its_row(tmp_path: Path) -> None:
    save_picture(tmp_path / "flat.png", draw_drum(2.0))
    (tmp_path / "p.csv").write_text("replicate,picture\n1,flat.png\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"p.csv:2: picture: is doubtful: range"):
        read_drum_profiles(tmp_path / "p.csv", 0.042)
    (tmp_path / "p.csv").write_text("replicate,picture\n1,none.png\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"p.csv:2: picture: has no measurable drum: .*no such file"):
        read_drum_profiles(tmp_path / "p.csv", 0.042)


def test_the_template_of_a_drum_asks_for_pictures(write_study: Callable[..., Path], tmp_path: Path) -> None:
    path = write_measured_template(load_study(write_study((TUBE, DRUM))), tmp_path)
    assert "picture of the drum along its axis" in path.read_text(encoding="utf-8")


def test_the_command_reads_drums(drums: Path) -> None:
    pictures = [str(path) for path in sorted(drums.iterdir())]
    code, out, _ = dem_warp(
        "angle", "--drum", *pictures, "--diameter", "84 mm", "--json", "--overlay", str(drums / "o")
    )
    rows = json.loads(out)["pictures"]
    assert code == 0
    assert [row["turns"] for row in rows] == ["clockwise", "clockwise", "anticlockwise"]
    for row, angle in zip(rows, ANGLES, strict=True):
        assert row["mean"] == pytest.approx(angle, abs=0.3)
        assert row["surface_5"] == pytest.approx(heights(angle, 0.042, INNER)[3], abs=0.3e-3)
        assert Path(row["overlay"]).is_file()
    assert "drums" in dem_warp("angle", "--drum", *pictures)[1]
    assert 'observable = "dynamic_angle"' in dem_warp("angle", "--drum", *pictures, "--target")[1]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((), "shows a rotating drum. Use --drum."),
        (
            ("--drum", "--plate", "1,2,3,4"),
            "0.png, plate: is for a photograph; this file is read as a picture of a drum.",
        ),
        (
            ("--circle", "1,2,3"),
            "0.png, circle: is for a picture of a drum; this file is read as a photograph. Use --drum.",
        ),
        (("--drum", "--circle", "1,2"), "--circle: must be three numbers X,Y,R, got 1,2"),
        (("--drum", "--diameter", "-1 mm"), "--diameter: must be positive, got -1 mm"),
    ],
)
def test_wrong_options_are_refused(drums: Path, options: tuple[str, ...], message: str) -> None:
    code, _, error = dem_warp("angle", str(drums / "0.png"), *options)
    assert code == 2
    assert message in " ".join(error.split())
