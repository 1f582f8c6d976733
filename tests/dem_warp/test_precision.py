"""Fixed-point positions are exact where they must be; the production precision follows float64."""

import numpy as np
import pytest
import warp as wp
from worlds import oblique_impact, record, solve

from dem_warp.device import resolve_device
from dem_warp.kernels.packing import packing
from dem_warp.state import struct_array
from dem_warp.types import DOUBLE, MIXED, device_structs

UNIT = 2.0**-34
HISTORY_STEPS = [0, 1, 255, 2**23, 2**24 + 1, 2**31 - 1]


def packing_kernel(precision):
    """Return a kernel that packs positions, takes their difference, and stamps a step on a displacement."""
    pack, types = packing(precision), device_structs(precision)
    real, vec3 = precision.real, precision.vec3

    @wp.kernel(module=f"tests_packing_{precision.name}", enable_backward=False)
    def probe(
        worlds: wp.array(dtype=types.World),
        a: wp.array(dtype=wp.vec3d),
        b: wp.array(dtype=wp.vec3d),
        steps: wp.array(dtype=int),
        difference_out: wp.array(dtype=vec3),
        place_out: wp.array(dtype=wp.vec3d),
        step_out: wp.array(dtype=int),
        radius_out: wp.array(dtype=real),
    ):
        i = wp.tid()
        world = worlds[0]
        p = pack.pack(a[i], real(0.25), world)
        q = pack.pack(b[i], real(0.5), world)
        difference_out[i] = pack.difference(p, q, world)
        place_out[i] = pack.place(p, world)
        radius_out[i] = pack.last(p) + pack.last(q)
        step_out[i] = pack.stamped_step(pack.stamp(vec3(real(1.0), real(2.0), real(3.0)), steps[i]))

    return probe


def probe(precision, a: np.ndarray, b: np.ndarray) -> dict[str, np.ndarray]:
    """Return positions `a` and `b` [m], (n, 3), after the packing of a world about (0.1, 0.2, 0.3)."""
    device = resolve_device("cpu")
    rows = [{"unit": UNIT if precision.is_fixed_point else 1.0, "origin": (0.1, 0.2, 0.3)}]
    worlds = struct_array(device_structs(precision).World, rows, device)
    n, real = len(a), np.float32 if precision is MIXED else np.float64
    out = {
        "difference": wp.array(np.full((n, 3), np.nan, real), dtype=precision.vec3, device=device),
        "place": wp.array(np.full((n, 3), np.nan), dtype=wp.vec3d, device=device),
        "step": wp.full(n, -7, dtype=int, device=device),
        "radius": wp.array(np.full(n, np.nan, real), dtype=precision.real, device=device),
    }
    steps = wp.array(np.resize(HISTORY_STEPS, n).astype(np.int32), dtype=int, device=device)
    arrays = [wp.array(x, dtype=wp.vec3d, device=device) for x in (a, b)]
    wp.launch(packing_kernel(precision), n, inputs=[worlds, *arrays, steps, *out.values()], device=device)
    return {name: array.numpy() for name, array in out.items()}


@pytest.fixture(scope="module")
def scattered():
    """Return positions all over a box of 0.08 m half width, and others within 0.5 mm of them."""
    rng = np.random.default_rng(3)
    a = rng.uniform(-0.08, 0.08, (500, 3)) + np.array([0.1, 0.2, 0.3])
    return a, a + rng.uniform(-0.5e-3, 0.5e-3, a.shape)


def test_a_fixed_point_position_is_the_nearest_count(scattered):
    seen = probe(MIXED, *scattered)
    # Half a count, and the rounding of a float64 of 0.4 m.
    np.testing.assert_allclose(seen["place"], scattered[0], rtol=0.0, atol=0.5 * UNIT + 1e-16)


def test_a_difference_of_fixed_point_positions_is_exact(scattered):
    a, b = scattered
    counts = [np.round((x - [0.1, 0.2, 0.3]) / UNIT) for x in (a, b)]
    # A difference below 1 mm has fewer than 2^24 counts, which float32 holds.
    np.testing.assert_array_equal(probe(MIXED, a, b)["difference"], (counts[0] - counts[1]) * UNIT)


@pytest.mark.parametrize("precision", [MIXED, DOUBLE], ids=lambda precision: precision.name)
def test_radii_and_steps_come_back_as_they_were_packed(scattered, precision):
    seen = probe(precision, *scattered)
    np.testing.assert_array_equal(seen["radius"], 0.75)
    np.testing.assert_array_equal(seen["step"], np.resize(HISTORY_STEPS, 500))


def oblique(precision: str, place=(0.0, 0.0, 0.0)):
    return record(solve(oblique_impact(place), precision=precision), 400)


def test_the_production_precision_follows_float64():
    exact, short = (oblique(precision) for precision in ("double", "mixed"))
    assert np.abs(np.diff(exact.velocities[[0, -1]], axis=0)).max() > 0.05
    # Each position is wrong by half a count, 6e-11 m, of an overlap of up to 7e-5 m: 1e-6 to 1e-5 of the
    # force, and so of the changes of speed and spin; float32 adds 6e-8 a step. Measured: 4e-10 m, 4e-7 m/s,
    # 3e-5 rad/s.
    for name, atol in (("positions", 1e-9), ("velocities", 1e-6), ("spins", 1e-4)):
        np.testing.assert_allclose(
            getattr(short, name), getattr(exact, name), rtol=0.0, atol=atol, err_msg=name
        )


def test_an_impact_far_from_the_origin_is_the_same():
    here = oblique("mixed")
    there = oblique("mixed", (0.0625, -0.0625, 0.03125))
    np.testing.assert_array_equal(here.velocities, there.velocities)
    np.testing.assert_array_equal(here.spins, there.spins)
