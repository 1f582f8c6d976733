"""Drawn smooth heaps of known angles: the instrument against the truth."""

import numpy as np
import pytest
from drawn_heaps import Camera, DrawnHeap, draw

from imaging import FitSettings, heap_shape, measure

FLANKS = [(5, 8), (25, 35)], [(12, 20), (45, 45)]  # by turns
CAMERAS = {
    "noisy": Camera(noise=8),
    "light on dark": Camera(heap=(225, 230, 230), background=(35, 30, 30), noise=5),
    "dark plate": Camera(plate=(60, 60, 60), noise=5),
    "plate darker than the heap": Camera(plate=(20, 20, 20), heap=(150, 150, 150), noise=3),
    "white plate": Camera(plate=(250, 250, 250), background=(160, 160, 160), noise=3),
    "coloured background": Camera(background=(200, 120, 60), heap=(70, 110, 150), noise=5),
    "uneven light": Camera(light=0.4, noise=3),
}
REQUIRED = {400: 0.3, 50: 1.0}
"""Pile width [pixels] to the error [degrees] that the measurement promises."""


@pytest.mark.parametrize("width", REQUIRED)
@pytest.mark.parametrize("number", range(len(CAMERAS)), ids=CAMERAS)
def test_both_flanks_within_the_promised_error(width: int, number: int) -> None:
    camera = [*CAMERAS.values()][number]
    for left, right in FLANKS[number % 2]:
        angle = measure(draw(DrawnHeap(left, right, width), camera))
        np.testing.assert_allclose([angle.left, angle.right], [left, right], atol=REQUIRED[width], rtol=0)


@pytest.mark.parametrize("camera_tilt", [-2.0, 8.0])
@pytest.mark.parametrize("plate", [None, (60, 60, 60)], ids=["no plate seen", "plate seen"])
def test_tilted_camera_is_levelled(camera_tilt: float, plate: tuple[int, int, int] | None) -> None:
    camera = Camera(tilt=camera_tilt, plate=plate, noise=4)
    angle = measure(draw(DrawnHeap(25, 32), camera))
    # The promise for smooth heaps of 400 pixels, whatever the tilt.
    assert angle.outline.plate.tilt == pytest.approx(camera_tilt, abs=0.3)
    np.testing.assert_allclose([angle.left, angle.right], [25, 32], atol=0.3, rtol=0)


def test_mirroring_the_picture_swaps_the_flanks() -> None:
    picture = draw(DrawnHeap(22, 34), Camera(noise=4))
    angle, mirrored = measure(picture), measure(np.ascontiguousarray(picture[:, ::-1]))
    # The background fit samples other pixels of the mirrored picture: a hundredth of a degree.
    np.testing.assert_allclose([mirrored.left, mirrored.right], [angle.right, angle.left], atol=0.01, rtol=0)


def test_angle_does_not_depend_on_the_scale() -> None:
    angles = [measure(draw(DrawnHeap(18, 31, width))).mean for width in (200, 400, 800)]
    # Edges are known to a tenth of a pixel: 0.1 degree over a flank of a hundred pixels.
    np.testing.assert_allclose(angles, 24.5, atol=0.1, rtol=0)


def test_brightness_and_polarity_do_not_matter() -> None:
    picture = draw(DrawnHeap(18, 31), Camera(noise=4))
    reference = measure(picture)
    dimmer = measure((0.6 * picture + 20).astype(np.uint8))
    negative = measure(255 - picture)
    # Rounding to 8 bits once more changes edges by a hundredth of a pixel.
    for other in (dimmer, negative):
        np.testing.assert_allclose([other.left, other.right], [reference.left, reference.right], atol=0.03)


def test_rounded_apex_flattens_the_whole_flank_and_not_its_middle() -> None:
    picture = draw(DrawnHeap(30, 30, rounding=0.25))
    assert measure(picture, "flank").mean < 29.5
    # Below the cap the flank is straight; the cap of 25 % begins at 75 % of the sharp heap's height.
    lower = FitSettings("below the cap", 0.1, 0.7)
    assert measure(picture, lower).mean == pytest.approx(30.0, abs=0.3)


def test_shape_of_a_triangle() -> None:
    shape = heap_shape(measure(draw(DrawnHeap(30, 30))).outline)
    # Of a cone's volume, 3 (r/R)^2 - 2 (r/R)^3 lies within radius r of R: half within R / 2.
    assert shape.width == pytest.approx(400, abs=4)
    assert shape.height == pytest.approx(200 * np.tan(np.radians(30)), abs=2)
    assert shape.r50 == pytest.approx(100, abs=2)
    assert shape.r90 == pytest.approx(200 * 0.8042, abs=2)
    assert shape.concavity == pytest.approx(0.0, abs=0.02)
    assert shape.asymmetry == pytest.approx(0.0, abs=0.02)
