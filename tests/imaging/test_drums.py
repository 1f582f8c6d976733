"""Drums read from drawn pictures: what is known of a line in a circle, and what is no drum."""

import cv2
import numpy as np
import pytest
from drawn_drums import draw_drum, segment
from drawn_heaps import DrawnHeap, draw

from dem_warp.scenes import drum_surface
from imaging import PictureError, View, overlay_drum, read_drum
from imaging.drum import drum_reading
from imaging.drum.bed_surface import half_chord


@pytest.mark.parametrize(
    "drawn",
    [
        {},
        {"mirrored": True},
        {"angle": 55.0, "level": -0.4},
        {"bed": (220, 225, 230), "free": (20, 20, 20), "around": (0, 0, 0), "rim": None, "speckle": 0.15},
        {"around": (60, 70, 80), "rim": None, "soft": 0.12},
        {"rim": (245, 245, 245), "around": (10, 10, 10), "speckle": 0.3, "radius": 90.0},
    ],
)
def test_a_flat_bed_has_the_angle_the_heights_and_the_filling_of_its_line(drawn: dict) -> None:
    found = read_drum(draw_drum(**drawn))
    angle, level = np.radians(drawn.get("angle", 32.0)), drawn.get("level", -0.15)
    assert not found.doubts
    # The promise: .3 degrees, and .3 mm of a drum of 84 mm, for pictures of 90 pixels a radius and more.
    assert found.dynamic_angle == pytest.approx(np.degrees(angle), abs=0.3)
    places = np.array(drum_reading.STATIONS)
    wall = np.sqrt(1.0 - places**2)
    heights = np.clip((level - places * np.sin(angle)) / np.cos(angle), -wall, wall)
    np.testing.assert_allclose(np.array(found.heights, float), heights, atol=0.3 / 42.0 * 1.5)
    assert found.filling == pytest.approx(segment(level), abs=0.01)
    assert found.surface.mirrored is drawn.get("mirrored", False)


def test_halves_of_a_curved_bed_have_the_slopes_of_the_simulators_drum() -> None:
    drawn = draw_drum(curve=0.35, angle=40.0)
    grid = np.arange(-1.0, 1.0, 0.004)
    x, z = (value.ravel() for value in np.meshgrid(grid, grid))
    turn = np.radians(40.0)
    along, up = x * np.cos(turn) - z * np.sin(turn), x * np.sin(turn) + z * np.cos(turn)
    bed = (np.hypot(x, z) < 1.0) & (up < -0.15 + 0.35 * (along**3 - along))
    points = np.column_stack([x, 0.0 * x, z])[bed]
    chord = drum_surface.half_chord(drum_surface.level_of(bed.sum() * 0.004**2 / np.pi, 1.0), 1.0)
    truth = drum_surface.surface_angles(points, chord, 0.002)
    found = read_drum(drawn)
    assert truth is not None
    seen = (found.dynamic_angle, *found.halves, found.mass_angle)
    # A half has fewer columns, so half the promise more.
    np.testing.assert_allclose(seen, truth, atol=0.45)


def test_definitions_are_those_of_the_simulators_drum() -> None:
    assert drum_reading.STATIONS == drum_surface.STATIONS
    assert drum_reading.FITTED == drum_surface.SURFACE
    for filling in (0.1, 0.35, 0.5, 0.7):
        level = drum_surface.level_of(filling, 1.0)
        # the simulator's level is interpolated between ten thousand angles
        assert half_chord(filling) == pytest.approx(drum_surface.half_chord(level, 1.0), abs=1e-5)


def test_a_picture_without_the_lower_half_gives_what_it_shows() -> None:
    whole, level = draw_drum(), -0.15
    found = read_drum(whole[: round(1.25 * 150 + 0.45 * 150)])
    assert found.dynamic_angle == pytest.approx(32.0, abs=0.3)
    assert found.heights[0] == pytest.approx(
        (level + 0.8 * np.sin(np.radians(32.0))) / np.cos(np.radians(32.0)), abs=0.01
    )
    assert found.filling is None
    assert found.heights[-1] is None
    with pytest.raises(PictureError, match=r"must show|no drum"):
        read_drum(whole[: round(1.25 * 150 - 0.3 * 150)])


def test_a_given_circle_and_a_crop_are_taken() -> None:
    picture = np.full((500, 700, 3), 200, np.uint8)
    drum = draw_drum()
    picture[40 : 40 + drum.shape[0], 250 : 250 + drum.shape[1]] = drum
    circle = (250 + 1.3 * 150, 40 + 1.25 * 150, 150.0)
    for view in (
        View(circle=circle),
        View(crop=(250, 40, 640, 430), circle=circle),
        View(crop=(250, 40, 640, 430)),
    ):
        found = read_drum(picture, view)
        assert found.dynamic_angle == pytest.approx(32.0, abs=0.3)
        np.testing.assert_allclose((found.circle.column, found.circle.row), circle[:2], atol=1.0)
    with pytest.raises(PictureError, match=r"circle: must have a positive radius"):
        View(circle=(1.0, 2.0, 0.0))


def coin() -> np.ndarray:
    picture = np.full((300, 300, 3), 230, np.uint8)
    return cv2.circle(picture, (150, 150), 100, (90, 120, 150), -1)


def clock() -> np.ndarray:
    picture = cv2.circle(coin(), (150, 150), 90, (240, 240, 240), -1)
    for hour in np.linspace(0.0, 2.0 * np.pi, 13):
        middle = np.rint(150 + 75 * np.array([np.cos(hour), np.sin(hour)])).astype(int)
        cv2.circle(picture, middle.tolist(), 9, (20, 20, 20), -1)
    return picture


@pytest.mark.parametrize(
    "picture",
    [draw(DrawnHeap(30, 33)), coin(), clock(), np.full((200, 300, 3), 90, np.uint8)],
    ids=["heap", "coin", "clock", "even"],
)
def test_what_is_no_drum_is_refused_by_name(picture: np.ndarray) -> None:
    with pytest.raises(PictureError, match=r"^tray 7: no drum") as caught:
        read_drum(picture, place="tray 7")
    assert caught.value.place == "tray 7"


def test_a_rim_seen_from_the_side_and_an_empty_drum_are_doubted() -> None:
    drawn = draw_drum()
    slant = cv2.resize(drawn, None, fx=0.9, fy=1.0, interpolation=cv2.INTER_AREA)
    assert "rim" in [doubt.name for doubt in read_drum(slant).doubts]
    assert "range" in [doubt.name for doubt in read_drum(draw_drum(angle=3.0)).doubts]


def test_the_overlay_has_the_picture_and_its_marks() -> None:
    drawn = draw_drum(angle=3.0)
    copy = overlay_drum(drawn, read_drum(drawn))
    assert copy.shape == drawn.shape
    assert 0.01 < (copy != drawn).any(axis=2).mean() < 0.2
