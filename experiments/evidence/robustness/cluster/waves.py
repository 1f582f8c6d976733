"""Waves whose times are told and taken: studies and sketches of every test, and others to check on.

The first twelve stood when predictions were mended. Of the further ones, which differ in grains, sizes,
tests, laws, cohesion and tilt, `tried` were looked at meanwhile, and `fresh` were run only afterwards.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from dem_warp import (
    EDEM,
    MECHANISMS,
    RELATIVE,
    Case,
    ClumpShape,
    ContactLaws,
    DrawDown,
    Drum,
    GrainPopulation,
    Hopper,
    Interaction,
    LiftedCylinder,
    Material,
    Mechanism,
    Numerics,
    laws_named,
)
from experiments.evidence.performance.scenes import SKETCHES, sketch_case
from experiments.grains.spheres import read_clump
from experiments.studyfile import Study, load_study
from experiments.studyfile.campaign import TARGET_SCENE

HERE = Path(__file__).parent
STUDIES, BENCHMARKS = HERE.parents[1] / "studies", HERE.parent

RADIUS = 3.0e-3
"""Radius of the balls of the sketches [m]."""

OUTLETS: dict[str, dict[str, Any]] = {"hopper": {"outlet": 0.036}, "draw-down": {"slot": 0.048}}
"""Outlets that such balls do not clog [m]."""

STEEL = Material(density=7800.0, shear_modulus=70e9, poisson_ratio=0.3)


def first(each: int) -> dict[str, list[Case]]:
    """Cases of studies that differ in test, grains and size; so many of each, more of the small ones."""
    trial, bench = load_study(STUDIES / "trial" / "study.toml", "bench"), load_study(None, "bench")
    few = load_study(None, "bench", {"scene": {"lifted-cylinder": {"grain_count": 200}}})
    fuzz = load_study(BENCHMARKS / "fuzz" / "corpus" / "study.toml")
    balls, clumps = (load_study(BENCHMARKS / "bridge" / f"{name}.toml") for name in ("sphere", "elongated"))
    found = {
        "trial, bench": _middle(trial, 4 * each),
        "trial, bench, lifted fast": _middle(trial, 4 * each, "fast"),
        "buckwheat, bench": _middle(bench, each),
        "buckwheat, bench, 200 grains": _middle(few, each),
        "fuzz corpus: cohesion, tilted plate": _middle(fuzz, each),
        "bridge: balls": _middle(balls, 2 * each),
        "bridge: elongated clumps": _middle(clumps, 2 * each),
        "dem-warp new": _middle(load_study(STUDIES / "template.toml"), each),
    }
    for name, sketch in SKETCHES.items():
        wide = sketch._replace(scene=replace(sketch.scene, **OUTLETS.get(name, {})))
        found[f"balls of 3 mm, {name}"] = [sketch_case(wide, RADIUS)] * each
    return found


def _middle(study: Study, count: int, scene: str = TARGET_SCENE) -> list[Case]:
    """So many cases in the middle of all factors."""
    return [study.case({}, seed, scene) for seed in range(1, count + 1)]


# ---- further ones ------------------------------------------------------------------------------------------


def tried(each: int) -> dict[str, list[Case]]:
    """Cases that were looked at while the prediction was mended."""
    three, four, nine = _clump("elongated"), _clump("angular"), _buckwheat()
    ball, tube = ClumpShape.sphere(2.0e-3), _tube(0.03, 0.06)
    drum = Drum(0.08, 0.025, STEEL, rotation_rate=0.4, revolutions=0.5, start_up=0.5, filling=0.5)
    made = {
        "balls of 2 mm, JKR": _case(replace(tube, grain_count=300), ball, law=_law("jkr", 0.1)),
        "balls of 2 mm, liquid bridges": _case(
            tube, ball, law=_law("capillary_bridge", 0.02, bridge_volume=5.0e-12)
        ),
        "elongated clumps, weak cohesion": _case(tube, three, size=1.6, law=_law("linear_cohesion", 2.0e3)),
        "elongated clumps, tilt of 10 degrees": _case(
            replace(tube, tilt=math.radians(10.0)), three, size=1.6
        ),
        "angular clumps, hopper": _case(Hopper(0.06, 0.05, 0.042, STEEL), four, size=1.6),
        "elongated clumps, drum half full": _case(drum, three, size=1.6),
        "nine-sphere clumps, draw-down": _case(
            DrawDown(0.06, 0.02, 0.03, 0.035, 0.045, STEEL), nine, size=1.5
        ),
        "balls of 3 mm, tilt of 8 degrees, relative laws": _case(
            replace(_tube(0.04, 0.06), tilt=math.radians(8.0)), ClumpShape.sphere(3.0e-3), laws=RELATIVE
        ),
        "balls of 4 mm, deep slot": _case(
            DrawDown(0.14, 0.05, 0.07, 0.06, 0.09, STEEL), ClumpShape.sphere(4.0e-3)
        ),
    }
    return {name: [case] * each for name, case in made.items()} | _tried_last(each)


def _tried_last(each: int) -> dict[str, list[Case]]:
    """Cases that were run when all but the last of it was mended."""
    three, four, nine = _clump("elongated"), _clump("angular"), _buckwheat()
    ball, tube = ClumpShape.sphere(2.0e-3), _tube(0.028, 0.07)
    few, drum = replace(tube, grain_count=250), Drum(0.06, 0.02, STEEL, 0.5, 0.3, 0.25, 0.5)
    made = {
        "balls of 2.5 mm, draw-down": _case(
            DrawDown(0.12, 0.02, 0.04, 0.045, 0.07, STEEL), ClumpShape.sphere(2.5e-3)
        ),
        "elongated clumps, draw-down": _case(DrawDown(0.1, 0.025, 0.05, 0.05, 0.07, STEEL), three, size=1.8),
        "balls of 4 mm, hopper": _case(Hopper(0.09, 0.08, 0.05, STEEL), ClumpShape.sphere(4.0e-3)),
        "nine-sphere clumps, drum": _case(drum, nine),
        "angular clumps, cohesion": _case(
            replace(tube, grain_count=200), four, size=1.6, law=_law("linear_cohesion", 1.5e4)
        ),
        "elongated clumps, adhesive walls": _case(
            tube, three, size=1.6, law=_law("wall_adhesion", 1.0e4, between="walls")
        ),
        "angular clumps, JKR between grains": _case(
            tube, four, size=1.6, law=_law("jkr", 0.05, between="grains")
        ),
        "balls of 2 mm, liquid bridges, tilt of 5 degrees": _case(
            replace(few, tilt=math.radians(5.0)),
            ball,
            law=_law("capillary_bridge", 0.03, bridge_volume=5.0e-12),
        ),
        "nine-sphere clumps, vibrated plate": _case(
            replace(tube, grain_count=150, vibration_amplitude=2.0e-4, vibration_frequency=40.0), nine
        ),
        "balls of 2 mm, LIGGGHTS' laws": _case(tube, ball, laws=laws_named("liggghts")),
        "balls of 2.5 mm, tilt of 12 degrees": _case(
            replace(_tube(0.035, 0.05), tilt=math.radians(12.0)), ClumpShape.sphere(2.5e-3)
        ),
        "angular clumps, draw-down": _case(DrawDown(0.1, 0.03, 0.05, 0.05, 0.08, STEEL), four, size=1.8),
        "angular clumps, wide bin": _case(Hopper(0.08, 0.05, 0.05, STEEL), four, size=1.8),
        "balls of 2 mm, sticky": _case(few, ball, law=_law("linear_cohesion", 2.0e4)),
        "glass beads of 1.5 mm": _case(
            _tube(0.02, 0.05, lift_speed=0.03), ClumpShape.sphere(1.5e-3), density=2500.0, softened=200.0
        ),
    }
    return {name: [case] * each for name, case in made.items()}


def fresh(each: int) -> dict[str, list[Case]]:
    """Cases that were not run before the prediction was done."""
    angular, outlines = (BENCHMARKS / name for name in ("bridge/angular.toml", "outlines/study.toml"))
    wheat = STUDIES / "wheat_drums"
    tilted = {"scene": {"lifted-cylinder": {"tilt": "4 deg", "lift_speed": "0.1 m/s", "grain_count": 300}}}
    three, ball, tube = _clump("elongated"), ClumpShape.sphere(5.0e-3), _tube(0.032, 0.05)
    pair = ClumpShape.from_spheres(1.5e-3 * np.array([[-1.0, 0, 0], [1.0, 0, 0]]), np.full(2, 2.0e-3))
    made = {
        "rods, hopper": _case(Hopper(0.07, 0.06, 0.05, STEEL), three, size=1.5),
        "pairs, fast drum": _case(Drum(0.08, 0.02, STEEL, 1.0, 0.35, 0.5, 1.0), pair),
        "balls of 5 mm, draw-down, relative laws": _case(
            DrawDown(0.2, 0.04, 0.08, 0.08, 0.1, STEEL), ball, laws=RELATIVE
        ),
        "steel balls of 2 mm": _case(tube, ClumpShape.sphere(2.0e-3), density=7800.0, softened=10.0),
        "pairs, liquid bridges": _case(tube, pair, law=_law("capillary_bridge", 0.05, bridge_volume=1.0e-11)),
        "balls of 2.5 mm, plastic contacts": _case(
            tube, ClumpShape.sphere(2.5e-3), law=_law("hysteretic_spring", 0.3)
        ),
    }
    return {
        "trial, as it stands": _middle(load_study(STUDIES / "trial" / "study.toml"), each),
        "bridge: angular clumps": _middle(load_study(angular), each),
        "outlines": _middle(load_study(outlines), each),
        "wheat, heap": _middle(load_study(wheat / "heap.toml", "bench"), each),
        "buckwheat, bench, tilted plate": _middle(load_study(None, "bench", tilted), each),
    } | {name: [case] * each for name, case in made.items()}


def _tube(diameter: float, height: float, **settings: Any) -> LiftedCylinder:
    return LiftedCylinder(diameter, height, STEEL, **settings)


def _clump(name: str) -> ClumpShape:
    return read_clump(BENCHMARKS / "bridge" / f"{name}.txt").shape


def _buckwheat() -> ClumpShape:
    return load_study(None, "bench").case({}, 1).grains.mixture.shapes[0]


def _law(name: str, strength: float, **settings: Any) -> Mechanism:
    kind: Any = MECHANISMS[name]
    return kind(**{kind.strength: strength}, **settings)


def _case(
    scene: Any, shape: ClumpShape, *, law: Mechanism | None = None, laws: ContactLaws = EDEM,
    density: float = 1200.0, softened: float = 40.0, size: float = 1.0,
) -> Case:  # fmt: skip
    larger = ClumpShape.from_spheres(size * shape.centers, size * shape.radii)
    surfaces = Interaction(restitution=0.3, static_friction=0.4, rolling_friction=0.05)
    return Case(
        scene,
        GrainPopulation(larger, Material(density, 10e6, 0.25)),
        surfaces,
        surfaces,
        seed=1,
        numerics=Numerics(modulus_scale=softened, time_step_fraction=0.2),
        mechanisms=(law,) if law else (),
        laws=laws,
    )
