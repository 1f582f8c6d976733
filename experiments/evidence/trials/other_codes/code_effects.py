"""Effects that the library lacks, in our engine and in other codes."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from dem_warp import Case, GrainPopulation, LiftedCylinder, SizeClasses
from dem_warp.model import GRAVITY
from doe.discrepancy import Point
from experiments.discover.engine_simulator import EngineSimulator
from experiments.evidence.trials.other_codes.odd_lift import odd
from experiments.evidence.trials.truths import Declared
from experiments.export.sizes import classes_of

LiftCase = Case[LiftedCylinder]

HALF = 0.5 ** (1.0 / 3.0)
"""Size of a half of a grain over that of the grain, whose shape it has."""


@dataclass(frozen=True)
class OutsideEffect:
    """An effect that the library lacks, with a size that is in no study."""

    sentence: str
    """Explanation in plain language, its size in words."""
    null: float
    maximum: float
    """Size without effect, and the largest that is drawn."""
    change: Callable[[LiftCase, float], LiftCase]
    """Makes of a case, and a size, the case that has it."""


def _densities(case: LiftCase, ratio: float) -> LiftCase:
    """Make half of the grains denser; the steps are those of the lighter half."""
    scene = odd(case.scene, density_ratio=ratio)
    fraction = math.sqrt(scene.densities[0]) * case.numerics.time_step_fraction
    return replace(case, scene=scene, numerics=replace(case.numerics, time_step_fraction=fraction))


def _odd(name: str, scale: Callable[[LiftCase], float]) -> Callable[[LiftCase, float], LiftCase]:
    """Change one number of the scene, in multiples of a scale of the case."""
    return lambda case, size: replace(case, scene=odd(case.scene, **{name: size * scale(case)}))


def _broken(case: LiftCase, part: float) -> LiftCase:
    """Break a part of the grains in two, so that there are more of them."""
    grains, scene = case.grains, case.scene
    sizes = [(size, (1.0 - part) / (1.0 + part) * share) for size, share in classes_of(grains)]
    sizes += [(HALF * size, 2.0 * part / (1.0 + part) * share) for size, share in classes_of(grains)]
    classes = SizeClasses(*zip(*sorted(sizes), strict=True))
    count = round((1.0 + part) * scene.supply(case))
    broken = GrainPopulation.of_classes(grains.shape, grains.material, classes)
    return replace(case, grains=broken, scene=replace(scene, grain_count=count))


def _weight(case: LiftCase) -> float:
    """Mean weight of a grain [N]."""
    return case.grains.mean(lambda shape: shape.volume) * case.grain_material.density * GRAVITY


OUTSIDE: Mapping[str, OutsideEffect] = {
    "bent_tube": OutsideEffect(
        "The tube is bowed; how far its middle is off, over its diameter.", 0.0, 0.5,
        _odd("bow", lambda case: case.scene.diameter),
    ),
    "broken_grains": OutsideEffect(
        "Some grains broke in two before the fill; part of the number of whole ones.", 0.0, 0.98, _broken
    ),
    "jerk": OutsideEffect(
        "The tube starts with a jerk; how far it jumps, over its height.", 0.0, 0.3,
        _odd("jump", lambda case: case.scene.height),
    ),
    "static_charge": OutsideEffect(
        "Tube and plate attract the grains; the pull on a sphere over a grain's weight.", 0.0, 1.4,
        _odd("charge", _weight),
    ),
    "two_densities": OutsideEffect(
        "Half of the grains are denser; their density over that of the others.", 1.0, 20.0, _densities
    ),
    "wet_patches": OutsideEffect(
        "Half of the plate is wet in patches; their pull on a sphere over a grain's weight.", 0.0, 8.0,
        _odd("wetting", _weight),
    ),
}  # fmt: skip
"""Effects that the library lacks, by name: trials draw from the upper half of each range."""

DECLARED = tuple(Declared(name, each.null, each.maximum) for name, each in OUTSIDE.items())
"""The same, as they are declared."""

UNSEEN = ("broken_grains", "wet_patches")
"""Those that LIGGGHTS does not make: neither left a gap in its heaps (its walls' pull adds no friction)."""


class OutsideSimulator(EngineSimulator):
    """Answers points that may name mechanisms of the library and effects that it lacks."""

    def made(self, case: Case[Any]) -> Case[Any]:
        """Return a case as the workshop makes it."""
        return case

    def case(self, point: Point) -> Case[Any]:
        """Build the case of a point, with the effects that the library lacks."""
        known = tuple(size for size in point.sizes if size[0] not in OUTSIDE)
        case = self.made(super().case(replace(point, sizes=known)))
        for name, size in point.sizes:
            if name in OUTSIDE:
                case = OUTSIDE[name].change(case, size)
        return case
