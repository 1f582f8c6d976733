"""The rain of grains: inside its tube, without overlap, reproducible."""

import numpy as np
import pytest
from worlds import PYRAMID, small_case, spheres_of

from dem_warp.device import resolve_device
from dem_warp.population import DrawnGrains
from dem_warp.scenes.rain import CrossSection, Rain, place_rain

RADIUS = 0.012
SPACING = 1.0e-4
COUNT = 150
# The device places in float32, whose rounding of 0.1 m is 4e-9 m; spheres keep 2 % of their radii apart.
ROUNDING = 1e-8


def rain(seeds=(1,), spacing: float = SPACING, radius: float = RADIUS) -> list[Rain]:
    """Rains of grains whose sizes follow from their seeds."""
    n = len(seeds)
    one = np.zeros(COUNT, dtype=int)
    bodies = [
        DrawnGrains((PYRAMID,), one, np.random.default_rng(seed).uniform(0.85, 1.15, COUNT)) for seed in seeds
    ]
    return place_rain(bodies, seeds, [CrossSection.circle(radius)] * n, [spacing] * n, resolve_device("cpu"))


def clearance(centers: np.ndarray, radii: np.ndarray, owner: np.ndarray) -> float:
    """Smallest gap between spheres of two grains [m]."""
    gap = np.linalg.norm(centers[:, None] - centers[None], axis=2) - radii[:, None] - radii[None]
    return float(gap[owner[:, None] != owner[None]].min())


def test_grains_start_apart_and_inside_the_tube():
    fall = rain()[0]
    poses = {"positions": fall.positions, "orientations": fall.orientations}
    centers, radii = spheres_of(PYRAMID, poses, fall.grains.sizes)
    owner = np.arange(len(radii)) // PYRAMID.sphere_count
    # Kept apart by 2 % of the sum of two radii, of which the smallest is 0.6 mm times 0.85.
    assert clearance(centers, radii, owner) > 0.02 * 2 * 0.85 * 0.6e-3 - ROUNDING
    assert (np.hypot(*centers.T[:2]) + radii < RADIUS).all()


def test_grains_arrive_in_order_and_at_their_rate_at_most():
    heights = rain()[0].positions[:, 2]
    assert (np.diff(heights) > SPACING - ROUNDING).all()
    # This dense a rain delays some grains.
    assert heights[-1] > (COUNT - 1) * SPACING + ROUNDING


def test_a_sparse_rain_keeps_its_rate():
    spacing = 3.0 * PYRAMID.bounding_radius
    heights = rain(spacing=spacing)[0].positions[:, 2]
    np.testing.assert_allclose(heights, np.arange(COUNT) * spacing, rtol=1e-6)


def test_grains_are_turned_and_spread_evenly():
    fall = rain(spacing=3.0 * PYRAMID.bounding_radius)[0]
    np.testing.assert_allclose(np.linalg.norm(fall.orientations, axis=1), 1.0, rtol=1e-12)
    # Four standard errors of a mean of 150: a uniform quaternion's component has variance 1/4, and a place in
    # a disc has variance r^2 / 4 in each direction.
    assert (np.abs(fall.orientations.mean(axis=0)) < 4 * 0.5 / np.sqrt(COUNT)).all()
    assert (np.abs(fall.positions[:, :2].mean(axis=0)) < 4 * 0.5 * RADIUS / np.sqrt(COUNT)).all()


def test_a_tube_too_narrow_for_the_grains_is_refused():
    with pytest.raises(
        ValueError, match=r"grains of \d\.\d\d mm in a container of 2\.00 mm; lower rain_rate"
    ):
        rain(radius=0.5e-3 * 2)


def test_the_scene_releases_each_grain_at_its_plane():
    case = small_case()
    setup = case.scene.prepare([case], resolve_device("cpu"))[0]
    bodies = setup.grains
    reach = setup.bounding_radii.max()
    plane = case.scene.height + PYRAMID.bounding_radius * bodies.sizes.max()
    released = bodies.positions[:, 2] - bodies.release_steps * case.time_step * case.scene.rain_speed
    # At the first step at or below the plane: a step of fall below it at most.
    assert (released <= plane + 1e-12).all()
    assert (released > plane - case.time_step * case.scene.rain_speed - 1e-12).all()
    assert plane >= case.scene.height + reach
    np.testing.assert_array_equal(
        bodies.velocities, np.tile([0.0, 0.0, -case.scene.rain_speed], (bodies.count, 1))
    )
    # Every grain that the tube may hold, and more, is kept ready within the domain.
    assert bodies.count * PYRAMID.volume > 0.55 * case.scene.volume
    assert (np.abs(bodies.positions - setup.origin) < setup.half_extent).all()
