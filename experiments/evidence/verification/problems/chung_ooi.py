"""Settings of the eight impact tests of Chung and Ooi.

Y. C. Chung and J. Y. Ooi, Benchmark tests for verifying discrete element modelling codes at particle impact
level, Granular Matter 13 (2011) 643-656; where the numbers come from is said in `normal_impact.ELASTIC_TEXT`.
"""

from dem_warp import ContactLaws, Material
from experiments.evidence.verification.problems.impact import Impact, Partner
from experiments.evidence.verification.problems.setups import material

GLASS = material(48e9, 0.20, 2800.0)
LIMESTONE = material(20e9, 0.25, 2500.0)
ALUMINIUM = material(70e9, 0.30, 2699.0)
MAGNESIUM = material(40e9, 0.35, 1800.0)
ALUMINIUM_OXIDE = material(380e9, 0.23, 4000.0)
CAST_IRON = material(100e9, 0.25, 7000.0)
ALUMINIUM_ALLOY = material(70e9, 0.33, 2700.0)
STEEL = material(208e9, 0.30, 7850.0)

ELASTIC_PAIRS = {
    name: Impact(substance, 0.010, 20.0, partner=Partner(substance, 0.010))
    for name, substance in (("glass", GLASS), ("limestone", LIMESTONE))
}
"""Test 1: two identical spheres at 10 m/s each."""

ELASTIC_ON_PLANE = {
    name: Impact(substance, 0.100, 0.2)
    for name, substance in (("aluminium alloy", ALUMINIUM), ("magnesium alloy", MAGNESIUM))
}
"""Test 2: a sphere on a rigid plane at 0.2 m/s."""

RESTITUTION_MATERIALS = {"aluminium oxide": ALUMINIUM_OXIDE, "cast iron": CAST_IRON}


def damped(substance: Material, restitution: float, clamp: bool = False) -> Impact:
    """Test 3: a sphere of 2.5 mm radius on a rigid plane at 3.9 m/s."""
    laws = ContactLaws(attraction="clamped" if clamp else "free")
    return Impact(substance, 0.0025, 3.9, restitution=restitution, laws=laws)


OBLIQUE_MATERIALS = {"aluminium oxide": ALUMINIUM_OXIDE, "aluminium alloy": ALUMINIUM_ALLOY}


def oblique(substance: Material, normal_speed: float, tangential_speed: float) -> Impact:
    """Test 4: at 3.9 m/s in all, friction 0.092, restitution 0.98 (the experiment of Kharaz et al., 2001)."""
    return Impact(substance, 0.0025, normal_speed, tangential_speed, restitution=0.98, friction=0.092)


def fast_oblique(tangential_speed: float) -> Impact:
    """Test 5: a steel sphere of 10 um radius at 5 m/s along the normal, friction 0.3, elastic."""
    return Impact(STEEL, 1e-5, 5.0, tangential_speed, friction=0.3)


def spinning(spin: float, partner: Partner | None = None) -> Impact:
    """Test 6: a spinning sphere of 0.1 m radius at 0.2 m/s on a rigid plane, friction 0.4, restitution 0.5.

    With a `partner`, tests 7 (an identical sphere, at 0.4 m/s relative) and 8 (a sphere five times as large).
    """
    speed = 0.4 if partner and partner.radius == 0.1 else 0.2
    return Impact(ALUMINIUM_ALLOY, 0.1, speed, spin=spin, restitution=0.5, friction=0.4, partner=partner)
