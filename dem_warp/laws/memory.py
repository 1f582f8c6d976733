"""What a contact remembers, and when it forgets."""

from typing import Any

import warp as wp


@wp.func
def forgets(contact: Any):
    """Whether nothing is left of an earlier touch: the contact is new, or its surfaces stand apart."""
    return contact.is_new or contact.overlap <= type(contact.overlap)(0.0)
