"""Photographs of more than a level heap: a high camera, a crop, several heaps, dishes, no heap."""

import cv2
import numpy as np
import pytest
from drawn_heaps import Camera, DrawnHeap, draw

from imaging import Outline, PictureError, View, find_outline, measure, overlay
from imaging.flank.camera_height import level_angle, level_error, seen_angle
from imaging.flank.plate_line import PlateLine
from imaging.photo.foot import Base

WALL, PLATE, GRAIN = (235, 235, 230), (120, 110, 100), (45, 70, 95)
BLUE = (170, 110, 60)


@pytest.mark.parametrize(("angle", "elevation"), [(15.0, 0.0), (30.0, 5.0), (42.0, 12.0)])
def test_a_cone_from_afar_has_the_outline_of_the_closed_form(angle: float, elevation: float) -> None:
    slope, turn = np.tan(np.radians(angle)), np.radians(elevation)
    expected = np.degrees(np.arctan(np.sqrt((slope * np.cos(turn)) ** 2 - np.sin(turn) ** 2)))
    # The base is a polygon of 1440 sides: a thousandth of a degree.
    assert seen_angle(angle, elevation, np.inf) == pytest.approx(expected, abs=2e-3)


@pytest.mark.parametrize(("distance", "elevation"), [(2.0, 10.0), (10.0, 0.0), (np.inf, 10.0)])
def test_a_level_angle_undoes_the_cameras_height_and_nearness(distance: float, elevation: float) -> None:
    for angle in (15.0, 30.0, 42.0):
        seen = seen_angle(angle, elevation, distance)
        assert level_angle(seen, elevation, distance) == pytest.approx(angle, abs=1e-3)


def test_a_level_camera_at_an_unknown_distance_changes_no_bit() -> None:
    assert level_angle(29.123456789, 0.0) == 29.123456789
    level, above = (Outline(*np.zeros((2, 9)), PlateLine(0.0, 0.0, True), elevation=e) for e in (0.0, 10.0))
    assert level_error(30.0, level) == 0.0
    # A known height at an unknown distance: what lies between 4 widths and far away, 1.6 degrees at 10.
    assert 0.3 < level_error(29.0, above) < 1.0


def raised(angle: float, elevation: float, far_edge: float = 0.25, plate: tuple = PLATE) -> np.ndarray:
    """Draw a smooth cone from afar, above a plate whose far edge lies behind its foot."""
    fine, half, turn = 4, 260.0, np.radians(elevation)
    image = np.full((fine * 480, fine * 840, 3), WALL, np.uint8)
    middle, foot = fine * 420.0, fine * 330.0
    image[int(foot - fine * far_edge * half) :] = plate
    around = np.linspace(0.0, 2.0 * np.pi, 721)
    base = np.column_stack([half * np.cos(around), half * np.sin(turn) * np.sin(around)])
    tip = [[0.0, -half * np.tan(np.radians(angle)) * np.cos(turn)]]
    hull = cv2.convexHull(np.rint(fine * np.vstack([base, tip]) + [middle, foot]).astype(np.int32))
    cv2.fillPoly(image, [hull], GRAIN)
    small = cv2.resize(image, (840, 480), interpolation=cv2.INTER_AREA).astype(float)
    noise = np.random.default_rng(0).normal(0.0, 4.0, small.shape)
    return np.clip(small + noise, 0, 255).astype(np.uint8)


@pytest.mark.parametrize(("elevation", "angle"), [(6.0, 25.0), (10.0, 34.0), (14.0, 34.0)])
def test_the_plates_far_edge_is_not_taken_for_the_base(elevation: float, angle: float) -> None:
    measured = measure(raised(angle, elevation), view=View(distance=np.inf))
    # The front of the base is an edge of a pixel in 260: its height is known to some tenths of a degree.
    assert measured.outline.elevation == pytest.approx(elevation, abs=0.6)
    assert measured.mean == pytest.approx(angle, abs=0.4)
    assert [doubt.name for doubt in measured.doubts] == ["elevation"] * (elevation > 13.0)
    given = measure(raised(angle, elevation), view=View(distance=np.inf, elevation=elevation))
    assert given.mean == pytest.approx(angle, abs=0.3)


def test_a_base_that_bulges_upwards_is_level_within_its_error() -> None:
    """Deeper than half its width, it has no ellipse's angle; its depth is known to 2 of 50 pixels."""
    base = Base(100.0, 0.0, -60.0, 2.0, (0.0, 100.0))
    assert base.elevation == 0.0
    assert base.elevation_se == pytest.approx(np.degrees(2.0 / 50.0))


