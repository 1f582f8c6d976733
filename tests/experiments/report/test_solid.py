"""Heaps to be turned: packed without a visible loss, small, and left out where no browser could draw them."""

import base64

import numpy as np
import pytest
from cone_engine import resting

from dem_warp import CaseResult
from experiments.report import solid
from experiments.report.solid import MOST_SPHERES, PIXELS, STEPS, SolidHeap


def heap(grains: int, spheres: int = 9) -> CaseResult:
    """Grains of some spheres at random places of a box of 50 mm."""
    clump = [[x, 0.0, 0.0, 0.002] for x in np.linspace(-0.001, 0.001, spheres)]
    return resting(np.random.default_rng(2).uniform(0.0, 0.05, (grains, 3)), clump)


def test_spheres_come_back_as_they_were() -> None:
    result = heap(30)
    packed = SolidHeap.of("A heap.", result)
    assert packed is not None
    words = np.frombuffer(base64.b64decode(packed.spheres), "<u2").reshape(-1, 4) / STEPS
    centers = np.array(packed.low) + packed.span * words[:, :3]
    # Half a step of 16 bits.
    np.testing.assert_allclose(centers, result.sphere_centers, atol=0.5001 * packed.span / STEPS)
    np.testing.assert_allclose(packed.largest * words[:, 3], result.sphere_radii, rtol=1e-4)
    grains = np.frombuffer(base64.b64decode(packed.grains), "<u2")
    np.testing.assert_array_equal(grains, result.sphere_grain)


def test_a_heap_of_thousands_of_grains_takes_half_a_megabyte(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(solid, "PIXELS", PIXELS)
    packed = SolidHeap.of("A heap.", heap(2490, 3))
    assert packed is not None
    # Ten bytes a sphere, four letters for three bytes; grains of nine spheres take three times as many.
    letters = len(packed.spheres) + len(packed.grains)
    assert letters == pytest.approx(10 * 3 * 2490 * 4 / 3, rel=1e-3)
    assert packed.picture.image.shape[1] > PIXELS
    assert 3 * letters + len(packed.picture.data_uri) < 0.6e6


def test_a_heap_that_no_phone_could_draw_is_left_out() -> None:
    assert SolidHeap.of("A heap.", heap(MOST_SPHERES // 9 + 1)) is None
    assert SolidHeap.of("No heap.", heap(0)) is None
