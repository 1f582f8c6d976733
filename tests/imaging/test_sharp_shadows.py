"""Sharp shadows of a flash on the wall next to a heap: removed or doubted."""

import cv2
import numpy as np
import pytest
from drawn_heaps import Camera, DrawnHeap, draw

from imaging import measure
from imaging.photo.background import contrast_with_background
from imaging.photo.heap_on_plate import locate_heap
from imaging.photo.view_settings import View
from imaging.photo.wall_shadow import MOST_SHADED, shaded_edge

WALL, PLATE, STRAW, COAL = (235, 235, 230), (120, 110, 100), (45, 70, 95), (60, 62, 64)
ANGLE, WIDTH = 30.0, 400.0


def in_hard_light(
    keeps: float,
    aside: float,
    sides: tuple[int, ...] = (1, -1),
    color: tuple[int, int, int] = STRAW,
    grain: float = 0.0,
    texture: float = 0.0,
) -> np.ndarray:
    """Return a heap of 30 degrees whose shadow, 0.9 of its height, keeps a share of the wall's light.

    It lies `aside` of the heap's half width to the right (side 1), to the left (-1), or on both sides.
    """
    camera = Camera(heap=color, background=WALL, plate=PLATE, texture=texture, margin=0.4)
    picture = draw(DrawnHeap(ANGLE, ANGLE, WIDTH, grain=grain), camera).astype(float)
    away = np.linalg.norm(picture - WALL, axis=2)
    table = int(np.flatnonzero(away[:, 0] > 30.0)[0])
    wall = np.clip(1.0 - away / np.linalg.norm(np.subtract(WALL, color)), 0.0, 1.0)
    wall[table:] = 0.0
    shadow = np.zeros(picture.shape[:2], np.uint8)
    half, height = 0.5 * WIDTH, 0.5 * WIDTH * np.tan(np.radians(ANGLE))
    for side in sides:
        tip = 0.5 * picture.shape[1] + side * aside * half
        corners = [[tip - half, table], [tip, table - 0.9 * height], [tip + half, table]]
        cv2.fillPoly(shadow, [np.rint(16.0 * np.array(corners)).astype(np.int32)], 255, cv2.LINE_AA, 4)
    picture *= 1.0 - (1.0 - keeps) * (wall * shadow / 255.0)[:, :, None]
    noise = np.random.default_rng(0).normal(0.0, 2.0, picture.shape)
    return np.clip(np.rint(picture + noise), 0, 255).astype(np.uint8)


@pytest.mark.parametrize(
    ("keeps", "aside", "sides"), [(0.3, 0.2, (1,)), (0.6, 0.3, (-1,)), (0.3, 0.3, (1, -1))]
)
def test_a_sharp_shadow_is_no_part_of_the_heap(keeps: float, aside: float, sides: tuple[int, ...]) -> None:
    """A shadow on both sides, as part of the heap, makes the angle 4 degrees flatter at 0.2, and 6 at 0.3."""
    angle = measure(in_hard_light(keeps, aside, sides))
    assert angle.doubts == ()
    # The promise for smooth heaps of 400 pixels.
    assert angle.mean == pytest.approx(ANGLE, abs=0.3)


def test_a_sharp_shadow_hardly_moves_the_angle_of_grains() -> None:
    lit, angle = (measure(in_hard_light(keeps, 0.3, grain=14.0, texture=0.15)) for keeps in (1.0, 0.3))
    assert angle.doubts == ()
    # Two thirds of the standard error of such grains, .3 degrees.
    assert angle.mean == pytest.approx(lit.mean, abs=0.2)


@pytest.mark.parametrize(("keeps", "aside"), [(0.45, 0.2), (0.6, 0.3)])
def test_a_shadow_next_to_grains_of_the_walls_hue_is_doubted(keeps: float, aside: float) -> None:
    """Coal before a white wall: only its light, .26 of the wall's, tells it from its shadow."""
    angle = measure(in_hard_light(keeps, aside, color=COAL, grain=14.0, texture=0.15))
    assert angle.mean < ANGLE - 2.0
    assert "shade" in [doubt.name for doubt in angle.doubts]


@pytest.mark.parametrize("texture", [0.0, 0.15])
def test_a_powder_of_the_walls_hue_is_no_shadow(texture: float) -> None:
    """The powder is as even as a shadow and darker than the wall, but its edge is as light as its middle."""
    angle = measure(in_hard_light(1.0, 0.0, color=COAL, grain=14.0 if texture else 0.0, texture=texture))
    assert angle.doubts == ()
    # Two standard errors of flanks of 14 grains.
    assert angle.mean == pytest.approx(ANGLE, abs=0.64)


def test_the_edge_below_a_shadow_is_the_heaps() -> None:
    seen, lit = (
        contrast_with_background(in_hard_light(keeps, 0.3, (1,)), "drawn", np.float32)
        for keeps in (0.45, 1.0)
    )
    # Well under what the shadow differs by, .55 of the wall's 404.
    found, bare = (locate_heap(contrast, 60.0, None, View(), "drawn") for contrast in (seen, lit))
    share, shaded = shaded_edge(seen, found.rows, found.plate)
    assert share > MOST_SHADED
    tip = seen.values.shape[1] // 2
    middle = slice(tip, tip + round(0.4 * WIDTH))
    assert np.median((bare.rows - found.rows)[middle]) > 10.0
    # Two pixels are those of a blurred edge.
    assert np.median(np.abs(bare.rows - shaded)[middle]) < 2.5
