"""Micro-slip: the rim of a contact slips while its middle sticks."""

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import warp as wp

from dem_warp.laws.mechanism import Mechanism
from dem_warp.laws.tangential import coulomb_spring, limited
from dem_warp.parameters import Parameter

SPRINGS = 8
"""Number of springs in the row, even."""

_SPRINGS = wp.constant(SPRINGS)
_EACH = wp.constant(1.0 / SPRINGS)
_HALF = wp.constant(3 * SPRINGS // 2)


@wp.func
def load_within(part: Any):
    """Return the share of the normal force within a part p of the contact radius: (3 p - p^3) / 2."""
    return type(part)(0.5) * part * (type(part)(3.0) - part * part)


@wp.func
def fitted_width(memory: Any, at: int, reach: Any, is_loose: bool):
    """Return the half width [m] of the row for a contact radius; `memory` holds it and the spring forces [N].

    The row of a new contact is as wide as the contact. A row that has become too narrow doubles: two springs
    become one, and the outer half is new.
    """
    zero = type(reach)(0.0)
    width = memory[at]
    if is_loose:
        width = reach
        for i in range(2 * _HALF):
            memory[at + 1 + i] = zero
    while width < reach:
        width = width + width
        for i in range(_HALF):
            pair = at + 1 + i + i - i % 3
            memory[at + 1 + i] = memory[pair] + memory[pair + 3]
        for i in range(_HALF):
            memory[at + 1 + _HALF + i] = zero
    memory[at] = width
    return width


@wp.func
def row_force(contact: Any, stiffness: Any, velocity: Any, limit: Any, memory: Any, at: int):
    """Return the force [N] of the row; remember contact radius, half width and force of each spring."""
    zero = type(limit)(0.0)
    total = type(velocity)()
    reach = wp.sqrt(contact.radius * contact.overlap)
    before = memory[at]
    if contact.is_new:
        before = zero
    memory[at] = reach
    if reach <= zero:
        return total
    length = fitted_width(memory, at + 1, reach, before <= zero) * type(limit)(_EACH)
    inner = type(limit)(0.0)
    for i in range(_SPRINGS):
        place = at + 2 + 3 * i
        outer = inner + length
        pressed = wp.min(outer, reach) - wp.min(inner, reach)
        pressed_before = wp.min(outer, before) - wp.min(inner, before)
        force = type(velocity)(memory[place], memory[place + 1], memory[place + 2])
        if pressed < pressed_before:
            force = force * (pressed / pressed_before)
        force -= contact.normal * wp.dot(force, contact.normal)
        force -= velocity * (stiffness * (pressed / reach) * contact.time_step)
        load = load_within(wp.min(outer, reach) / reach) - load_within(wp.min(inner, reach) / reach)
        force = limited(force, limit * load)
        for k in range(3):
            memory[place + k] = force[k]
        total += force
        inner = outer
    return total


@wp.func
def row_or_spring(
    params: Any,
    contact: Any,
    displacement: Any,
    stiffness: Any,
    damping_rate: Any,
    velocity: Any,
    limit: Any,
    memory: Any,
    at: int,
):
    """Return the damped tangential force [N] of the row and the displacement [m] of one equal spring."""
    if params.micro_slip <= type(limit)(0.0):
        return coulomb_spring(displacement, stiffness, damping_rate, velocity, limit)
    force = row_force(contact, stiffness, velocity, limit, memory, at)
    stretched = displacement * type(limit)(0.0)
    if stiffness > type(limit)(0.0):
        stretched = force * (type(limit)(-1.0) / stiffness)
    return limited(force - velocity * damping_rate, limit), stretched


@dataclass(frozen=True, kw_only=True)
class MicroSlip(Mechanism):
    """Slip of a contact from its rim inwards, in place of sticking or sliding as a whole.

    Notes
    -----
    The contact is a row of springs along a line through its middle; each sticks or slips under its share of
    the normal force (method of dimensionality reduction). At the contact radius a = sqrt(R* d), with
    stiffness S_t = 8 G* a and limit mu F_n of the base law, the part of the row between x and x + dx from the
    middle, on both sides together, has

        stiffness S_t dx / a,  limit (3/2) mu F_n (1 - x^2 / a^2) dx / a.

    Infinitely many springs give the theory of Cattaneo and Mindlin for any history of both forces along one
    line, and for an oblique impact that of Maw, Barber and Fawcett; on a curved path, each spring is dragged
    by its end. Eight springs are within 4 % of that theory (slip after the impact over slip before). A spring
    at the rim carries the pressed part of its force. The base law's tangential damping is added, and the sum
    stays within mu F_n. In gross sliding the force is that of the base law. A contact remembers 26 values.

    Source: V. L. Popov and M. Hess, Method of Dimensionality Reduction in Contact Mechanics and Friction,
    Springer (2015); R. D. Mindlin and H. Deresiewicz, Journal of Applied Mechanics 20 (1953) 327-344.
    """

    micro_slip: Annotated[float, Parameter("1", at_least=0.0, at_most=1.0)] = 0.0
    """1: with micro-slip; 0: without."""

    name: ClassVar[str] = "micro_slip"
    strength: ClassVar[str] = "micro_slip"
    memory_size: ClassVar[int] = 2 + 3 * SPRINGS
    slider: ClassVar[Any] = row_or_spring

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.micro_slip not in (0.0, 1.0):
            raise ValueError(f"MicroSlip.micro_slip: must be 0 or 1, got {self.micro_slip!r}")
