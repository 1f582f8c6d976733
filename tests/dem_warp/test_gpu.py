"""The GPU: the same bits with any number of lanes and in any batch, and the CPU's motion within rounding."""

import numpy as np
import pytest
import warp as wp
from worlds import assert_same_bits, assert_same_result, oblique_impact, pile, small_case, solve, state

from dem_warp import CaseResult, simulate
from dem_warp.batch import Batch
from dem_warp.checkpoint import Checkpoints
from dem_warp.device import resolve_device
from dem_warp.model import WorldSetup
from dem_warp.solver import Solver

resolve_device(None)  # starts Warp, quietly, before it is asked for devices
pytestmark = [
    pytest.mark.gpu,
    pytest.mark.skipif(not wp.is_cuda_available(), reason="needs a CUDA device"),
]


def run(*setups: WorldSetup, chunks: int = 60) -> Solver:
    """Solver on the GPU after some chunks in the production precision."""
    solver = solve(*setups, precision="mixed", device="cuda")
    solver.advance(chunks)
    assert not solver.flags.numpy().any()
    return solver


def test_the_number_of_lanes_does_not_change_the_bits(monkeypatch):
    runs = []
    for lanes in (4, 8, 16, 32):
        monkeypatch.setattr(Solver, "lanes", lanes)
        runs.append(state(run(pile(1))))
    for other in runs[1:]:
        assert_same_bits(other, runs[0])


def test_the_batch_does_not_change_the_bits():
    alone = state(run(pile(1)))
    together = run(pile(2), pile(3, count=31), pile(1), pile(4, count=5))
    assert_same_bits(state(together, 2), alone)


def test_an_interruption_and_another_batch_do_not_change_the_bits(tmp_path):
    def finish(batch: Batch) -> dict[int, CaseResult]:
        results = {}
        while batch.running:
            results.update(batch.advance())
        return results

    device, cases = resolve_device("cuda"), [small_case(seed) for seed in range(31)]
    alone = finish(Batch([cases[7]], device))[0]
    batch = Batch(cases, device, Checkpoints(tmp_path))
    while batch.phase(7) != "lift":
        batch.advance()
    batch.save()
    assert_same_result(finish(batch)[7], alone)
    resumed = Batch([cases[2], cases[7]], device, Checkpoints(tmp_path))
    assert min(resumed.steps) > 0
    assert_same_result(finish(resumed)[1], alone)


def test_an_impact_follows_the_cpu():
    ends = {}
    for precision, device in (("double", "cpu"), ("double", "cuda"), ("mixed", "cuda")):
        solver = solve(oblique_impact(), precision=precision, device=device)
        solver.advance(2)
        ends[precision, device] = state(solver)
    exact = ends["double", "cpu"]
    for name in ("velocities", "spins"):
        # Rounding of 1e-16 a step in float64; half a count of position, and float32 of fast arithmetic, in
        # the other (the CPU's production precision differs from float64 by 4e-7 m/s and 3e-5 rad/s at the
        # most).
        np.testing.assert_allclose(ends["double", "cuda"][name], exact[name], rtol=1e-10, atol=1e-12)
        short = {"velocities": 2e-6, "spins": 2e-4}[name]
        np.testing.assert_allclose(ends["mixed", "cuda"][name], exact[name], rtol=0.0, atol=short)


def test_a_lifted_cylinder_ends_in_a_heap_like_the_cpu_s():
    on_gpu, on_cpu = (simulate([small_case()], device=device, workers=1)[0] for device in ("cuda", "cpu"))
    assert on_gpu.status == on_cpu.status == "finished"
    # The motion is chaotic, so heaps agree as two seeds do: seventy grains pack within some per cent.
    for name, tolerance in (("solid_fraction", 0.1), ("fill_height", 0.1), ("grain_count", 0.2)):
        assert on_gpu.observables[name] == pytest.approx(on_cpu.observables[name], rel=tolerance)