def test_grain_and_plate_of_one_colour_are_doubted() -> None:
    picture = draw(DrawnHeap(30, 30), Camera(heap=(70, 75, 80), plate=(70, 75, 80), noise=3))
    assert [doubt.name for doubt in measure(picture).doubts] == ["plate"]


def test_doubts_are_written_on_the_drawn_copy() -> None:
    picture = draw(DrawnHeap(24, 32, 200), Camera(noise=3))
    doubted = overlay(picture, measure(picture))
    corner = picture[:12, -12:]
    assert (doubted[:12, -12:] != corner).any()
    clear = draw(DrawnHeap(30, 30, 200), Camera(noise=3))
    np.testing.assert_array_equal(overlay(clear, measure(clear))[:12, -12:], clear[:12, -12:])
    assert measure(find_outline(picture, ground_row=len(picture) - 60.5)).doubts == ()


def test_a_tilt_is_accepted_where_the_plate_is_visible() -> None:
    names = [
        [doubt.name for doubt in measure(draw(DrawnHeap(30, 30, 200), Camera(tilt=7, plate=plate))).doubts]
        for plate in (None, (60, 60, 60))
    ]
    assert names == [["tilt"], []]
    # A tilt over both limits, without a plate and with one, is one doubt.
    steep = measure(draw(DrawnHeap(30, 30, 200), Camera(tilt=14)))
    assert [doubt.name for doubt in steep.doubts].count("tilt") == 1


def test_a_slanting_sliver_is_doubted() -> None:
    picture = np.full((420, 700, 3), WALL, np.uint8)
    cv2.fillPoly(picture, [np.array([[150, 100], [340, 135], [470, 195]])], PLATE, cv2.LINE_AA)
    assert "tilt" in [doubt.name for doubt in measure(picture).doubts]


def two_heaps() -> np.ndarray:
    left, right = (draw(DrawnHeap(angle, angle, 200), Camera(plate=PLATE)) for angle in (25, 35))
    taller = np.full((len(right) - len(left), left.shape[1], 3), Camera().background, np.uint8)
    return np.hstack([np.vstack([taller, left]), right])


def test_one_of_two_heaps_is_chosen_or_cut_out() -> None:
    picture = two_heaps()
    with pytest.raises(PictureError, match="2 heaps or objects"):
        measure(picture)
    half = picture.shape[1] // 2
    for number, angle in ((1, 25.0), (2, 35.0)):
        # The promise for smooth heaps of 400 pixels, which these keep at half of the size.
        assert measure(picture, view=View(heap=number)).mean == pytest.approx(angle, abs=0.3)
        crop = ((number - 1) * half, 0, number * half, len(picture))
        cut = measure(picture, view=View(crop=crop))
        assert cut.mean == pytest.approx(angle, abs=0.3)
        # The outline lies in the whole picture.
        columns, _ = cut.outline.plate.picture_point(cut.outline.position[[0, -1]], np.zeros(2))
        assert crop[0] < columns[0] < columns[1] < crop[2]
    with pytest.raises(PictureError, match="heap 3"):
        measure(picture, view=View(heap=3))
    with pytest.raises(PictureError, match=r"shows 1 heap\b"):
        measure(draw(DrawnHeap(30, 30, 200)), view=View(heap=3))
    with pytest.raises(PictureError, match="the crop must be within"):
        measure(picture, view=View(crop=(0, 0, 5000, 100)))


def test_a_given_plate_is_taken() -> None:
    picture = draw(DrawnHeap(28, 28), Camera(plate=PLATE, tilt=4))
    plate = measure(picture).outline.plate
    points = (50.0, plate.row + 50.0 * plate.slope, 400.0, plate.row + 400.0 * plate.slope)
    given = measure(picture, view=View(plate=points))
    assert given.outline.plate.tilt == pytest.approx(plate.tilt, abs=1e-6)
    assert given.mean == pytest.approx(28.0, abs=0.3)


@pytest.mark.parametrize(
    ("elevation", "angle", "plate"),
    [(0.0, 30.0, WALL), (4.0, 25.0, PLATE), (10.0, 34.0, WALL), (14.0, 34.0, PLATE)],
)
def test_a_given_plate_leaves_the_cameras_height_measured(
    elevation: float, angle: float, plate: tuple
) -> None:
    turn = np.radians(elevation)
    touch = 260.0 * np.sin(turn) ** 2 / (np.tan(np.radians(angle)) * np.cos(turn))
    line = (160.0, 330.0 - touch, 680.0, 330.0 - touch)  # where the outline's flanks touch the base
    measured = measure(raised(angle, elevation, plate=plate), view=View(distance=np.inf, plate=line))
    # the limits of the same heaps without a given plate
    assert measured.outline.elevation == pytest.approx(elevation, abs=0.6)
    assert measured.mean == pytest.approx(angle, abs=0.4)
    assert [doubt.name for doubt in measured.doubts] == ["elevation"] * (elevation > 13.0)


