"""Every mechanism, by its name; a new one is its file and a line here."""

from collections.abc import Mapping

from dem_warp.laws.capillary import CapillaryBridge
from dem_warp.laws.elastic_plastic_rolling import ElasticPlasticRolling
from dem_warp.laws.hysteretic_spring import HystereticSpring
from dem_warp.laws.jkr import JKR
from dem_warp.laws.kinetic_friction import KineticFriction
from dem_warp.laws.linear_cohesion import LinearCohesion
from dem_warp.laws.mechanism import Mechanism
from dem_warp.laws.micro_slip import MicroSlip
from dem_warp.laws.rate_weakening import RateWeakening
from dem_warp.laws.twisting import Twisting
from dem_warp.laws.wall_adhesion import WallAdhesion
from dem_warp.registry import Registry, require_kind

_ALL: tuple[type[Mechanism], ...] = (
    LinearCohesion,
    WallAdhesion,
    JKR,
    CapillaryBridge,
    ElasticPlasticRolling,
    Twisting,
    # before kinetic friction, which compares the spring with the coefficient that holds at the present speed
    RateWeakening,
    KineticFriction,
    HystereticSpring,
    MicroSlip,
)


def _check(name: str, kind: type[Mechanism], known: Mapping[str, type[Mechanism]]) -> None:
    """Check a law from outside: parameters of all laws are fields of one struct."""
    require_kind(Mechanism, name, kind)
    taken = {parameter: other.name for other in known.values() for parameter in other.parameter_names()}
    if shared := [f"{p} of {taken[p]}" for p in kind.parameter_names() if p in taken]:
        raise ValueError(f"must have parameters of its own, got {', '.join(shared)}")


MECHANISMS = Registry("dem_warp.laws", {mechanism.name: mechanism for mechanism in _ALL}, _check)
"""Laws beside the base law, by name; those of plug-ins included."""


def parameters() -> tuple[str, ...]:
    """Names of the parameters of all mechanisms; all different."""
    return tuple(name for mechanism in MECHANISMS.values() for name in mechanism.parameter_names())
