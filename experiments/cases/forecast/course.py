"""The expected course of a test before it runs: how long each stage takes, how fast grains move, how many."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from dem_warp import Case, DrawDown, Drum, Hopper, LiftedCylinder, effective_moduli
from dem_warp.device import resolve_device
from dem_warp.model import GRAVITY
from dem_warp.scenes.lifted_cylinder import GONE
from dem_warp.scenes.poured_scene import PouredScene
from dem_warp.solver import CHUNK

BULK_FRACTION = 0.55
"""Solid fraction of a poured bed, roughly."""

SLOPE = math.tan(math.radians(35.0))
"""Slope of a heap while the tube still leads it, roughly: its top is what the tube must clear."""

FALL, CALM, CALM_FULL, REST = 0.25, 0.1, 0.2, 0.35
"""Time that the last grain of a counted rain takes to lie still, a bed of counted grains to be at rest, one
that was struck off while the rain still fell, and a heap [s]."""

TRICKLE, TRICKLE_ANGULAR, TRICKLE_BIN = 1.4, 0.5, 0.7
"""Time that the last grains take to trickle down and to rest, beyond the flow [s]: of a draw-down, with
grains that roll (0.7 to 2.2 in eight runs, balls of 2.5 to 4 mm radius and slots of 36 to 60 mm) and with
others (0.3 in one), and of a bin (0.1 to 1.4 in three: a slope that stood for a while may slide at last)."""

LEFT = 0.2
"""Part of the grains that trickles out of a bin, or stays in its corners, roughly."""

FALLING, LANDING, CALMING, HEAPING, FLOWING = 0.75, 0.45, 0.1, 0.23, 0.5
"""Speed of the fastest grain over the scene's `top_speed`, in the mean over a rain, over a counted one with
the time in which its last grains come to lie, over the rest of a bed, the making of a heap, and a flow: seen
in eighteen runs of all tests, mostly the same within a third."""

HANGING = 1.5
"""Speed of the fastest grain over the tube's, where grains hang on it and sway: 1 to 2 in a run."""

COLLAPSE, RUN_OUT = 4.0, 0.27
"""Diameters of a grain that the tube is lifted by, but no more than the bed's height, when grains that roll
flow out fastest; and their speed then, over that of a fall from the bed's height: as seen in two runs."""

BEVERLOO = 0.58, 1.4
"""C and k of Beverloo's law for a round hole: a flow of C (bulk density) sqrt(g) (D - k d)^(5/2)."""

SURVEYED = 5.0
"""Times that a look at a drum that turns, whose surface is measured at each, takes the host over a look at a
heap: 300 to 360 us against 60 to 80 on one core (`experiments/evidence/performance/README.md`)."""

ROLLS = 2.0
"""Times that a rod rolls the length of a tilted plate before all are at rest: some start late."""


class Stage(NamedTuple):
    """A part of a test's course."""

    time: float
    """Duration [s]."""
    pace: float
    """Speed of its fastest grain, in the mean over the stage [m/s]."""
    present: float
    """Part of the grains kept ready that are there."""
    tended: float = 1.0
    """Time that a look at the scene takes the host, over that of a look at a heap."""


def expected_course(case: Case[Any], grains: int) -> list[Stage]:
    """Stages of a poured test whose supply is so many grains."""
    scene: PouredScene = case.scene
    counted, top = scene.grain_count is not None, scene.top_speed
    filled = BULK_FRACTION * scene.volume / (grains * grain_volume(case))
    share = 1.0 if counted else min(filled, 1.0)
    rain = grains / scene.rain_rate * share
    stages = [
        Stage(rain + (FALL if counted else 0.0), (LANDING if counted else FALLING) * top, 1.0),
        Stage(CALM if counted else CALM_FULL, CALMING * top, share),
    ]
    if not isinstance(scene, LiftedCylinder):
        return [*stages, *_own_stages(case, share)]
    lift = [stage._replace(present=share * stage.present) for stage in _lift(case, grains)]
    if scene.duration is not None:
        given = max(scene.duration - sum(stage.time for stage in stages), 0.0)
        taken = sum(stage.time for stage in lift)
        lift = [stage._replace(time=given * stage.time / taken) for stage in lift]
    return [*stages, *lift]


