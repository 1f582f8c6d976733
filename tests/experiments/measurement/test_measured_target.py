"""Targets taken from photographs and from files of measured heaps, and what is said of wrong ones."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from drawn_heaps import Camera, DrawnHeap, draw
from small_study import CONDITIONS

from doe import Sample
from experiments.io.errors import InputError
from experiments.measurement.measured_target import with_measurements
from experiments.runs.choices import check_campaign, measured_study
from experiments.studyfile import Study, load_study
from imaging import measure_photograph, save_picture

WriteStudy = Callable[..., Path]

NUMBERS = 'mean = "30 deg"\nsd = "0.5 deg"\nn = 5\n'

MEASURED = """condition,replicate,observable,value,unit
base,1,angle,24.5,deg
base,2,flank_angle,25.5,deg
base,1,t75,400,ms
base,2,t75,420,ms
base,1,height,12,mm
fast,1,angle,21,deg
fast,2,angle,23,deg
wide,1,angle,19,deg
wide,2,angle,20,deg
"""


@pytest.fixture
def from_source(write_study: WriteStudy) -> Callable[..., Study]:
    """Load the small study with a target that is to be measured."""
    return lambda source, add="": load_study(write_study((NUMBERS, f"{source}\n"), add=add))


@pytest.fixture
def photographs(tmp_path: Path) -> list[Path]:
    """Three drawn heaps in a folder next to the study."""
    (tmp_path / "photos").mkdir()
    paths = [tmp_path / "photos" / f"heap-{number}.png" for number in range(3)]
    for path, slope in zip(paths, (27.0, 29.0, 31.0), strict=True):
        save_picture(path, draw(DrawnHeap(slope, slope, 200), Camera(noise=0)))
    return paths


def test_photographs_become_mean_sd_and_n(from_source, photographs: list[Path]) -> None:
    study, notes = with_measurements(from_source('pictures = "photos/*.png"'))
    angles = [measure_photograph(path, "flank").mean for path in photographs]
    assert study.target.leading.measured == Sample.of(angles)
    # Drawn truth: 0.3 degrees is the promise for drawn heaps of 400 pixels.
    assert study.target.leading.measured.mean == pytest.approx(29.0, abs=0.3)
    assert notes == ()
    assert "heap-0.png" in study.target_section.note
    # What is kept with the results says the numbers, so that other pictures are another study.
    assert set(study.document["target"]) == {"observable", "mean", "sd", "n", "note"}


def test_pictures_are_measured_with_the_fit_of_the_study(write_study: WriteStudy, photographs) -> None:
    middle = ("[measurement]\n", '[measurement]\nfit = "middle"\n')
    path = write_study((NUMBERS, 'pictures = "photos"\n'), middle)
    study, _ = with_measurements(load_study(path))
    expected = Sample.of([measure_photograph(photograph, "middle").mean for photograph in photographs])
    assert study.target.leading.measured == expected


def test_a_picture_in_doubt_is_left_out_with_its_reason(from_source, photographs: list[Path]) -> None:
    lean = draw(DrawnHeap(24.0, 33.0, 200), Camera(noise=0))
    save_picture(photographs[1], lean)
    study, notes = with_measurements(from_source('pictures = "photos"'))
    angles = [measure_photograph(path, "flank").mean for path in (photographs[0], photographs[2])]
    assert study.target.leading.measured == Sample.of(angles)
    assert len(notes) == 1
    assert re.fullmatch(r"left out: .*heap-1.png: doubtful: lean: .*", notes[0])
    save_picture(photographs[0], draw(DrawnHeap(33.0, 24.0, 200), Camera(noise=0)))
    with pytest.raises(InputError, match=r"target.pictures: needs two measured heaps .*doubtful.*, got 1"):
        with_measurements(from_source('pictures = "photos"'))
    kept, notes = with_measurements(from_source('pictures = "photos"\nkeep_doubtful = true'))
    assert (kept.target.leading.measured.n, notes) == (3, ())


def test_the_pictures_of_a_folder_are_one_heap(from_source, photographs: list[Path]) -> None:
    for path, heap in zip(photographs, ("a", "b", "b"), strict=True):
        (path.parent / heap).mkdir(exist_ok=True)
        path.rename(path.parent / heap / path.name)
    study, _ = with_measurements(from_source('pictures = "photos"\nby = "folder"'))
    # The drawn truth of two heaps: 27, and the mean of 29 and 31.
    assert study.target.leading.measured.n == 2
    assert study.target.leading.measured.mean == pytest.approx(28.5, abs=0.3)


def test_facts_of_the_photographs_stand_in_the_study(from_source, photographs: list[Path]) -> None:
    level, _ = with_measurements(from_source('pictures = "photos"'))
    high, _ = with_measurements(from_source('pictures = "photos"\nview = { elevation = "8 deg" }'))
    # A camera that looks down sees a heap flatter than it is.
    assert high.target.leading.measured.mean > level.target.leading.measured.mean + 0.5


def test_a_copy_of_a_photograph_is_refused_with_both_before_anything_is_measured(
    from_source, photographs: list[Path]
) -> None:
    photographs[2].write_bytes(photographs[0].read_bytes())
    study = from_source('pictures = "photos"')
    message = r"target.pictures: picture 3: .*heap-2.png is a copy of .*heap-0.png"
    with pytest.raises(InputError, match=message):
        measured_study(study)
    with pytest.raises(InputError, match=message):
        check_campaign(study)


def test_every_picture_without_a_heap_is_named(from_source, photographs: list[Path]) -> None:
    for path in photographs[:2]:
        save_picture(path, np.full((300, 500, 3), 200 + int(path.stem[-1]), np.uint8))
    with pytest.raises(InputError, match=r"needs two .*heap-0.*contrast.*heap-1.*contrast.*, got 1"):
        measured_study(from_source('pictures = "photos"'))


def test_a_phones_heic_in_the_folder_is_not_passed_over(from_source, photographs: list[Path]) -> None:
    (photographs[0].parent / "IMG_1.HEIC").write_bytes(b"no picture")
    _, notes = with_measurements(from_source('pictures = "photos"'))
    assert [note for note in notes if "IMG_1.HEIC" in note and "left out" in note] == list(notes)


def test_a_file_of_heaps_becomes_a_response_for_each_observable(from_source, tmp_path: Path) -> None:
    (tmp_path / "measured.csv").write_text(MEASURED, encoding="utf-8")
    study, notes = with_measurements(from_source('file = "measured.csv"', CONDITIONS))
    found = {response.name: response for response in study.target.responses}
    assert list(found) == ["angle", "t75", "angle_fast", "angle_wide"]
    assert found["angle"].measured == Sample.of([24.5, 25.5])
    assert found["t75"].measured == Sample.of([0.4, 0.42])
    assert (found["angle_fast"].scene, found["angle_wide"].held_out) == ("fast", True)
    assert [response.name for response in study.target.fitted] == ["angle", "t75", "angle_fast"]
    # One height shows no scatter.
    assert any("height shows no scatter" in note for note in notes)
    assert study.case({}, seed=1, scene="fast").scene.lift_speed == 0.25


@pytest.mark.parametrize(
    ("asked", "leading"),
    [
        ('observable = "t75"', "t75"),
        ('observable = "angle"\nscene = "fast"', "angle_fast"),
        ('observable = "t75"\nscene = "base"', "t75"),
    ],
)
def test_the_observable_that_a_target_asks_its_file_for_leads(
    from_source, tmp_path: Path, asked: str, leading: str
) -> None:
    (tmp_path / "measured.csv").write_text(MEASURED, encoding="utf-8")
    study, _ = with_measurements(from_source(f'{asked}\nfile = "measured.csv"', CONDITIONS))
    assert study.target.leading.name == leading
    names = {response.name for response in study.target.responses}
    assert names == {"angle", "t75", "angle_fast", "angle_wide"}


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ('observable = "height"', r"two different values .* height shows no scatter.*, got height \("),
        ('observable = "r90"', r"measured.csv has angle \(base\), t75 \(base\), angle \(fast\), "),
        ('observable = "t75"\nscene = "fast"', r"got t75 \(fast\)"),
        ('observable = "angle"\nscene = "wide"', r"got angle \(wide\)"),
    ],
)
def test_an_observable_that_the_file_does_not_have_is_refused(
    from_source, tmp_path: Path, asked: str, message: str
) -> None:
    (tmp_path / "measured.csv").write_text(MEASURED, encoding="utf-8")
    with pytest.raises(InputError, match=message) as error:
        with_measurements(from_source(f'{asked}\nfile = "measured.csv"', CONDITIONS))
    assert error.value.place.endswith("target.observable")


def test_a_file_measured_under_held_out_conditions_alone_leads_nowhere(from_source, tmp_path: Path) -> None:
    rows = [line for line in MEASURED.splitlines() if line.startswith(("condition", "wide"))]
    (tmp_path / "measured.csv").write_text("\n".join(rows), encoding="utf-8")
    with pytest.raises(InputError, match="not held out"):
        with_measurements(from_source('file = "measured.csv"', CONDITIONS))


@pytest.mark.parametrize(
    ("source", "place", "rule"),
    [
        (f'{NUMBERS}fit = "middle"', "target.fit", "the fit of the study"),
        (f'{NUMBERS}fit = "midle"', "target.fit", "must be one of flank, trimmed, middle"),
        ('pictures = "photos"', "target.pictures", "at least two pictures"),
        ('file = "none.csv"', "none.csv", "file"),
        (f'{NUMBERS}pictures = "a"', "target.pictures", "only one of these"),
        ('pictures = "a"\nfile = "b.csv"', "target.pictures", "only one of these"),
        (f'{NUMBERS}by = "folder"', "target.by", "option of pictures"),
        ('pictures = "photos"\nview = { heap = 0 }', "target.view", "must be 1 or more"),
    ],
)
def test_measurements_that_cannot_be_used_are_refused(
    from_source, source: str, place: str, rule: str
) -> None:
    with pytest.raises(InputError) as error:
        measured_study(from_source(source))
    assert rule in error.value.problem
    assert error.value.place.endswith(place)


def test_angles_of_a_file_say_how_they_were_fitted(from_source, tmp_path: Path) -> None:
    rows = "condition,replicate,observable,value,fit\nbase,1,angle,25,flank\nbase,2,angle,26,middle\n"
    (tmp_path / "measured.csv").write_text(rows, encoding="utf-8")
    with pytest.raises(InputError, match="the fit of the study") as error:
        with_measurements(from_source('file = "measured.csv"'))
    assert error.value.place.endswith("measured.csv:3: fit")


def test_numbers_must_be_taken_before_a_target_is_read(from_source) -> None:
    study = from_source('pictures = "photos"')
    with pytest.raises(InputError, match="with_measurements must first"):
        study.target  # noqa: B018


def test_a_target_of_heap_files_takes_the_types_that_are_grain(from_source, tmp_path: Path) -> None:
    """Two heaps of LIGGGHTS' data of another test, with and without a wall of another type above."""
    source = Path(__file__).parents[1] / "grains/spheres/data/yade_spheres.txt"
    grains = np.loadtxt(source)[:, :4]
    for number in range(2):
        heap = grains * (1.0 + 1e-3 * number)
        rows = [(*row, 1) for row in heap] + [(0.0, 0.0, 0.08, 0.002 + 0.001 * number, 3)]
        table = "x,y,z,r,type\n" + "".join("{:.7f},{:.7f},{:.7f},{:.7f},{}\n".format(*row) for row in rows)
        (tmp_path / f"heap-{number}.csv").write_text(table, "utf-8")
    study, notes = with_measurements(from_source('pictures = "heap-*.csv"\ntypes = [1]\nfit = "flank"'))
    # the same heap, a thousandth larger
    assert study.target.leading.measured.sd < 0.1
    assert all("3 (1 spheres); only 1 measured" in note for note in notes[:2])
