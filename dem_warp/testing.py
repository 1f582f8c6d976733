"""Conformance tests for laws and scenes of a package's own, to run in its tests.

A check takes a law with its parameters, or a small case of a scene, and raises AssertionError on a problem::

    @pytest.mark.parametrize("check", LAW_CHECKS)
    def test_my_law(check):
        check(MyLaw(strength=1.0))
"""

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dem_warp.batch import Batch
from dem_warp.case import Case
from dem_warp.clumps import ClumpShape
from dem_warp.device import resolve_device
from dem_warp.laws.library import MECHANISMS
from dem_warp.laws.mechanism import Mechanism
from dem_warp.materials import Interaction, Material
from dem_warp.model import ContactCoefficients, Grains, WorldSetup
from dem_warp.result import CaseResult
from dem_warp.snapshot import put_snapshot, take_snapshot
from dem_warp.solver import Solver
from dem_warp.walls import Plane

RADIUS, DENSITY = 5e-3, 1000.0
"""Radius [m] and density [kg/m3] of the two spheres of a law's checks."""

TIME_STEP = 4e-6
"""Time step of a law's checks [s]: an impact takes about 100 steps."""

_MATERIAL = Material(DENSITY, 10e6, 0.25)
_SPEED_ONLY = "rebuilds"


def require(condition: object, problem: str) -> None:
    """Raise AssertionError with the problem unless the condition holds."""
    if not condition:
        raise AssertionError(problem)


def two_spheres(gap: float, *laws: Mechanism) -> WorldSetup:
    """Return a world of two spinning spheres at a gap [m] that meet off-centre above a plane."""
    ball = ClumpShape.sphere(RADIUS)
    mass = DENSITY * ball.volume
    surface = Interaction(0.5, 0.3, 0.05)
    contact = ContactCoefficients.of_pair(
        _MATERIAL, _MATERIAL, surface, mechanisms=laws, radius=RADIUS, mass=mass
    )
    grains = Grains(
        positions=np.array([[0.0, 0.0, RADIUS], [0.0, 0.0, 3.0 * RADIUS + gap]]),
        orientations=np.tile([0.0, 0.0, 0.0, 1.0], (2, 1)),
        velocities=np.array([[0.0, 0.0, 0.05], [0.02, 0.0, -0.05]]),
        spins=np.array([[1.0, -2.0, 3.0], [0.0, 4.0, 0.0]]),
        sizes=np.ones(2),
        densities=np.full(2, DENSITY),
        shapes=np.zeros(2, dtype=int),
        release_steps=np.zeros(2, dtype=int),
    )
    return WorldSetup(
        grains=grains,
        shapes=(ball,),
        contacts=(contact, contact),
        walls=((Plane(point=(0.0, 0.0, -1.0)), 1), (Plane(), 1)),
        time_step=TIME_STEP,
        skin=2e-3,
        speed_limit=20.0,
        domain=((-0.1, -0.1, -0.1), (0.1, 0.1, 0.1)),
        gravity=(0.0, 0.0, 0.0),
        weighed=(1,),
    )


def _run(*worlds: WorldSetup, chunks: int = 2) -> Solver:
    solver = Solver(worlds, resolve_device("cpu"), "double")
    solver.advance(chunks)
    return solver


def _require_same_world(one: Solver, other: Solver, what: str, index: int = 0) -> None:
    for name, values in one.poses(0).items():
        require(np.array_equal(values, other.poses(index)[name]), f"{what}: the {name} differ")


def _changed(law: Mechanism, name: str, value: float) -> Mechanism:
    change: dict[str, Any] = {name: value}
    return replace(law, **change)


def _null(law: Mechanism) -> Mechanism:
    return _changed(law, law.strength, 0.0)


def law_null_is_the_base_law(law: Mechanism) -> None:
    """Check that strength 0 gives the base law: the same bits in one kernel, and to rounding in another."""
    null, other = _run(two_spheres(-1e-5, type(law)())), _run(two_spheres(-1e-5, _null(law)))
    _require_same_world(null, other, f"{law.name} with {law.strength} 0 and other parameters")
    base = _run(two_spheres(-1e-5)).poses(0)
    for name, values in null.poses(0).items():
        close = np.allclose(values, base[name], rtol=1e-11, atol=1e-14)
        require(close, f"{law.name} with {law.strength} 0: the {name} differ from the base law")


def law_has_the_same_bits_in_a_batch(law: Mechanism) -> None:
    """Check that a world is the same alone and in a batch with others."""
    worlds = two_spheres(-1e-5, law), two_spheres(-2e-5, law)
    _require_same_world(_run(worlds[1]), _run(*worlds), f"{law.name}, in a batch", index=1)


def law_acts_only_within_its_reach(law: Mechanism) -> None:
    """Check that a law changes a contact, and nothing before the first touch or beyond its reach."""
    touching = [_run(two_spheres(-1e-5, one)).poses(0) for one in (law, _null(law))]
    acts = any(not np.array_equal(touching[0][name], touching[1][name]) for name in touching[0])
    require(acts, f"{law.name} changes no contact")
    reach = law.reach(RADIUS, two_spheres(0.0, law).contacts[0].modulus)
    require(law.acts_apart or reach == 0.0, f"{law.name} must have acts_apart for a reach of {reach:g} m")
    far = two_spheres(1.1 * reach + 1e-3, law)
    still = replace(far.grains, velocities=np.zeros((2, 3)), spins=np.zeros((2, 3)))
    solver = _run(replace(far, grains=still, walls=tuple((Plane((0.0, 0.0, -1.0)), 1) for _ in far.walls)))
    require(not solver.poses(0)["velocities"].any(), f"{law.name} acts on surfaces beyond its reach")


