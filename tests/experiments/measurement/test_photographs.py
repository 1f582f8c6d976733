"""Measured pictures: one row for each, names of copies, and means over heaps."""

import tomllib
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from commandline import dem_warp, refused
from drawn_heaps import Camera, DrawnHeap, draw

from experiments.measurement import photographs
from experiments.measurement.heap_files import READINGS
from experiments.measurement.photographs import PictureOptions, drawn_names, mean_angle, measure_pictures
from imaging import save_picture


@pytest.mark.parametrize("forms", [("--csv", "--json"), ("--target", "--json")])
def test_two_forms_of_the_result_at_once_are_refused(tmp_path: Path, forms: tuple[str, str]) -> None:
    save_picture(tmp_path / "heap.png", draw(DrawnHeap(28.0, 28.0, 200), Camera(noise=0)))
    err = refused("angle", tmp_path / "heap.png", *forms)
    assert "only one of --target, --csv and --json" in err
    assert all(form in err.partition("got")[2] for form in forms)


@pytest.mark.parametrize(
    ("option", "subject"),
    [
        (("--crop", "1,2,3,4"), "photograph"),
        (("--elevation", "0"), "photograph"),
        (("--plate", "1,9,30,9"), "photograph"),
        (("--circle", "1,2,3"), "picture of a drum"),
        (("--drum",), "picture of a drum"),
        (("--unit", "mm"), "file of spheres"),
        (("--plate-height", "0 mm"), "file of spheres"),
        (("--type", "1"), "file of spheres"),
    ],
)
def test_an_option_that_a_file_does_not_use_is_named(
    tmp_path: Path, option: tuple[str, ...], subject: str
) -> None:
    save_picture(tmp_path / "heap.png", draw(DrawnHeap(28.0, 28.0, 200), Camera(noise=0)))
    (tmp_path / "heap.csv").write_text("x,y,z,r\n0,0,1,1\n2,0,1,1\n", encoding="utf-8")
    name = "heap.png" if subject == "file of spheres" else "heap.csv"
    err = refused("angle", tmp_path / name, *option)
    assert f"{name}, {option[0].strip('-').replace('-', '_')}" in err
    assert f"is for a {subject}; this file is read as a" in err


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (MemoryError(), "does not fit into memory"),
        (OSError("the disk is gone"), "measuring failed: OSError"),
        (cv2.error("bad"), "measuring failed: error"),
    ],
)
def test_a_failed_picture_does_not_affect_the_others(tmp_path: Path, monkeypatch, error, reason) -> None:
    good = save_picture(tmp_path / "good.png", draw(DrawnHeap(30, 30, 200)))
    bad = save_picture(tmp_path / "bad.png", draw(DrawnHeap(30, 30, 200)))
    measured = photographs.measure_photograph

    def breaks(path, fit, view):
        if path == bad:
            raise error
        return measured(path, fit, view)

    monkeypatch.setattr(photographs, "measure_photograph", breaks)
    rows = measure_pictures([bad, good, bad], overlay_folder=tmp_path / "drawn")
    assert [row["mean"] is None for row in rows] == [True, False, True]
    assert all("bad.png" in row["reason"] and reason in row["reason"] for row in (rows[0], rows[2]))
    assert [path.name for path in (tmp_path / "drawn").iterdir()] == ["good-angle.png"]


def test_a_copy_that_cannot_be_drawn_keeps_its_angle(tmp_path: Path, monkeypatch) -> None:
    picture = save_picture(tmp_path / "good.png", draw(DrawnHeap(30, 30, 200)))

    def full(path, image):
        raise OSError("no space left")

    monkeypatch.setattr(photographs, "save_picture", full)
    (row,) = measure_pictures([picture], overlay_folder=tmp_path / "drawn")
    assert row["mean"] == pytest.approx(30.0, abs=0.3)
    assert "drawing failed" in row["reason"]


def test_copies_of_pictures_with_one_name_have_several() -> None:
    paths = ["a/x/one.jpg", "b/x/one.jpg", "two.jpg", "two.png", "c/three.jpg", "c/three.jpg"]
    names = drawn_names([Path(path) for path in paths])
    assert len(set(names)) == len(paths)
    assert drawn_names([Path("photos/one.jpg"), Path("photos/two.jpg")]) == ["one-angle.png", "two-angle.png"]
    assert drawn_names([Path("a/one.jpg"), Path("b/one.jpg")]) == [
        "a_one-jpg-angle.png",
        "b_one-jpg-angle.png",
    ]


