"""Films: pictures of moving grains, in files that other programs read."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image, ImageSequence

from imaging import PictureError
from imaging.drawing.film import Scenery, save_film

SCENERY = Scenery(half_width=0.05, height=0.06, pixels=400)
METERS_PER_PIXEL = 0.1 / 400
GROUND = 0.06 / METERS_PER_PIXEL
"""Row of the plate."""


def square(left: float, right: float, low: float, high: float) -> np.ndarray:
    """Two triangles that make a rectangle, seen from the front [m]."""
    corners = np.array([[left, 0.0, low], [right, 0.0, low], [right, 0.0, high], [left, 0.0, high]])
    return corners[[[0, 1, 2], [0, 2, 3]]]


def empty() -> np.ndarray:
    return SCENERY.draw(np.zeros((0, 3)), [], [], [], "")


def changed(picture: np.ndarray) -> tuple[float, float, float, float]:
    """Left, right, low and high of what differs from the empty plate [m]."""
    rows, columns = np.nonzero((picture != empty()).any(axis=2))
    sides = (np.array([columns.min(), columns.max() + 1]) - 200) * METERS_PER_PIXEL
    heights = (GROUND - np.array([rows.max() + 1, rows.min()])) * METERS_PER_PIXEL
    return (*sides, *heights)


def test_spheres_are_drawn_at_their_places() -> None:
    picture = SCENERY.draw([[0.01, 0.0, 0.02]], [0.004], [0], [], "")
    # A pixel either way.
    assert changed(picture) == pytest.approx((0.006, 0.014, 0.016, 0.024), abs=1.5 * METERS_PER_PIXEL)


def test_walls_are_seen_through() -> None:
    sphere = ([[0.01, 0.0, 0.02]], [0.004], [0])
    wall = square(-0.02, 0.02, 0.01, 0.04)
    behind, clear = SCENERY.draw(*sphere, [wall], ""), SCENERY.draw(*sphere, [], "")
    # Its rim, smoothed, is up to three pixels from the edge.
    assert changed(behind) == pytest.approx((-0.02, 0.02, 0.01, 0.04), abs=3.5 * METERS_PER_PIXEL)
    row, column = round(GROUND - 0.02 / METERS_PER_PIXEL), round(200 + 0.01 / METERS_PER_PIXEL)
    seen, bare = behind[row, column].astype(float), clear[row, column].astype(float)
    white = empty()[row, column].astype(float)
    assert 0.0 < np.abs(seen - bare).max() < 0.3 * np.abs(white - bare).max()


def test_the_time_is_written_above() -> None:
    *_, low, high = changed(SCENERY.draw(np.zeros((0, 3)), [], [], [], "0.12 s, fill"))
    assert 0.05 < low < high <= 0.06


def test_spheres_outside_the_picture_are_no_error() -> None:
    outside = SCENERY.draw([[0.0, 0.2, 0.01]], [0.004], [0], [square(0.2, 0.3, 0.0, 0.1)], "")
    np.testing.assert_array_equal(outside, empty())


@pytest.fixture
def pictures() -> list[np.ndarray]:
    """Return a ball that goes from left to right."""
    return [SCENERY.draw([[x, 0.0, 0.01]], [0.008], [0], [], "") for x in (-0.03, 0.0, 0.03)]


def middle(picture: np.ndarray) -> float:
    """Column of the ball [m], found by its colour."""
    blue, red = picture[:, :, 0].astype(int), picture[:, :, 2].astype(int)
    return float((np.nonzero(red - blue > 30)[1].mean() + 0.5 - 200) * METERS_PER_PIXEL)


def test_a_gif_shows_the_pictures(tmp_path: Path, pictures: list[np.ndarray]) -> None:
    save_film(tmp_path / "a.gif", pictures, 0.08)
    with Image.open(tmp_path / "a.gif") as film:
        assert (film.n_frames, film.info["loop"], film.info["duration"]) == (3, 0, 80)
        shown = [np.array(frame.convert("RGB"))[:, :, ::-1] for frame in ImageSequence.Iterator(film)]
    assert [middle(picture) for picture in shown] == pytest.approx([-0.03, 0.0, 0.03], abs=5e-4)


def test_an_mp4_shows_the_pictures(tmp_path: Path, pictures: list[np.ndarray]) -> None:
    place = tmp_path / "süß und rund.mp4"
    save_film(place, pictures, 0.1)
    film = cv2.VideoCapture(str(place))
    assert film.get(cv2.CAP_PROP_FPS) == pytest.approx(10.0)
    shown = [film.read() for _ in range(4)]
    assert [found for found, _ in shown] == [True, True, True, False]
    assert [middle(picture) for _, picture in shown[:3]] == pytest.approx([-0.03, 0.0, 0.03], abs=1e-3)


@pytest.mark.parametrize(
    ("name", "count", "rule"), [("a.avi", 1, "must end in"), ("a.gif", 0, "at least one")]
)
def test_other_films_are_refused(tmp_path: Path, name: str, count: int, rule: str) -> None:
    with pytest.raises(PictureError, match=rule):
        save_film(tmp_path / name, [empty()] * count, 0.1)
    assert list(tmp_path.iterdir()) == []