def law_resumes(law: Mechanism) -> None:
    """Check that a contact continues from a snapshot with the same bits."""
    world = two_spheres(0.0, law)
    whole, resumed = _run(world, chunks=1), Solver([world], resolve_device("cpu"), "double")
    put_snapshot(resumed, 0, take_snapshot(whole, 0))
    whole.advance(1)
    resumed.advance(1)
    _require_same_world(whole, resumed, f"{law.name}, resumed")


def law_checks_its_parameters(law: Mechanism) -> None:
    """Check the names of a law's parameters, and that each must be a number."""
    require(law.strength in law.parameter_names(), f"{law.name}: strength must be the name of a parameter")
    require(MECHANISMS.get(law.name) is type(law), f"{law.name}: must be the entry of dem_warp.laws")
    for name in law.parameter_names():
        try:
            _changed(law, name, math.nan)
        except ValueError as error:
            require(name in str(error), f"{law.name}: the error must name {name}, got {error}")
        else:
            raise AssertionError(f"{law.name}.{name}: must not be NaN")


LAW_CHECKS: Sequence[Callable[[Mechanism], None]] = (
    law_null_is_the_base_law,
    law_has_the_same_bits_in_a_batch,
    law_acts_only_within_its_reach,
    law_resumes,
    law_checks_its_parameters,
)
"""Checks of a law with parameters at which it acts."""


def _finish(batch: Batch) -> dict[int, CaseResult]:
    results: dict[int, CaseResult] = {}
    while batch.running:
        results.update(batch.advance())
    return results


@functools.lru_cache(maxsize=8)
def _alone(case: Case[Any]) -> CaseResult:
    return _finish(Batch([case], resolve_device("cpu")))[0]


def _other(case: Case[Any]) -> Case[Any]:
    return replace(case, seed=case.seed + 1)


def _require_same_result(one: CaseResult, other: CaseResult, what: str) -> None:
    for name in ("status", "reason", "phases"):
        require(getattr(one, name) == getattr(other, name), f"{what}: the {name} differs")
    for name in ("positions", "orientations", "sizes", "shapes"):
        require(np.array_equal(getattr(one, name), getattr(other, name)), f"{what}: the {name} differ")
    found = [
        {name: value for name, value in result.observables.items() if name != _SPEED_ONLY}
        for result in (one, other)
    ]
    require(found[0] == found[1], f"{what}: the observables differ")


def scene_prepares_worlds(case: Case[Any]) -> None:
    """Check that worlds have grains in their domain, and depend on their case alone."""
    device = resolve_device("cpu")
    [alone] = case.scene.prepare([case], device)
    _, together = case.scene.prepare([_other(case), case], device)
    require(alone.grains.count > 0, "a world must have grains")
    low, high = alone.domain
    require(((low < alone.grains.positions) & (alone.grains.positions < high)).all(), "a grain is outside")
    same = np.array_equal(alone.grains.positions, together.grains.positions)
    require(same, "the places of the grains must depend on the case alone")


def scene_ends(case: Case[Any]) -> None:
    """Check that the case finishes, with its phases."""
    result = _alone(case)
    require(result.status == "finished", f"the case must finish, got {result.status}: {result.reason}")
    require(result.phases, "the case must have phases")


def scene_measures_its_observables(case: Case[Any]) -> None:
    """Check that every measured number is declared and finite."""
    for name, value in _alone(case).observables.items():
        declared = name == _SPEED_ONLY or name in case.scene.observables
        require(declared, f"{name} must be in the observables of the scene")
        require(math.isfinite(value), f"{name} must be finite, got {value}")


def scene_is_isolated(case: Case[Any]) -> None:
    """Check that a case is the same alone and in a batch with another."""
    together = _finish(Batch([_other(case), case], resolve_device("cpu")))
    _require_same_result(_alone(case), together[1], "in a batch")


def scene_resumes(case: Case[Any]) -> None:
    """Check that a case that continues halfway from its state and snapshot ends with the same result."""
    device = resolve_device("cpu")
    half = sum(phase["steps"] for phase in _alone(case).phases) // 2
    first, second = Batch([case], device), Batch([case], device)
    while first.steps[0] < half and first.running:
        first.advance()
    put_snapshot(second.solver, 0, take_snapshot(first.solver, 0))
    second.controllers[0].state, second.steps[0] = first.controllers[0].state, first.steps[0]
    _require_same_result(_alone(case), _finish(second)[0], "resumed")


SCENE_CHECKS: Sequence[Callable[[Case[Any]], None]] = (
    scene_prepares_worlds,
    scene_ends,
    scene_measures_its_observables,
    scene_is_isolated,
    scene_resumes,
)
"""Checks of a scene with a small case that finishes."""