def row(picture: str, mean: float | None, doubts: tuple[str, ...] = ()) -> dict:
    return {"picture": picture, "mean": mean, "doubts": list(doubts)}


def test_views_of_one_heap_count_once() -> None:
    rows = [row("a/1.jpg", 30.0), row("a/2.jpg", 32.0), row("b/1.jpg", 33.0), row("b/2.jpg", None)]
    each, heaps = mean_angle(rows), mean_angle(rows, PictureOptions(by="folder"))
    assert (each.n, each.mean) == (3, pytest.approx(95.0 / 3.0))
    assert (heaps.n, heaps.mean, heaps.pictures) == (2, 32.0, 3)
    assert heaps.sd == pytest.approx(np.sqrt(2.0))
    # Student's t of one degree of freedom at 97.5 %: 12.706.
    assert heaps.high - heaps.mean == pytest.approx(12.7062 * heaps.sd / np.sqrt(2.0), rel=1e-5)


def test_doubtful_pictures_are_left_out_unless_kept() -> None:
    rows = [row("1.jpg", 30.0), row("2.jpg", 31.0), row("3.jpg", 50.0, ("lean: ...",))]
    kept = mean_angle(rows)
    assert (kept.n, kept.mean, kept.left_out) == (2, 30.5, ("3.jpg",))
    assert mean_angle(rows, PictureOptions(keep_doubtful=True)).mean == pytest.approx(37.0)
    assert mean_angle(rows[2:]) is None
    alone = mean_angle(rows[:1])
    assert (alone.n, alone.sd, alone.low) == (1, None, None)


def test_rows_have_the_tilt_and_the_plate(tmp_path: Path) -> None:
    picture = draw(DrawnHeap(30, 30), Camera(plate=(90, 90, 90), tilt=3.0))
    (measured,) = measure_pictures([save_picture(tmp_path / "one.png", picture)])
    assert measured["tilt"] == pytest.approx(3.0, abs=0.3)
    assert measured["low"] < measured["mean"] < measured["high"]
    x1, y1, x2, y2 = measured["plate"]
    assert np.degrees(np.arctan2(y2 - y1, x2 - x1)) == pytest.approx(measured["tilt"])
    assert measured["heap_pixels"] == pytest.approx(400, abs=6)
    # Every reading of straight flanks is their angle, to a pixel or two of 115 in height.
    for reading in READINGS:
        assert measured[reading] == pytest.approx(30.0, abs=0.8)


def test_a_target_has_its_fit_as_a_key_and_doubts_are_printed_without_one(tmp_path: Path) -> None:
    for number, slope in enumerate((27.0, 29.0)):
        save_picture(tmp_path / f"heap-{number}.png", draw(DrawnHeap(slope, slope, 200), Camera(noise=0)))
    code, out, _ = dem_warp("angle", *sorted(tmp_path.glob("heap-*.png")), "--target", "--fit", "middle")
    assert code == 0
    assert tomllib.loads(out)["target"]["fit"] == "middle"
    for number in range(2):
        save_picture(
            tmp_path / f"leaning-{number}.png", draw(DrawnHeap(22.0, 33.0 + number, 200), Camera(noise=0))
        )
    err = refused("angle", *sorted(tmp_path.glob("leaning-*.png")), "--target")
    assert "needs two measured heaps" in err
    assert err.count("Doubtful:") == 2


def test_many_pictures_show_their_progress(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    picture = save_picture(tmp_path / "heap.png", draw(DrawnHeap(30.0, 30.0, 200), Camera(noise=0)))
    clock = iter(range(0, 1000, 60))
    # The module's own name: other threads of this process ask the clock too.
    monkeypatch.setattr("experiments.commands.console.time", SimpleNamespace(monotonic=lambda: next(clock)))
    _, _, err = dem_warp("angle", *[picture] * 4, "--json")
    assert "pictures: 1 of 4, 3 min 0 s left" in " ".join(err.split())