def test_a_given_plate_whose_foot_is_not_visible_is_doubted_for_the_cameras_height() -> None:
    line, picture = (160.0, 330.0, 680.0, 330.0), raised(34.0, 6.0, 0.0, GRAIN)
    [doubt] = measure(picture, view=View(plate=line)).doubts
    assert (doubt.name, "not visible" in doubt.finding) == ("elevation", True)
    assert measure(picture, view=View(plate=line, elevation=6.0)).doubts == ()


def test_a_dish_below_a_given_plate_is_doubted() -> None:
    picture = np.full((420, 700, 3), WALL, np.uint8)
    cv2.fillPoly(picture, [np.array([[150, 250], [350, 150], [550, 250]])], GRAIN, cv2.LINE_AA)
    cv2.rectangle(picture, (150, 250), (550, 330), (160, 90, 60), -1)
    measured = measure(picture, view=View(plate=(150.0, 250.0, 550.0, 250.0)))
    assert any("plate wider than itself" in str(doubt) for doubt in measured.doubts)


def test_a_given_height_of_the_camera_replaces_the_measured_one() -> None:
    """Also where the measured one is in doubt, or would have refused the picture."""
    high, steep = raised(34.0, 22.0), raised(44.0, 38.0)
    assert "elevation" in [doubt.name for doubt in measure(high).doubts]
    assert measure(high, view=View(distance=np.inf, elevation=22.0)).mean == pytest.approx(34.0, abs=0.3)
    with pytest.raises(PictureError, match="from the side"):
        measure(steep)
    assert "elevation" in [each.name for each in measure(steep, view=View(elevation=38.0)).doubts]


def test_a_heap_in_a_dish_is_refused() -> None:
    picture = np.full((420, 700, 3), WALL, np.uint8)
    cv2.fillPoly(picture, [np.array([[150, 250], [350, 150], [550, 250]])], GRAIN, cv2.LINE_AA)
    cv2.ellipse(picture, (350, 250), (200, 90), 0, 0, 180, (160, 90, 60), -1, cv2.LINE_AA)
    with pytest.raises(PictureError, match="a dish"):
        measure(picture)


@pytest.mark.parametrize(("reach", "doubts"), [(0, ["shade"]), (300, [])])
def test_a_dark_area_below_the_heap_alone_is_doubted(reach: int, doubts: list[str]) -> None:
    """A dish in a shade of the wall's colour may be the heap's shadow; on a darker table there is none."""
    picture = np.full((420, 700, 3), WALL, np.uint8)
    shade = tuple(0.75 * np.broadcast_to(WALL, 3))
    cv2.fillPoly(picture, [np.array([[150, 250], [350, 150], [550, 250]])], GRAIN, cv2.LINE_AA)
    cv2.ellipse(picture, (350, 250), (200 + reach, 90), 0, 0, 180, shade, -1, cv2.LINE_AA)
    assert [doubt.name for doubt in measure(picture).doubts] == doubts


@pytest.mark.parametrize("light", [0.3, -0.3])
def test_light_from_one_side_is_no_shadow_below_the_heap(light: float) -> None:
    """The ground is darker on one side of the heap's middle and brighter on the other."""
    picture = np.full((420, 700, 3), WALL, np.float64)
    cv2.fillPoly(picture, [np.array([[150, 250], [350, 150], [550, 250]])], GRAIN, cv2.LINE_AA)
    lit = 0.8 * picture * (1.0 + light * np.linspace(-0.5, 0.5, 700))[None, :, None]
    assert measure(np.rint(lit).astype(np.uint8)).doubts == ()


def test_a_disc_is_no_heap() -> None:
    picture = np.full((420, 700, 3), WALL, np.uint8)
    cv2.circle(picture, (350, 220), 120, GRAIN, -1, cv2.LINE_AA)
    with pytest.raises(PictureError, match="from the side"):
        measure(picture)


@pytest.mark.parametrize("width", [1, 12])
def test_a_dark_column_is_no_heap(width: int) -> None:
    picture = np.full((300, 500, 3), 230, np.uint8)
    picture[40:260, 250 : 250 + width] = 20
    with pytest.raises(PictureError, match="wide"):
        measure(picture)


def test_a_large_picture_is_measured_as_well_as_a_small_one() -> None:
    picture = draw(DrawnHeap(27, 33, grain=8), Camera(plate=PLATE, noise=2, tilt=2))
    large = cv2.resize(picture, None, fx=4, fy=4, interpolation=cv2.INTER_CUBIC)
    small, big = measure(picture), measure(large)
    # Its edge is refined at full size: the same to a few hundredths of a pixel of the small one.
    assert (big.left, big.right) == pytest.approx((small.left, small.right), abs=0.15)
    assert np.ptp(big.outline.position) == pytest.approx(4.0 * np.ptp(small.outline.position), rel=0.01)


