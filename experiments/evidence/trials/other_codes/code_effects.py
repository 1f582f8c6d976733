"""Effects of the trials in other codes: those that the library lacks, and how its own are made there."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from dem_warp import Case, GrainPopulation, LiftedCylinder, SizeClasses
from dem_warp.population import SIZE_VARIANCE
from experiments.evidence.trials.other_codes.odd_lift import odd
from experiments.evidence.trials.truths import Declared

LiftCase = Case[LiftedCylinder]

SLIPPERY = 0.15
"""Friction of slippery grains over that of the others."""

SOFT_SHARE = 0.5
"""Part of the grains that the soft class has."""

LOGNORMAL_CUT = 2.0
"""A lognormal spread of sizes ends at this many deviations of the logarithm: larger grains jam the tube."""

LOGNORMAL_CLASSES = 7


@dataclass(frozen=True)
class OutsideEffect:
    """An effect that the library lacks.

    It has a size, and no unit that a study knows: `change` makes it.
    """

    sentence: str
    """Explanation in plain language, its size in words."""
    null: float
    maximum: float
    """Size without effect, and the largest that is drawn."""
    change: Callable[[LiftCase, float], LiftCase]
    """Makes of a case, and a size, the case that has it."""


def _taper(case: LiftCase, degrees: float) -> LiftCase:
    return replace(case, scene=odd(case.scene, taper=math.radians(degrees)))


def _turn(case: LiftCase, rate: float) -> LiftCase:
    return replace(case, scene=odd(case.scene, turn_rate=rate))


def _slippery(case: LiftCase, share: float) -> LiftCase:
    return replace(case, scene=odd(case.scene, odd_share=share, odd_friction=SLIPPERY))


def _soft(case: LiftCase, factor: float) -> LiftCase:
    return replace(case, scene=odd(case.scene, odd_share=SOFT_SHARE, odd_modulus=1.0 / factor))


def _slick(case: LiftCase, part: float) -> LiftCase:
    """Take friction from the plate, save from one of known friction: that is another plate."""
    if case.scene.plate_friction is not None:
        return case
    friction = (1.0 - part) * case.grain_wall.static_friction
    return replace(case, scene=replace(case.scene, plate_friction=friction))


def _lognormal(case: LiftCase, deviation: float) -> LiftCase:
    """Spread the sizes lognormally at the same mean mass, in classes of one probability each."""
    shares = (np.arange(LOGNORMAL_CLASSES) + 0.5) / LOGNORMAL_CLASSES
    # the middles of the classes, of a normal distribution that is cut at both ends
    below = 0.5 * math.erfc(LOGNORMAL_CUT / math.sqrt(2.0))
    logs = np.array([_normal_quantile(below + share * (1.0 - 2.0 * below)) for share in shares])
    sizes = np.exp(deviation * logs / math.sqrt(float(np.mean(logs**2))))
    grains = case.grains
    wanted = grains.size_mean**3 + 3.0 * grains.size_mean * SIZE_VARIANCE * grains.size_sd**2
    sizes *= (wanted / float(np.mean(sizes**3))) ** (1.0 / 3.0)
    classes = SizeClasses(tuple(sizes.tolist()), (1.0 / LOGNORMAL_CLASSES,) * LOGNORMAL_CLASSES)
    return replace(case, grains=GrainPopulation.of_classes(grains.shape, grains.material, classes))


def _normal_quantile(share: float) -> float:
    # a study is read without SciPy
    from scipy.special import ndtri

    return float(ndtri(share))


OUTSIDE: Mapping[str, OutsideEffect] = {
    "conical_tube": OutsideEffect(
        "The tube narrows upwards; half the angle of its cone, in degrees.", 0.0, 3.0, _taper
    ),
    "lognormal_sizes": OutsideEffect(
        "Sizes are spread lognormally at the same mean mass; deviation of their logarithm.", 0.05, 0.5,
        _lognormal,
    ),
    "slick_plate": OutsideEffect(
        "The plate rubs less than the tube, save one of known friction; part of the friction that is gone.",
        0.0, 0.9, _slick,
    ),
    "slippery_class": OutsideEffect(
        f"Some grains have {SLIPPERY:g} of the others' friction; part of the number.", 0.0, 0.5, _slippery
    ),
    "soft_class": OutsideEffect(
        f"{SOFT_SHARE:g} of the grains are softer; modulus of the others over theirs.", 1.0, 200.0, _soft
    ),
    "turning_tube": OutsideEffect(
        "The tube turns about its axis while it is lifted; radians a second.", 0.0, 60.0, _turn
    ),
}  # fmt: skip
"""Effects that the library lacks, by name.

Half of each range leaves a gap, with every observable, in heaps that LIGGGHTS makes at the middle of the
factors, eight of 100 grains a condition: trials draw from the upper half.
"""

DECLARED = tuple(Declared(name, each.null, each.maximum) for name, each in OUTSIDE.items())
"""The same, as they are declared."""
