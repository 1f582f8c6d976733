"""Plastic dents: a normal spring that returns only a part of the work, at any speed."""

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import warp as wp

from dem_warp.laws.mechanism import Mechanism
from dem_warp.parameters import Parameter


@wp.func
def dented(params: Any, contact: Any, elastic: Any, memory: Any, at: int):
    """Return the normal force [N] over a dent; remember the largest overlap [m]."""
    zero = type(elastic)(0.0)
    one = type(elastic)(1.0)
    deepest = memory[at]
    if contact.is_new:
        deepest = zero
    deepest = wp.max(deepest, contact.overlap)
    memory[at] = deepest
    if params.plasticity <= zero or contact.overlap <= zero:
        return elastic
    above = wp.max(one - params.plasticity * (deepest / contact.overlap), zero) / (one - params.plasticity)
    return elastic * above * wp.sqrt(above)


@dataclass(frozen=True, kw_only=True)
class HystereticSpring(Mechanism):
    """Normal spring that loads along Hertz's curve and unloads along a steeper one.

    Notes
    -----
    With Hertz's F = K d^(3/2) on first loading, below the largest overlap d_max of the contact

        F = K d_max^(3/2) ((d - d_p) / (d_max - d_p))^(3/2),  and 0 below d_p = plasticity d_max,

    until d_max is passed. It never attracts. The part 1 - plasticity of the work is returned, so the
    coefficient of restitution is sqrt(1 - plasticity) at any speed; the base law's damping is added, unless
    the pair's restitution is 1. Unloading starts 1 / (1 - plasticity) times as stiff as Hertz, which the time
    step must resolve. The dent is forgotten when the contact opens.

    Source: Walton and Braun, Journal of Rheology 30 (1986) 949-980, with linear branches of stiffness K_1 and
    K_2, e = sqrt(K_1 / K_2); here both branches have Hertz's exponent, so that plasticity 0 is the base law.
    """

    plasticity: Annotated[float, Parameter("1", at_least=0.0, below=1.0)] = 0.0
    """Depth of the remaining dent over the largest overlap, d_p / d_max."""

    name: ClassVar[str] = "hysteretic_spring"
    strength: ClassVar[str] = "plasticity"
    memory_size: ClassVar[int] = 1
    spring: ClassVar[Any] = dented
