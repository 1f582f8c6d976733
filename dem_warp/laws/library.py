"""Every mechanism, by its name; a new one is its file and a line here."""

from dem_warp.laws.linear_cohesion import LinearCohesion
from dem_warp.laws.mechanism import Mechanism

MECHANISMS: dict[str, type[Mechanism]] = {mechanism.name: mechanism for mechanism in (LinearCohesion,)}

PARAMETERS: tuple[str, ...] = tuple(
    name for mechanism in MECHANISMS.values() for name in mechanism.parameter_names()
)
"""Parameters of all mechanisms; all different."""
