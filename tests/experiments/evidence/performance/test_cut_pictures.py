"""Pictures of scenes cut in the middle: where walls and grains are drawn."""

from __future__ import annotations

import numpy as np
import pytest

from dem_warp import Hopper
from dem_warp.walls import Cone, Cylinder, Disc, Mesh, Plane
from experiments.evidence.performance.cut_pictures import (
    DARK,
    LIGHT,
    PIXELS,
    View,
    draw_cut,
    layers,
    speeds,
    wall_section,
)
from experiments.evidence.performance.scenes import STEEL, Sketch, run

STILL = np.zeros(3)
VIEW = View(half_width=0.012, bottom=-0.002, top=0.01)
WHITE = np.full(3, 255)


def test_walls_about_an_upright_axis_are_cut_into_two_lines():
    up = np.array([0.0, 0.0, 0.5])
    tube = wall_section(Cylinder((0.0, 0.0, 1.0), 2.0, 3.0), up)
    assert [line.tolist() for line in tube] == [[[-2.0, 1.5], [-2.0, 4.5]], [[2.0, 1.5], [2.0, 4.5]]]
    funnel = wall_section(Cone((0.0, 0.0, 0.0), 1.0, 2.0, 3.0), STILL)
    assert [line.tolist() for line in funnel] == [[[-1.0, 0.0], [-2.0, 3.0]], [[1.0, 0.0], [2.0, 3.0]]]
    floor = wall_section(Disc((0.0, 0.0, 1.0), (0.0, 0.0, 1.0), 2.0, 0.5), STILL)
    assert [line.tolist() for line in floor] == [[[-2.0, 1.0], [-0.5, 1.0]], [[2.0, 1.0], [0.5, 1.0]]]


def test_a_lying_drum_is_cut_into_a_circle_and_its_ends_not_at_all():
    axis = (0.0, 1.0, 0.0)
    [circle] = wall_section(Cylinder((0.0, -1.0, 3.0), 2.0, 2.0, axis), STILL)
    np.testing.assert_allclose(np.hypot(circle[:, 0], circle[:, 1] - 3.0), 2.0, rtol=1e-12)
    assert wall_section(Disc((0.0, -1.0, 3.0), axis, 2.0), STILL) == []


def test_a_level_plane_is_a_line_and_a_mesh_is_cut_triangle_by_triangle():
    [line] = wall_section(Plane(), STILL)
    assert (line[:, 1] == 0.0).all()
    shelf = Mesh.plates([[(1.0, -1.0, 2.0), (3.0, -1.0, 2.0), (3.0, 1.0, 2.0), (1.0, 1.0, 2.0)]])
    lines = np.vstack(wall_section(shelf, STILL))
    assert (lines[:, 1] == 2.0).all()
    assert (lines[:, 0].min(), lines[:, 0].max()) == (1.0, 3.0)
    # A plate that lies beside the cut.
    assert wall_section(shelf, np.array([0.0, 1.5, 0.0])) == []


def test_plates_need_four_corners():
    with pytest.raises(ValueError, match=r"Mesh.plates: must have shape \(k, 4, 3\), got \(1, 3, 3\)"):
        Mesh.plates(np.zeros((1, 3, 3)))


def test_grains_and_walls_are_drawn_where_they_are():
    center, radius = np.array([[0.004, 0.001, 0.003]]), np.array([0.002])
    wall = np.array([[-0.006, 0.0], [-0.006, 0.008]])
    picture = draw_cut(center, radius, DARK[None], [wall], VIEW)
    scale = 2.0 * VIEW.half_width / PIXELS

    def pixel(x: float, z: float) -> np.ndarray:
        return picture[round((VIEW.top - z) / scale), round((x + VIEW.half_width) / scale)]

    assert picture.shape[1] == PIXELS
    for x, z, is_empty in [
        (0.004, 0.003, False), (0.0055, 0.003, False), (0.0065, 0.003, True), (0.004, 0.0053, True),
        (-0.006, 0.004, False), (-0.007, 0.004, True), (-0.006, 0.009, True), (-0.006, -0.001, True),
    ]:  # fmt: skip
        assert (pixel(x, z) == WHITE).all() == is_empty, (x, z)


def test_colours_tell_layers_and_speeds():
    heights = np.array([1.1, 1.3, 1.6, 1.8])
    np.testing.assert_array_equal(layers(heights, 1.0, 2.0), [DARK, LIGHT, DARK, LIGHT])
    velocities = np.array([[0.0, 0.0, 0.0], [0.0, 3.0, 4.0]])
    np.testing.assert_array_equal(speeds(velocities), [DARK, LIGHT])


def test_a_scene_is_drawn_at_its_end_where_its_moment_never_comes():
    hopper = Hopper(diameter=0.02, fill_depth=0.01, outlet=0.002, wall_material=STEEL)
    result, picture = run(Sketch(hopper, VIEW, phase="never", after=0.0), 2e-3, "cpu")
    assert result.reason.startswith("the outlet is clogged")
    assert (picture != 255).any()
