"""A law: grains that touch pull at each other with one force at any overlap."""

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import warp as wp

from dem_warp.laws.mechanism import Mechanism
from dem_warp.parameters import Parameter


@wp.func
def constant_pull(params: Any, contact: Any, memory: Any, at: int):
    """Return the attraction [N]."""
    return params.magnetic_force


@dataclass(frozen=True, kw_only=True)
class Magnetism(Mechanism):
    """Attraction of surfaces that touch."""

    magnetic_force: Annotated[float, Parameter("N", at_least=0.0)] = 0.0
    """Force of every contact."""

    name: ClassVar[str] = "magnetism"
    strength: ClassVar[str] = "magnetic_force"
    attraction: ClassVar[Any] = constant_pull
