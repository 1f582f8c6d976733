"""Every mechanism, by its name; a new one is its file and a line here."""

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

MECHANISMS: dict[str, type[Mechanism]] = {mechanism.name: mechanism for mechanism in _ALL}

PARAMETERS: tuple[str, ...] = tuple(
    name for mechanism in MECHANISMS.values() for name in mechanism.parameter_names()
)
"""Parameters of all mechanisms; all different."""
