"""A bond of two surfaces: it forms where they touch, and lasts until they stand too far apart."""

from typing import Any

import warp as wp


@wp.func
def bonded(contact: Any, longest: Any, memory: Any, at: int) -> bool:
    """Tell whether two surfaces touched once and were since never more than `longest` [m] apart.

    `memory[at]` is 1 while they are bonded and 0 else.
    """
    bond = memory[at]
    if contact.is_new or contact.overlap < -longest:
        bond = type(longest)(0.0)
    if contact.overlap > type(longest)(0.0):
        bond = type(longest)(1.0)
    memory[at] = bond
    return bond > type(longest)(0.0)
