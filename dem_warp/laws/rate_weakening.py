"""Friction that weakens with the sliding speed."""

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import warp as wp

from dem_warp.laws.mechanism import Mechanism
from dem_warp.parameters import Parameter


@wp.func
def weakened(params: Any, contact: Any, coefficient: Any, spring: Any, support: Any, memory: Any, at: int):
    """Return the coefficient of friction at the present sliding speed."""
    one = type(coefficient)(1.0)
    if params.weakening > type(coefficient)(0.0):
        velocity = contact.velocity - contact.normal * wp.dot(contact.velocity, contact.normal)
        fast = one - wp.exp(-wp.length(velocity) / params.weakening_speed)
        coefficient = coefficient * (one - params.weakening * fast)
    return coefficient


@dataclass(frozen=True, kw_only=True)
class RateWeakening(Mechanism):
    """Friction that falls from the pair's coefficient mu at rest to mu (1 - weakening) at speed.

    Notes
    -----
    mu(v) = mu (1 - weakening (1 - exp(-v / v_0))), where v is the sliding speed.

    Source: the "static-kinetic exponential decay" of the Abaqus Analysis User's Guide, mu_k + (mu_s - mu_k)
    exp(-v / v_0); the form also in Constantinou, Mokha and Reinhorn, Journal of Structural Engineering 116
    (1990) 455-474, for a friction that grows with speed.
    """

    weakening: Annotated[float, Parameter("1", at_least=0.0, below=1.0)] = 0.0
    """Part of the friction lost at high speed."""
    weakening_speed: Annotated[float, Parameter("m/s", at_least=0.0)] = 0.0
    """Speed v_0 at which 63 % of that is lost; must be above 0 if weakening is."""

    name: ClassVar[str] = "rate_weakening"
    strength: ClassVar[str] = "weakening"
    friction: ClassVar[Any] = weakened

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.weakening > 0.0 and self.weakening_speed == 0.0:
            raise ValueError("RateWeakening.weakening_speed: must be above 0 if weakening is, got 0.0")
