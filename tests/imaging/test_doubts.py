"""Doubts about an angle, by outlines whose heap and board are known."""

from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from drawn_heaps import Camera, DrawnHeap, draw

from imaging import PictureError, measure
from imaging.flank.outline import Outline
from imaging.flank.plate_line import PlateLine
from imaging.photo.doubts import LARGEST_CLIFF, LARGEST_ERROR, ROUGH_EDGE, doubts_of, highest_cliff


def outline(wing: float, step: float = 30.0, half: float = 150.0) -> Outline:
    """Outline of a heap of 30 degrees, at each side of it so much of a board's top with its bevelled edge."""
    reach = half + wing
    position = np.arange(-reach, reach + 1.0)
    heap = np.tan(np.radians(30.0)) * (half - np.abs(position))
    board = np.minimum(step, 0.5 * (reach - np.abs(position))) if wing else np.zeros_like(position)
    height = np.maximum(heap, 0.0) + board + 1.0
    return Outline(position + reach, height, PlateLine(400.0, 0.0, visible=True), photographed=True)


def names(seen: Outline) -> list[str]:
    return [doubt.name for doubt in measure(seen).doubts]


@pytest.mark.parametrize("wing", [100.0])
def test_a_boards_top_inside_the_outline_is_a_step_in_the_flanks(wing: float) -> None:
    assert "step" in names(outline(wing))


def test_a_straight_heap_has_no_step() -> None:
    assert names(outline(0.0)) == []


def test_a_hollow_heap_has_no_step() -> None:
    # The flank of a heap whose slope falls from 1.3 to 0.7 of its mean towards the foot.
    flat = outline(0.0)
    share = flat.height / flat.height.max()
    hollow = flat.height.max() * (0.7 * share + 0.3 * share**2)
    seen = Outline(flat.position, hollow + 1.0, flat.plate, photographed=True)
    assert "step" not in names(seen)


@pytest.mark.parametrize(
    ("left", "right", "expected"), [(0, 32, ["foot"]), (32, 0, ["foot"]), (16, 16, []), (0, 16, [])]
)
def test_a_foot_in_the_shade_ends_before_its_line_does(left: int, right: int, expected: list[str]) -> None:
    # 32 of 300 columns of the base are more than the 0.08 of it that good heaps differ by, 16 are less
    whole = outline(0.0)
    seen = slice(left, len(whole.position) - right)
    cut = Outline(whole.position[seen] - left, whole.height[seen], whole.plate, photographed=True)
    assert [name for name in names(cut) if name == "foot"] == expected


@pytest.mark.parametrize("missed", [0.35, 0.15])
@pytest.mark.parametrize("side", [1, -1])
def test_a_foot_that_is_missed_leaves_a_cliff(missed: float, side: int) -> None:
    # the foot looks like the wall behind it, and the outline follows the plate's far edge
    whole = outline(0.0)
    height = whole.height.copy()
    reach = int(missed * len(height) / 2)
    height[:reach] = 1.0
    seen = Outline(whole.position, height[::side], whole.plate, photographed=True)
    # the height there is in proportion to the distance from the foot; the blur of an edge is a pixel in 88
    assert highest_cliff(seen) == pytest.approx(missed, abs=0.03)
    assert any("missing" in str(doubt) for doubt in measure(seen).doubts) == (missed > LARGEST_CLIFF)


def test_a_stray_column_is_no_cliff() -> None:
    whole = outline(0.0)
    height = whole.height.copy()
    height[20] = height.max() / 2
    assert highest_cliff(Outline(whole.position, height, whole.plate, photographed=True)) < 0.1


@pytest.mark.parametrize(
    ("se", "shown", "looked"), [(0.7, [], []), (0.8, ["error"], []), (1.1, ["error"], ["error"])]
)
def test_an_angle_is_doubted_before_another_look_is_taken(
    se: float, shown: list[str], looked: list[str]
) -> None:
    seen = outline(0.0)
    angle = measure(seen)
    for limit, expected in ((LARGEST_ERROR, shown), (ROUGH_EDGE, looked)):
        found = doubts_of(angle.left_line, angle.right_line, angle.mean, se, seen, limit)
        assert [doubt.name for doubt in found] == expected


def test_a_ragged_heap_of_few_grains_is_not_said_to_have_a_board_or_a_shadow() -> None:
    """Grains of a seventh of the heap's width; the findings about their flanks."""
    found = []
    for seed in range(4):
        picture = draw(DrawnHeap(28.0, 28.0, grain=60.0, seed=seed), Camera(noise=2, seed=seed))
        with suppress(PictureError):
            found += [str(each) for each in measure(picture).doubts if "as steep as" in each.finding]
    assert len(found) > 3
    assert all("few grains" in finding and "board" not in finding for finding in found)


def test_a_doubt_about_the_error_prints_the_error_of_the_table() -> None:
    clean = outline(0.0)
    rough = clean.height + np.random.default_rng(4).normal(0.0, 9.0, len(clean.height))
    angle = measure(replace(clean, height=rough, elevation=10.0))
    # a camera from above adds to the error of the lines, .80 degrees
    assert [str(doubt) for doubt in angle.doubts] == [
        f"error: a standard error of {angle.se:.2f} degrees, over 0.75"
    ]
    assert angle.se > 1.0
