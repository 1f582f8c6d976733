"""Outlines seen from above, corrected to those of a level camera: bodies of revolution, point by point."""

from collections.abc import Callable

import numpy as np
import pytest

from imaging import Outline, heap_profile, heap_readings, heap_shape, profile_heights
from imaging.flank.camera_height import level_outline
from imaging.flank.plate_line import PlateLine

RADIUS = 100.0
BODIES: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "cone": lambda r: 57.7 * np.maximum(1.0 - r / RADIUS, 0.0),
    "round": lambda r: 50.0 * np.maximum(1.0 - (r / RADIUS) ** 1.6, 0.0),
    "hollow": lambda r: 60.0 * np.maximum(1.0 - r / RADIUS, 0.0) ** 1.5,
}
DISTANCE = 8.0


def outline_from(body: Callable[[np.ndarray], np.ndarray], elevation: float) -> Outline:
    """Highest point of the body in each column of a picture, over the line at which a cone's flanks end."""
    r, around = np.meshgrid(np.linspace(0.0, RADIUS, 500), np.linspace(0.0, np.pi, 500))
    x, y, z = r * np.cos(around), r * np.sin(around), body(r)
    turn = np.radians(elevation)
    depth = 1.0 + 0.5 * np.cos(turn) / (DISTANCE * RADIUS) * (y * np.cos(turn) - z * np.sin(turn))
    edges = np.linspace(-RADIUS, RADIUS, 301)
    column = np.clip(np.digitize((x / depth).ravel(), edges) - 1, 0, 299)
    height = np.full(300, -np.inf)
    np.maximum.at(height, column, ((z * np.cos(turn) + y * np.sin(turn)) / depth).ravel())
    height -= (RADIUS * np.sin(turn)) ** 2 / height.max()
    kept = height > 0.0
    position = 0.5 * (edges[1:] + edges[:-1])[kept]
    return Outline(
        position, height[kept], PlateLine(0.0, 0.0, visible=True), elevation=elevation, distance=DISTANCE
    )


@pytest.mark.parametrize(("name", "elevation"), [("cone", 5.0), ("round", 10.0), ("hollow", 14.0)])
def test_a_profile_is_corrected_for_the_camera_height(name: str, elevation: float) -> None:
    x = np.linspace(-RADIUS, RADIUS, 801)
    truth = profile_heights(x, BODIES[name](np.abs(x)))
    seen = outline_from(BODIES[name], elevation)
    raw = np.abs(profile_heights(seen.position, seen.height) - truth).max()
    # a column, two thirds of a unit wide, and the foot that the base hides: half a unit of 50 to 60
    assert np.abs(heap_profile(seen) - truth).max() < 0.8
    assert raw > 0.9
    assert heap_shape(seen).height == pytest.approx(float(BODIES[name](np.zeros(1))[0]), abs=1.0)


def test_roughness_and_lopsidedness_stay() -> None:
    seen = outline_from(BODIES["cone"], 8.0)
    grains = np.sin(seen.position)
    rough = Outline(
        seen.position, seen.height + grains, seen.plate, elevation=seen.elevation, distance=seen.distance
    )
    smooth, level = level_outline(seen), level_outline(rough)
    inner = slice(len(smooth.position) // 5, -len(smooth.position) // 5)
    added = np.interp(smooth.position, level.position, level.height) - smooth.height
    assert added[inner] == pytest.approx(np.sin(smooth.position)[inner], abs=0.25)


def test_a_drawn_outline_is_left_as_it_is() -> None:
    outline = Outline(
        np.arange(40.0), np.minimum(np.arange(40.0), 39.0 - np.arange(40.0)), PlateLine(0.0, 0.0, True)
    )
    assert level_outline(outline) is outline


@pytest.mark.parametrize("power", [1, 2])
def test_readings_of_a_hollow_heap_differ_as_their_closed_forms_do(power: int) -> None:
    x = np.linspace(-0.999, 0.999, 1999)
    height = 60.0 * (1.0 - np.abs(x)) ** power
    found = heap_readings(Outline(RADIUS * x, height, PlateLine(0.0, 0.0, visible=False)))
    # h = H (1 - r/R)^n has the volume 2 pi H R^2 / ((n + 1) (n + 2)), its centre at H (n + 2) / (8 n + 4).
    volume = 6.0 / ((power + 1.0) * (power + 2.0))
    mass = (power + 2.0) / (2.0 * power + 1.0)
    tangents = {"height_angle": 1.0, "volume_angle": volume, "centre_angle": mass}
    for name, tangent in tangents.items():
        # columns of a thousandth of the radius
        assert getattr(found, name) == pytest.approx(np.degrees(np.arctan(0.6 * tangent)), abs=0.1)
    # A hollow flank has a long, flat toe, which neither line goes through.
    for angle in (found.line_angle, found.middle_angle):
        assert (angle == pytest.approx(found.height_angle, abs=0.1)) == (power == 1)
        assert (angle > found.height_angle + 1.0) == (power == 2)