def _own_stages(case: Case[Any], share: float) -> list[Stage]:
    """Stages of a test, other than a lifted cylinder, after its bed is at rest."""
    scene, pace = case.scene, FLOWING * case.scene.top_speed
    if isinstance(scene, Hopper):
        return [Stage(_flow_time(case), pace, 0.5 * share), Stage(TRICKLE_BIN, pace, LEFT * share)]
    if isinstance(scene, Drum):
        turns = scene.start_up / scene.rotation_rate, scene.revolutions / scene.rotation_rate
        return [Stage(turns[0], pace, share), Stage(turns[1], pace, share, SURVEYED)]
    stages = [Stage(_own_phases(_Test(scene, case)), pace, share)]
    if isinstance(scene, DrawDown):
        stages.append(Stage(TRICKLE if _rolls(case) else TRICKLE_ANGULAR, pace, share))
    return stages


def _flow_time(case: Case[Hopper]) -> float:
    """Time in which a bin runs out, after Beverloo, Leniger and van de Velde (1961) [s]."""
    scene, (rate, lost) = case.scene, BEVERLOO
    opening = max(scene.outlet - lost * _diameter(case), _diameter(case))
    return float(scene.volume / (rate * math.sqrt(GRAVITY) * opening**2.5))


def _lift(case: Case[LiftedCylinder], grains: int) -> list[Stage]:
    """From the start of the lift to rest, of all the grains that were filled in."""
    scene = case.scene
    bulk = min(grains * grain_volume(case) / BULK_FRACTION, scene.volume)
    height = (3.0 * bulk * SLOPE**2 / math.pi) ** (1.0 / 3.0)
    moved, pace = max(height / scene.lift_speed, scene.vibration_time), HEAPING * scene.top_speed
    if hangs_on_walls(case):
        # taken away with the tube at a height; what hangs on its rim, where the world ends
        leaves = GONE * scene.height
        ceiling = max(scene.brim + scene.rain_speed * grains / scene.rain_rate, leaves)
        hanging = max(0.5 * (leaves + ceiling) / scene.lift_speed - moved, 0.0)
        return [Stage(moved, pace, 1.0), Stage(hanging + REST, HANGING * scene.lift_speed, 1.0)]
    if (way := _roll(case)) is not None:
        return [Stage(moved, pace, 1.0), way]
    return [Stage(max(moved + REST, _run_out(case, bulk)), pace, 1.0)]


def _run_out(case: Case[LiftedCylinder], bulk: float) -> float:
    """Time at which grains that roll out of a tube, of so much bulk [m3], are at rest on the plate [s]."""
    scene = case.scene
    if not _rolls(case):
        return 0.0
    bed = bulk / scene.volume_below(1.0)
    speed = RUN_OUT * math.sqrt(2.0 * GRAVITY * bed)
    braked = 5.0 / 7.0 * GRAVITY * case.grain_wall.rolling_friction * (1.0 + pull_on_walls(case))
    rolling = min(speed / max(braked, 1.0e-9), scene.room(0.0)[0] / speed)
    return min(COLLAPSE * _diameter(case), bed) / scene.lift_speed + rolling


def _roll(case: Case[LiftedCylinder]) -> Stage | None:
    """Grains that roll down a tilted plate; None where they do not, or stay where they fall."""
    scene = case.scene
    if scene.tilt == 0.0:
        return None
    load = math.cos(scene.tilt) + pull_on_walls(case)
    drive = math.sin(scene.tilt) - case.grain_wall.rolling_friction * load
    if drive <= 0.0 or not _rolls(case):
        return None
    length = scene.room(0.0)[0] if scene.plate_diameter is None else scene.plate_diameter / 2
    time = math.sqrt(2.0 * length / (5.0 / 7.0 * GRAVITY * drive))
    pace = 2.0 * length / time  # the top of a grain that rolls moves twice as fast as it
    # a heap of balls rolls away altogether, grain after grain; rods lie across, and most of them stay
    balls = case.grains.sphere_count == 1
    return Stage(time, pace, 0.5) if balls else Stage(ROLLS * time + REST, pace, 1.0)


