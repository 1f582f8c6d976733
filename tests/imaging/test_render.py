"""The drawn pictures of spheres: geometry, both renderers, silence."""

import os
import subprocess
import sys

import cv2
import numpy as np
import pytest
from drawn_heaps import Camera, DrawnHeap, draw

import imaging
from imaging import PictureError, heap_angle, measure, measure_photograph, overlay, silhouette, snapshot
from imaging.drawing import opengl, raster
from imaging.geometry import Frame, Spheres


def centre_of(dark: np.ndarray) -> np.ndarray:
    """Return row and column of the middle of what a picture shows dark."""
    return (np.mgrid[: dark.shape[0], : dark.shape[1]] * dark).sum(axis=(1, 2)) / dark.sum()


def test_one_sphere_is_a_disc_of_its_size_at_its_place() -> None:
    center, radius = np.array([[0.02, -0.01, 0.004]]), np.array([0.004])
    picture = silhouette(center, radius, azimuth=0.7, pixels=200, backend="raster")
    dark = (255.0 - picture.image) / 255.0
    scale = picture.meters_per_pixel
    # 4 x 4 subpixels on a disc of 180 pixels diameter: its area to about a thousandth.
    assert dark.sum() * scale**2 == pytest.approx(np.pi * radius[0] ** 2, rel=3e-3)
    row, column = centre_of(dark)
    assert column == pytest.approx(0.5 * dark.shape[1] - 0.5, abs=0.1)
    assert (picture.ground_row - row) * scale == pytest.approx(0.004, abs=0.1 * scale)


def test_azimuth_turns_the_camera_round_the_heap() -> None:
    spheres = Spheres.of([[0.03, 0.0, 0.001]], 0.001)
    # At 0 the right is +x and the camera looks along +y; a quarter turn on, +x is towards the camera.
    np.testing.assert_allclose(spheres.seen_from(0.0), [[0.03, 0.0, 0.001]], atol=1e-15)
    np.testing.assert_allclose(spheres.seen_from(np.pi / 2), [[0.0, -0.03, 0.001]], atol=1e-15)


def test_opposite_views_are_mirror_images(heap) -> None:
    one = silhouette(heap.centers, heap.radii, 0.4).image.astype(int)
    other = silhouette(heap.centers, heap.radii, 0.4 + np.pi).image.astype(int)
    # Rounding of sphere edges on subpixel middles: single subpixels, 1/16 of a pixel each.
    assert np.abs(one - other[:, ::-1]).mean() < 0.01


def test_raster_and_pyvista_draw_the_same_heap_and_measure_the_same_angle(heap) -> None:
    backends = ("raster", "pyvista")
    drawn = [silhouette(heap.centers, heap.radii, 0.7, pixels=200, backend=each) for each in backends]
    raster, pyvista = (255.0 - picture.image for picture in drawn)
    # Facets and subpixels differ at the edges of spheres: 3e-4 of the area (measured), hundredths of a pixel.
    assert pyvista.sum() == pytest.approx(raster.sum(), rel=3e-3)
    assert centre_of(pyvista) == pytest.approx(centre_of(raster), abs=0.1)
    one, other = (measure(imaging.find_outline(p.image, p.ground_row, p.meters_per_pixel)) for p in drawn)
    assert (other.left, other.right) == pytest.approx((one.left, one.right), abs=0.1)


@pytest.mark.parametrize("backend", ["raster", "pyvista"])
def test_shaded_snapshot_is_as_good_as_a_photograph(heap, angle, backend: str, tmp_path) -> None:
    views = angle.views
    picture = snapshot(heap.centers, heap.radii, np.pi / 2, pixels=300, backend=backend, grains=heap.grains)
    shaded = measure_photograph(imaging.save_picture(tmp_path / "heap.jpg", picture.image))
    # Shade and compression move the edge of single grains by a fraction of a pixel.
    assert (shaded.left, shaded.right) == pytest.approx((views[1].left, views[1].right), abs=0.3)


def test_lines_are_drawn_where_they_were_measured(heap, angle) -> None:
    view = angle.views[0]
    picture = snapshot(heap.centers, heap.radii, backend="raster", grains=heap.grains)
    drawn = overlay(picture, view)
    changed = (drawn != picture.image).any(axis=2)
    for line in (view.left_line, view.right_line):
        middle = np.array([0.5 * (line.start + line.stop)])
        column, row = view.outline.plate.picture_point(middle, line.intercept + line.slope * middle)
        assert changed[round(float(row[0])), round(float(column[0]))]
    assert not changed[0].any()


