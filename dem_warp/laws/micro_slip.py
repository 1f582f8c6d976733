"""Micro-slip: the rim of a contact slips while its middle sticks, as in theory and unlike one spring."""

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import warp as wp

from dem_warp.laws.mechanism import Mechanism
from dem_warp.laws.tangential import coulomb_spring, limited
from dem_warp.parameters import Parameter

SPRINGS = 8
"""Springs of the row, an even number."""

_SPRINGS = wp.constant(SPRINGS)
_EACH = wp.constant(1.0 / SPRINGS)
_HALF = wp.constant(3 * SPRINGS // 2)


@wp.func
def load_within(part: Any):
    """Share of the normal force that the row bears within a part of the contact radius: (3 p - p^3) / 2."""
    return type(part)(0.5) * part * (type(part)(3.0) - part * part)


@wp.func
def fitted_width(memory: Any, at: int, reach: Any, is_loose: bool):
    """Half width [m] of the row, fitted to a contact radius; after it, `memory` has the springs' forces [N].

    The row of a loose contact, which bears nothing as yet, is as wide as the contact. One that has become too
    narrow doubles: two springs become one, and the outer half is new.
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
    """Force [N] of the row; remembers contact radius, half width of the row and force of each spring."""
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
    """Tangential force [N] of the row, damped, and the displacement [m] of one spring of its force."""
    if params.micro_slip <= type(limit)(0.0):
        return coulomb_spring(displacement, stiffness, damping_rate, velocity, limit)
    force = row_force(contact, stiffness, velocity, limit, memory, at)
    stretched = displacement * type(limit)(0.0)
    if stiffness > type(limit)(0.0):
        stretched = force * (type(limit)(-1.0) / stiffness)
    return limited(force - velocity * damping_rate, limit), stretched


@dataclass(frozen=True, kw_only=True)
class MicroSlip(Mechanism):
    """A contact slips from its rim inwards, in place of sticking or sliding as a whole.

    Notes
    -----
    The contact is a row of springs along a line through its middle, each of which sticks or slips by itself
    under the share of the normal force that it bears (method of dimensionality reduction). At the contact
    radius a = sqrt(R* d), with stiffness S_t = 8 G* a and limit mu F_n of the base law, the part of the row
    between x and x + dx from the middle, on both sides together, has

        stiffness S_t dx / a,  limit (3/2) mu F_n (1 - x^2 / a^2) dx / a.

    Infinitely many springs are the theory of Cattaneo and Mindlin for any history of both forces along one
    line, and for an oblique impact that of Maw, Barber and Fawcett; on a path that turns, each spring is
    dragged by its end. Eight, half of which the widest contact so far presses at the least, come to within
    4 % of that theory in the slip after the impact over the slip before. A spring of the rim that is but
    partly pressed bears its part, and what parts lets go its force. The base law's tangential damping comes
    on top, and the sum stays within mu F_n. In gross sliding the force is that of the base law. A contact
    remembers 26 values.

    Source: V. L. Popov and M. Hess, Method of Dimensionality Reduction in Contact Mechanics and Friction,
    Springer (2015); R. D. Mindlin and H. Deresiewicz, Journal of Applied Mechanics 20 (1953) 327-344.
    """

    micro_slip: Annotated[float, Parameter("1", at_least=0.0, at_most=1.0)] = 0.0
    """1 with it, 0 without."""

    name: ClassVar[str] = "micro_slip"
    strength: ClassVar[str] = "micro_slip"
    memory_size: ClassVar[int] = 2 + 3 * SPRINGS
    slider: ClassVar[Any] = row_or_spring

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.micro_slip not in (0.0, 1.0):
            raise ValueError(f"MicroSlip.micro_slip: must be 0 or 1, got {self.micro_slip!r}")
