"""The command for photographs: rows that no other picture costs, names, and means over heaps."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from commandline import dem_warp

from experiments.evidence.accuracy.photographs.camera import PhoneCamera
from experiments.evidence.accuracy.photographs.rendering import sharp_shadow
from experiments.evidence.accuracy.photographs.sampling import photograph, photograph_in_hard_light
from experiments.evidence.accuracy.photographs.without import picture_without_heap
from experiments.measurement import photographs
from experiments.measurement.photographs import drawn_names, mean_angle, measure_pictures
from imaging import measure, save_picture
from imaging.drawing.synthetic import Camera, DrawnHeap, draw


@pytest.mark.parametrize("forms", [("--csv", "--json"), ("--target", "--json"), ("--csv", "--target")])
def test_two_forms_of_the_result_at_once_are_refused(tmp_path: Path, forms: tuple[str, str]) -> None:
    save_picture(tmp_path / "heap.png", draw(DrawnHeap(28.0, 28.0), Camera(noise=0)))
    code, out, err = dem_warp("angle", tmp_path / "heap.png", *forms)
    assert (code, out) == (2, "")
    assert "only one of --target, --csv and --json" in err
    assert all(form in err.partition("got")[2] for form in forms)


@pytest.mark.parametrize(
    "error", [MemoryError(), OSError("the disk is gone"), np.linalg.LinAlgError("singular"), cv2.error("bad")]
)
def test_one_picture_that_breaks_costs_the_others_nothing(tmp_path: Path, monkeypatch, error) -> None:
    good = save_picture(tmp_path / "good.png", draw(DrawnHeap(30, 30)))
    bad = save_picture(tmp_path / "bad.png", draw(DrawnHeap(30, 30)))
    measured = photographs.measure_photograph

    def breaks(path, fit, view):
        if path == bad:
            raise error
        return measured(path, fit, view)

    monkeypatch.setattr(photographs, "measure_photograph", breaks)
    rows = measure_pictures([bad, good, bad], overlay_folder=tmp_path / "drawn")
    assert [row["mean"] is None for row in rows] == [True, False, True]
    assert all("bad.png" in row["reason"] for row in (rows[0], rows[2]))
    assert [path.name for path in (tmp_path / "drawn").iterdir()] == ["good-angle.png"]


def test_a_copy_that_cannot_be_drawn_keeps_its_angle(tmp_path: Path, monkeypatch) -> None:
    picture = save_picture(tmp_path / "good.png", draw(DrawnHeap(30, 30)))

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
    each, heaps = mean_angle(rows), mean_angle(rows, "folder")
    assert (each.n, each.mean) == (3, pytest.approx(95.0 / 3.0))
    assert (heaps.n, heaps.mean, heaps.pictures) == (2, 32.0, 3)
    assert heaps.sd == pytest.approx(np.sqrt(2.0))
    # Student's t of one degree of freedom at 97.5 %: 12.706.
    assert heaps.high - heaps.mean == pytest.approx(12.7062 * heaps.sd / np.sqrt(2.0), rel=1e-5)


def test_doubtful_pictures_are_left_out_unless_told() -> None:
    rows = [row("1.jpg", 30.0), row("2.jpg", 31.0), row("3.jpg", 50.0, ("lean: ...",))]
    kept = mean_angle(rows)
    assert (kept.n, kept.mean, kept.left_out) == (2, 30.5, ("3.jpg",))
    assert mean_angle(rows, keep_doubtful=True).mean == pytest.approx(37.0)
    assert mean_angle(rows[2:]) is None
    alone = mean_angle(rows[:1])
    assert (alone.n, alone.sd, alone.low) == (1, None, None)


def test_rows_say_how_the_picture_was_seen(tmp_path: Path) -> None:
    picture = draw(DrawnHeap(30, 30), Camera(plate=(90, 90, 90), tilt=3.0))
    (measured,) = measure_pictures([save_picture(tmp_path / "one.png", picture)])
    assert measured["tilt"] == pytest.approx(3.0, abs=0.3)
    assert measured["low"] < measured["mean"] < measured["high"]
    x1, y1, x2, y2 = measured["plate"]
    assert np.degrees(np.arctan2(y2 - y1, x2 - x1)) == pytest.approx(measured["tilt"])
    assert measured["heap_pixels"] == pytest.approx(400, abs=6)


def test_a_boards_underside_is_not_taken_for_the_ground() -> None:
    """A board with slanting ends, a little wider than its heap: its outline is 2.9 degrees flatter."""
    shot = photograph(600452)
    seen = measure(shot.picture)
    # 95 % of the pictures are within 0.8 degrees.
    assert seen.mean == pytest.approx(shot.truth.mean, abs=0.8)
    assert seen.doubts == ()


def test_a_threshold_that_only_a_shadow_moves_is_no_doubt() -> None:
    """Without shadows both thresholds show one edge, and so does one of the plain ones."""
    shot = photograph(700254)
    angle = measure(shot.picture)
    assert angle.doubts == ()
    # Two of its standard errors, .35.
    assert angle.mean == pytest.approx(shot.truth.mean, abs=0.7)


def test_what_one_threshold_alone_shows_of_grains_like_the_wall_is_doubted() -> None:
    shot = photograph(700097)
    assert "threshold" in [doubt.name for doubt in measure(shot.picture).doubts]


def test_a_drawn_shadow_is_as_large_as_the_lamp_throws_it() -> None:
    """A ball of radius r at distance D before a lamp shades a disc of r (D + d) / D on a wall d behind it."""
    camera = PhoneCamera(columns=800, rows=600)
    across, up = np.meshgrid(np.linspace(-1.0, 1.0, 401), np.linspace(-1.0, 1.0, 401))
    wall = np.stack([across, np.full_like(across, 2.0), up], axis=-1).astype(np.float32)
    ball = (np.array([[0.0, 0.0, 0.0]]), np.array([0.2]))
    hidden = sharp_shadow(wall, (0.0, -4.0, 0.0), 0.0, ball, camera)
    # A pixel of the lamp's view is a hundredth of the radius.
    assert np.sqrt(hidden.sum() * 0.005**2 / np.pi) == pytest.approx(0.3, rel=0.02)
    beside = sharp_shadow(wall, (-4.0, -4.0, 0.0), 0.0, ball, camera)
    assert beside.sum() == 0.0


def test_a_sharp_shadow_on_the_wall_is_taken_off() -> None:
    """A bright heap on a grey wall: with its shadow it is 2.4 degrees flatter."""
    shot = photograph_in_hard_light(800119)
    angle = measure(shot.picture)
    assert angle.doubts == ()
    # 95 % of the pictures are within 0.8 degrees.
    assert angle.mean == pytest.approx(shot.truth.mean, abs=0.8)


@pytest.mark.parametrize("seed", [800021, 800034])
def test_a_sharp_shadow_that_cannot_be_taken_off_is_doubted(seed: int) -> None:
    assert "shade" in [doubt.name for doubt in measure(photograph_in_hard_light(seed).picture).doubts]


@pytest.mark.parametrize("seed", [940281, 940463])
def test_a_few_even_windows_between_grains_are_no_shadow(seed: int) -> None:
    """Along a sixth of a flank these have the hue of the wall, which its pattern widens: .4 degrees."""
    shot = photograph(seed)
    angle = measure(shot.picture)
    assert angle.doubts == ()
    # 95 % of the pictures are within 0.8 degrees.
    assert angle.mean == pytest.approx(shot.truth.mean, abs=0.8)


@pytest.mark.parametrize("seed", [940291, 940315])
def test_a_shadow_that_fades_away_from_the_foot_is_no_dish(seed: int) -> None:
    """From above the foot's shadow is seen on the plate: a tenth of the width below it half of it is left."""
    shot = photograph(seed)
    angle = measure(shot.picture)
    assert angle.doubts == ()
    assert angle.mean == pytest.approx(shot.truth.mean, abs=0.8)


def test_a_dish_of_the_walls_hue_is_doubted() -> None:
    kind, picture = picture_without_heap(940094)
    assert kind == "dish"
    assert "shade" in [doubt.name for doubt in measure(picture).doubts]