def _rolls(case: Case[Any]) -> bool:
    """Tell that some grains of a case are balls or rods, which have no feet to stand on."""
    return min(map(_directions, case.grains.mixture.shapes)) <= 1


def _directions(shape: Any) -> int:
    """Directions that the spheres of a shape lie in: none of a ball, one of a rod; both can roll."""
    centers = np.asarray(shape.centers) - np.mean(shape.centers, axis=0)
    return int(np.linalg.matrix_rank(centers, tol=0.1 * float(shape.radii.mean())))


def _diameter(case: Case[Any]) -> float:
    """Diameter of a ball of a grain's volume [m]."""
    return 2.0 * (3.0 * grain_volume(case) / (4.0 * math.pi)) ** (1.0 / 3.0)


def grain_volume(case: Case[Any]) -> float:
    """Mean volume of the grains of a case [m3]."""
    return float(case.grains.mean(lambda shape: shape.volume)) * case.grains.size_mean**3


# ---- grains that hang on walls -----------------------------------------------------------------------------


def _area_pull(density: float, radius: float, modulus: float) -> float:
    """Push of a contact at rest under an attraction by its area [N]: overlap R (3 pi k / (2 E*))^2."""
    overlap = radius * (3.0 * math.pi * density / (2.0 * modulus)) ** 2
    return density * 2.0 * math.pi * radius * overlap


PULLS: dict[str, Callable[[Any, float, float], float]] = {
    "linear_cohesion": lambda law, r, e: _area_pull(law.cohesion_energy_density, r, e),
    "wall_adhesion": lambda law, r, e: _area_pull(law.wall_adhesion_energy_density, r, e),
    # Hertz's force at the overlap a^2 / (3 R) of a contact without load, a^3 = 9 pi W R^2 / (2 E*)
    "jkr": lambda law, r, e: 6.0 * math.pi / 27.0**0.5 * law.work_of_adhesion * r,
    "capillary_bridge": lambda law, r, e: (
        4.0 * math.pi * r * law.surface_tension * math.cos(law.contact_angle)
    ),
}
"""Force [N] that a law presses a sphere of a radius [m] on a wall with, where nothing else does, by its name;
the last argument is E* [Pa]."""


def hangs_on_walls(case: Case[Any]) -> bool:
    """Tell whether a grain that touches an upright wall with one sphere hangs on it, held by friction."""
    return case.grain_wall.static_friction * pull_on_walls(case) > 1.0


def pull_on_walls(case: Case[Any]) -> float:
    """Force that presses a grain on a wall, touched with one sphere, over its weight: of known laws."""
    laws = [law for law in case.mechanisms if law.acts_between("walls") and law.name in PULLS]
    if not laws:
        return 0.0
    radius = float(case.grains.mean(lambda shape: float(shape.radii.mean()))) * case.grains.size_mean
    modulus = effective_moduli(case.grain_material, case.scene.wall_material)[0]
    weight = grain_volume(case) * case.grain_material.density * GRAVITY
    return sum(PULLS[law.name](law, radius, modulus) for law in laws) / weight


# ---- phases that a test itself tells -----------------------------------------------------------------------


@dataclass(frozen=True)
class _Test:
    """A test whose phases take as long for every case of it."""

    scene: Any
    case: Any = field(compare=False)


@lru_cache(maxsize=256)
def _own_phases(test: _Test) -> float:
    """Time that a test expects of its phases after the filling [s]."""
    [setup] = test.scene.prepare([test.case], resolve_device(None))
    phases = test.scene.controller(test.case, setup, CHUNK).phases
    return float(sum(phase.expected for name, phase in phases.items() if name not in ("fill", "settle")))
