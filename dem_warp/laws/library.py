"""All mechanisms by name; a new one needs its file and a line here."""

from collections.abc import Mapping

from dem_warp.laws.mechanism import Mechanism
from dem_warp.registry import Modules, Registry, require_kind

_ALL: Modules[type[Mechanism]] = Modules({
    "linear_cohesion": "dem_warp.laws.linear_cohesion:LinearCohesion",
    "wall_adhesion": "dem_warp.laws.wall_adhesion:WallAdhesion",
    "jkr": "dem_warp.laws.jkr:JKR",
    "capillary_bridge": "dem_warp.laws.capillary:CapillaryBridge",
    "elastic_plastic_rolling": "dem_warp.laws.elastic_plastic_rolling:ElasticPlasticRolling",
    "twisting": "dem_warp.laws.twisting:Twisting",
    # before kinetic friction, which compares the spring with the coefficient at the present speed
    "rate_weakening": "dem_warp.laws.rate_weakening:RateWeakening",
    "kinetic_friction": "dem_warp.laws.kinetic_friction:KineticFriction",
    "hysteretic_spring": "dem_warp.laws.hysteretic_spring:HystereticSpring",
    "micro_slip": "dem_warp.laws.micro_slip:MicroSlip",
})  # fmt: skip


def _check(name: str, kind: type[Mechanism], known: Mapping[str, type[Mechanism]]) -> None:
    """Check a law of a plugin: the parameters of all laws are fields of one struct."""
    require_kind(Mechanism, name, kind)
    taken = {parameter: other.name for other in known.values() for parameter in other.parameter_names()}
    if shared := [f"{p} of {taken[p]}" for p in kind.parameter_names() if p in taken]:
        raise ValueError(f"{kind.__name__}: parameter names must be unique, got {', '.join(shared)}")


MECHANISMS = Registry("dem_warp.laws", _ALL, _check)
"""Mechanisms by name, including those of plugins."""


def parameters() -> tuple[str, ...]:
    """Return the names of the parameters of all mechanisms; all are different."""
    return tuple(name for mechanism in MECHANISMS.values() for name in mechanism.parameter_names())
