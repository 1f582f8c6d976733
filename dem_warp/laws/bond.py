"""Bond of two surfaces: it forms where they touch and breaks beyond a distance."""

from typing import Any

import warp as wp


@wp.func
def bonded(contact: Any, longest: Any, memory: Any, at: int) -> bool:
    """Return True if two surfaces have touched and were never more than `longest` [m] apart since.

    `memory[at]` is 1 while they are bonded and 0 otherwise.
    """
    bond = memory[at]
    if contact.is_new or contact.overlap < -longest:
        bond = type(longest)(0.0)
    if contact.overlap > type(longest)(0.0):
        bond = type(longest)(1.0)
    memory[at] = bond
    return bond > type(longest)(0.0)