@pytest.mark.parametrize("tilt", [0.0, -4.0])
def test_a_measurement_in_a_part_of_the_picture_is_the_same(tilt: float) -> None:
    image = draw(DrawnHeap(32.0, 30.0, grain=8.0), Camera(plate=(90, 90, 90), tilt=tilt))
    angle = measure(image)
    drawn = overlay(image, angle)
    left, top = 20, 15
    part = angle.in_part(left, top)
    assert (part.left, part.right, part.se) == (angle.left, angle.right, angle.se)
    # The strokes' width follows that of the picture: the part is filled up to the width of the whole.
    filled = cv2.copyMakeBorder(image[top:, left:], 0, top, 0, left, cv2.BORDER_REPLICATE)
    changed = (overlay(filled, part) != filled).any(axis=2)[:-top, :-left]
    np.testing.assert_array_equal(changed, (drawn != image).any(axis=2)[top:, left:])


def test_overlay_of_another_scale_is_refused(heap, angle) -> None:
    with pytest.raises(PictureError, match="scale"):
        overlay(snapshot(heap.centers, heap.radii, pixels=300, backend="raster"), angle.views[0])


def test_frame_is_the_same_for_every_azimuth_and_follows_the_heap(heap, angle) -> None:
    moved = heap.centers + np.array([0.3, -0.2, 0.0])
    there = heap_angle(moved, heap.radii, azimuths=2)
    # Moving the heap shifts it against the pixels by rounding only.
    assert there.mean == pytest.approx(angle.mean, abs=1e-3)
    frame = Frame.around(Spheres.of(heap.centers, heap.radii), 500)
    pictures = [silhouette(heap.centers, heap.radii, azimuth, frame=frame) for azimuth in (0.0, 1.0)]
    assert pictures[0].image.shape == pictures[1].image.shape == frame.shape


def test_pyvista_draws_without_messages(tmp_path) -> None:
    script = (
        "from imaging import silhouette\n"
        "silhouette([[0, 0, 1.0], [1.0, 0, 1.0]], [1.0, 1.0], backend='pyvista')\n"
    )
    environment = {name: value for name, value in os.environ.items() if name != "DISPLAY"}
    environment["PYTHONPATH"] = os.pathsep.join(path for path in sys.path if path)
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, env=environment, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_auto_takes_the_raster_where_opengl_does_not_work(heap, monkeypatch) -> None:
    monkeypatch.setattr(opengl, "opengl_works", lambda: False)
    auto = silhouette(heap.centers, heap.radii, backend="auto")
    np.testing.assert_array_equal(auto.image, silhouette(heap.centers, heap.radii, backend="raster").image)
    with pytest.raises(PictureError, match="OpenGL"):
        silhouette(heap.centers, heap.radii, backend="pyvista")


def test_pictures_carry_their_scale(heap) -> None:
    picture = silhouette(heap.centers, heap.radii)
    outline = imaging.find_outline(picture.image, picture.ground_row, picture.meters_per_pixel)
    top = float((heap.centers[:, 2] + heap.radii).max())
    # One pixel, and the threshold on a single sphere's top.
    assert outline.height.max() * outline.meters_per_pixel == pytest.approx(top, abs=picture.meters_per_pixel)
    assert measure(outline).outline is outline


@pytest.mark.parametrize(
    ("centers", "radii", "words"),
    [
        ([[0.0, 0.0]], [1.0], "centers"),
        ([[0.0, 0.0, 1.0]], [1.0, 2.0], "radii"),
        ([[0.0, 0.0, 1.0], [0.0, np.nan, 1.0]], [1.0, 1.0], "sphere 1"),
        (np.empty((0, 3)), [], "centers"),
    ],
)
def test_bad_spheres_are_named(centers, radii, words: str) -> None:
    with pytest.raises(PictureError, match=words):
        silhouette(centers, radii)


def test_plate_is_found_next_to_stray_grains(heap, tmp_path) -> None:
    strays = np.array([[-0.045, 0.0, 0.001], [0.046, 0.0, 0.001]])
    centers, radii = np.vstack([heap.centers, strays]), np.r_[heap.radii, 0.001, 0.001]
    picture = snapshot(centers, radii, backend="raster")
    angle = measure_photograph(imaging.save_picture(tmp_path / "strays.jpg", picture.image))
    # The plate's upper edge is drawn between two rows; compression moves it by less than half a pixel.
    plate = angle.outline.plate
    assert plate.row == pytest.approx(picture.ground_row, abs=0.5)
    assert plate.tilt == pytest.approx(0.0, abs=0.1)


def test_a_silhouette_in_parts_is_that_of_all_and_too_many_spheres_at_one_place_are_refused(
    heap: Spheres, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = silhouette(heap.centers, heap.radii).image
    monkeypatch.setattr(raster, "RUNS", 1000)
    np.testing.assert_array_equal(silhouette(heap.centers, heap.radii).image, whole)
    monkeypatch.setattr(raster, "MOST_RUNS", 1000)
    with pytest.raises(PictureError, match="too many at one place"):
        silhouette(heap.centers, heap.radii)
