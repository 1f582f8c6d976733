"""Static and kinetic friction: a slipping contact has less friction than a sticking one."""

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import warp as wp

from dem_warp.laws.mechanism import Mechanism
from dem_warp.parameters import Parameter


@wp.func
def stick_or_slip(
    params: Any, contact: Any, coefficient: Any, spring: Any, support: Any, memory: Any, at: int
):
    """Return the coefficient of a contact that sticks or slips; remember which (1: it slips)."""
    zero = type(coefficient)(0.0)
    one = type(coefficient)(1.0)
    kinetic = coefficient * (one - params.friction_drop)
    held_by = coefficient
    if memory[at] == one and not contact.is_new:
        held_by = kinetic
    if spring > held_by * support:
        memory[at] = one
        return kinetic
    memory[at] = zero
    return coefficient


@dataclass(frozen=True, kw_only=True)
class KineticFriction(Mechanism):
    """Kinetic friction mu_k below the static mu_s, which is the pair's coefficient of friction.

    Notes
    -----
    A contact starts to slip when its tangential spring passes mu_s F_n. Then the spring is limited to
    mu_k F_n until the motion no longer stretches it to that; the contact then sticks and needs mu_s F_n to
    slip again.

    Source: Coulomb's two coefficients, with the state of each contact as in S. Luding, Granular Matter 10
    (2008) 235-246.
    """

    friction_drop: Annotated[float, Parameter("1", at_least=0.0, below=1.0)] = 0.0
    """Part of the static friction that a slipping contact loses, 1 - mu_k / mu_s."""

    name: ClassVar[str] = "kinetic_friction"
    strength: ClassVar[str] = "friction_drop"
    memory_size: ClassVar[int] = 1
    friction: ClassVar[Any] = stick_or_slip