def shaded_heap(hue: tuple[float, float, float]) -> np.ndarray:
    """Return a heap of 30 degrees on a table; a soft patch about its feet changes the colours of the wall."""
    heap = draw(DrawnHeap(30, 30, grain=14), Camera(heap=GRAIN, background=WALL, plate=BLUE)).astype(float)
    table = int(np.flatnonzero(heap[:, 0, 2] < 0.5 * (WALL[2] + BLUE[2]))[0])
    wall = np.linalg.norm(heap - GRAIN, axis=2) / np.linalg.norm(np.subtract(WALL, GRAIN))
    wall[table:] = 0.0
    middle = heap.shape[1] // 2
    patch = np.zeros(heap.shape[:2], np.uint8)
    corners = [[middle - 250, table], [middle, table - 115], [middle + 250, table]]
    cv2.fillPoly(patch, [np.array(corners)], 255)
    soft = wall * cv2.GaussianBlur(patch, (0, 0), 12.0) / 255.0
    heap *= 1.0 - soft[:, :, None] * (1.0 - np.array(hue))
    noise = np.random.default_rng(0).normal(0.0, 1.0, heap.shape)
    return np.clip(np.rint(heap + noise), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("hue", [(0.8, 0.8, 0.8), (0.6, 0.9, 0.9)])
def test_an_edge_that_depends_on_the_threshold_is_cut_out_or_doubted(
    hue: tuple[float, float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A shadow's smooth edge fits two lines better than grains do."""
    cut = measure(shaded_heap(hue))
    # Grains of 14 of 400 pixels: one standard error.
    assert (cut.mean, cut.doubts) == (pytest.approx(30.0, abs=0.4), ())
    monkeypatch.setattr("imaging.photo.photograph.cut_out", lambda seen: [])
    measured = measure(shaded_heap(hue))
    assert abs(measured.mean - 30.0) > 3.0
    assert "threshold" in [doubt.name for doubt in measured.doubts]


def test_a_tube_next_to_the_heap_is_left_out() -> None:
    picture = draw(DrawnHeap(30, 30), Camera(plate=PLATE, margin=1.0))
    table = int(np.argmax(np.abs(np.diff(picture[:, 5, 0].astype(int)))))
    picture[table - 150 : table + 1, 60:110] = (150, 140, 130)
    measured = measure(picture)
    # The promise for smooth heaps of 400 pixels.
    assert (measured.mean, measured.doubts) == (pytest.approx(30.0, abs=0.3), ())


def on_a_row(color: tuple[int, int, int]) -> np.ndarray:
    """Return a heap of 30 degrees on a row as high as a grain of a heap of 20 grains, and hardly wider."""
    picture = np.full((420, 700, 3), WALL, np.uint8)
    cv2.fillPoly(picture, [np.array([[150, 280], [350, 165], [550, 280]])], GRAIN, cv2.LINE_AA)
    cv2.rectangle(picture, (135, 280), (565, 300), color, -1)
    return picture


@pytest.mark.parametrize("shade", [1.0, 0.85])
def test_the_lowest_row_of_grains_is_no_plate(shade: float) -> None:
    """Their tops lie on a line, as a board's do, but they are a part of the heap, in its colours."""
    angle = measure(on_a_row(tuple(round(shade * channel) for channel in GRAIN)))
    assert not angle.outline.plate.visible
    assert angle.doubts == ()
    # Next to the heap 15 columns of the row, level, count among the 215 of a flank.
    assert angle.mean == pytest.approx(30.0, abs=0.7)


def test_a_board_hardly_wider_than_the_heap_is_refused() -> None:
    with pytest.raises(PictureError, match="narrow board"):
        measure(on_a_row((160, 90, 60)))


def test_a_drawn_copy_says_where_its_lines_are_not_the_corrected_ones() -> None:
    level, high = raised(34.0, 0.0), raised(34.0, 10.0)
    view = View(distance=np.inf)
    assert measure(level, view=view).correction == ""
    angle = measure(high, view=view)
    assert f"lines seen at {angle.left_line.angle:.1f} and" in angle.correction
    assert f"{angle.left:.1f} and {angle.right:.1f} corrected" in angle.correction
    drawn, plain = overlay(high, angle), overlay(level, measure(level, view=view))
    assert (drawn[-3:, :3] != high[-3:, :3]).all(axis=2).all()
    np.testing.assert_array_equal(plain[-3:, :3], level[-3:, :3])
    assert len(str(angle)) < 100
