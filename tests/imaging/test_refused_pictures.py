"""Refused pictures and settings, and angles that may not be compared."""

import numpy as np
import pytest
from drawn_heaps import Camera, DrawnHeap, draw

import imaging
from imaging import FitSettings, PictureError, compare, heap_angle, measure, measure_photograph, save_picture

SCENE = Camera(
    heap=(60, 95, 135),
    background=(190, 140, 90),
    plate=(70, 75, 80),
    texture=0.15,
    light=0.4,
    noise=5,
    tilt=3,
)


def test_photograph_of_a_whole_scene(tmp_path) -> None:
    picture = draw(DrawnHeap(27, 33), SCENE)
    np.testing.assert_array_equal(
        imaging.read_picture(save_picture(tmp_path / "scene.png", picture)), picture
    )
    angle = measure_photograph(save_picture(tmp_path / "scene.jpg", picture))
    # The promise for smooth heaps of 400 pixels.
    np.testing.assert_allclose([angle.left, angle.right], [27, 33], atol=0.3, rtol=0)


def noise_only() -> np.ndarray:
    return np.random.default_rng(0).normal(128, 20, (300, 500, 3)).clip(0, 255).astype(np.uint8)


def two_heaps() -> np.ndarray:
    return np.hstack([draw(DrawnHeap(25, 25, 200))] * 5)


def plate_without_heap() -> np.ndarray:
    picture = np.full((300, 500, 3), 230, np.uint8)
    picture[200:] = 60
    return picture


@pytest.mark.parametrize(
    ("picture", "reason"),
    [
        (np.full((300, 500, 3), 200, np.uint8), "no contrast"),
        # The median length of three normal deviates, 1.54, times 20, less the smoothing along rows.
        (noise_only(), r"too uneven, by 2\d of 255"),
        (plate_without_heap(), r"nothing above the plate|no contrast"),
        (draw(DrawnHeap(30, 30), SCENE)[:, :300], "cropped by the right border"),
        (draw(DrawnHeap(30, 30), SCENE)[:, 150:370], "cropped by the left and right borders"),
        (draw(DrawnHeap(30, 30))[:, 120:], "cropped by the left border"),
        (draw(DrawnHeap(30, 30))[80:], "cropped by the top border"),
        (two_heaps(), "heaps or objects of similar size"),
        (np.zeros((4, 4, 3), np.uint8), "at least 16 rows"),
        (np.zeros((300, 500, 3)), "uint8"),
    ],
)
def test_picture_without_a_whole_heap_is_refused_with_its_reason(picture: np.ndarray, reason: str) -> None:
    with pytest.raises(PictureError, match=reason) as caught:
        measure(picture, place="tray 7")
    assert caught.value.place.startswith("tray 7")
    assert isinstance(caught.value, ValueError)


def test_missing_and_foreign_files_are_named(tmp_path) -> None:
    with pytest.raises(PictureError, match=r"nowhere\.png.*no such file"):
        measure_photograph(tmp_path / "nowhere.png")
    with pytest.raises(PictureError, match=r"is a folder: name the files in it"):
        measure_photograph(tmp_path)
    text = tmp_path / "notes.png"
    text.write_text("no picture")
    with pytest.raises(PictureError, match=r"notes\.png"):
        measure_photograph(text)
    with pytest.raises(PictureError, match=r"\.heap"):
        save_picture(tmp_path / "picture.heap", np.zeros((20, 20, 3), np.uint8))
    assert not (tmp_path / "picture.heap").exists()


def test_angles_of_different_fits_are_not_compared() -> None:
    picture = draw(DrawnHeap(27, 33), Camera(noise=5))
    flank, middle = measure(picture), measure(picture, "middle")
    with pytest.raises(PictureError, match="same fit"):
        compare(flank, middle)
    difference = compare(flank, flank)
    assert (difference.value, difference.se) == (0.0, pytest.approx(np.sqrt(2.0) * flank.se))


def test_every_named_fit_measures_a_straight_flank() -> None:
    picture = draw(DrawnHeap(27, 33))
    for name in imaging.FITS:
        angle = measure(picture, name)
        assert angle.fit.name == name
        # The promise for whole flanks of this size.
        np.testing.assert_allclose([angle.left, angle.right], [27, 33], atol=0.3, rtol=0)


@pytest.mark.parametrize(
    "make",
    [
        lambda: FitSettings("backwards", 0.8, 0.2),
        lambda: FitSettings("too high", 0.0, 1.2),
        lambda: FitSettings("toe", 0.0, 1.0, toe=-1.0),
        lambda: FitSettings.of("whole"),
        lambda: imaging.snapshot([[0.0, 0.0, 1.0]], [1.0], backend="opengl"),
        lambda: heap_angle([[0.0, 0.0, 1.0]], [1.0], azimuths=1),
        lambda: measure(draw(DrawnHeap(30, 30))).interval(1.5),
    ],
)
def test_wrong_settings_are_refused(make) -> None:
    with pytest.raises(PictureError):
        make()


def test_views_without_a_measurable_heap_are_named() -> None:
    # The grain count is given, as for clumps.
    two_balls = [[-0.02, 0.0, 0.01], [0.02, 0.0, 0.01]]
    with pytest.raises(PictureError, match=r"fewer than two views.*view at 0\.0 degrees.*several pieces"):
        heap_angle(two_balls, 0.01, azimuths=[0.0, np.pi], grain_count=30)
    # One behind the other they are one heap: such views count, and the others are named.
    some = heap_angle(two_balls, 0.01, azimuths=[0.0, 0.5 * np.pi, 1.5 * np.pi], grain_count=30)
    assert (len(some.views), len(some.rejections)) == (2, 1)


def test_tower_is_no_heap() -> None:
    with pytest.raises(PictureError, match="radii"):
        heap_angle([[0.0, 0.0, 1.0]], [0.01], grain_count=30)
