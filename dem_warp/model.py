"""Parts of one world, described on the host."""

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Annotated

import numpy as np

from dem_warp.clumps import ClumpShape
from dem_warp.entries import MAX_SPHERES_PER_GRAIN, max_partners
from dem_warp.laws.conventions import BASE_FORMS, EDEM, ContactLaws, LawForms
from dem_warp.laws.library import MECHANISMS
from dem_warp.laws.mechanism import Mechanism, Mechanisms, check_forms, clashes
from dem_warp.materials import DAMPINGS, Interaction, Material, effective_moduli
from dem_warp.parameters import Parameter, check_parameters
from dem_warp.walls import Wall

GRAVITY = 9.81
"""Gravity [m/s2]."""

CELLS_ACROSS = 3
"""Fewest cells of a period, so that a search meets none twice."""

ROLLING_OVERLAP = 0.01
"""Overlap of equal spheres, over their radius, where a default rolling spring equals the tangential one."""

AT_ONCE = 0
"""Release step of a grain that is free from the start."""


@dataclass(frozen=True)
class ContactCoefficients:
    """Coefficients of the contact law for one pair of surfaces."""

    modulus: float
    shear_modulus: float
    """Effective E* and G* [Pa]."""
    damping: float
    """2 sqrt(5/6) |beta|, with beta = ln e / sqrt(ln^2 e + pi^2)."""
    static_friction: float
    rolling_friction: float
    clamp_attraction: bool = False
    """True if the damping must not attract at the end of an impact."""
    mechanisms: tuple[Mechanism, ...] = ()
    """Mechanisms in addition to the base law."""
    tangential_damping: float = 1.0
    """Factor of the tangential damping from `damping` and the tangential stiffness."""
    rolling_spring: float = 0.0
    """Spring of the rolling resistance: a factor [1], or a stiffness [N/m] or [N m/rad]."""
    rolling_dashpot: float = 0.0
    """Dashpot [kg/s] or damping ratio [1] of the rolling resistance."""

    def __post_init__(self) -> None:
        names = [mechanism.name for mechanism in self.mechanisms]
        if len(set(names)) < len(names):
            raise ValueError(f"ContactCoefficients.mechanisms: must be different, got {names}")
        for name, other in clashes(self.mechanisms):
            raise ValueError(f"ContactCoefficients.mechanisms: {name} excludes {other}")

    @classmethod
    def of_pair(
        cls,
        a: Material,
        b: Material,
        interaction: Interaction,
        laws: ContactLaws = EDEM,
        mechanisms: tuple[Mechanism, ...] = (),
        radius: float = 0.0,
        mass: float = 0.0,
    ) -> "ContactCoefficients":
        """Return the coefficients of two materials in contact under some laws.

        Reduced radius [m] and mass [kg] are for a rolling spring of constant stiffness.
        """
        modulus, shear_modulus = effective_moduli(a, b)
        # the area of the overlap circle is twice Hertz's, 2 R* d
        wider = math.sqrt(2.0) if laws.normal == "overlap_circle" else 1.0
        rate = laws.damping_rate
        spring, dashpot = _rolling_spring(laws, shear_modulus, radius, mass)
        return cls(
            modulus * wider,
            shear_modulus * wider,
            DAMPINGS[laws.restitution](interaction.restitution) if rate is None else rate,
            interaction.static_friction,
            interaction.rolling_friction,
            laws.attraction == "clamped",
            mechanisms,
            _tangential_share(laws, modulus, shear_modulus),
            spring,
            dashpot,
        )

    @property
    def parameters(self) -> dict[str, float]:
        """Fields of `ContactParams`; absent mechanisms are at their null."""
        apart = ("mechanisms", "rolling_spring", "rolling_dashpot")
        base = {f.name: float(getattr(self, f.name)) for f in fields(self) if f.name not in apart}
        # the spring and dashpot of a law use the fields of the mechanism that has both
        rolling = {"rolling_stiffness": self.rolling_spring, "rolling_damping": self.rolling_dashpot}
        own = {name: value for m in self.mechanisms for name, value in m.parameters.items()}
        return base | _nulls() | rolling | own


def _tangential_share(laws: ContactLaws, modulus: float, shear_modulus: float) -> float:
    """Return the factor of the tangential damping, or of the normal damping that it uses."""
    if laws.tangential_damping == "normal":
        # sqrt(S_n / S_t) turns the tangential damping into the normal one
        return math.sqrt(modulus / (4.0 * shear_modulus)) if laws.normal_damping == "tsuji" else 1.0
    return {"tsuji": 1.0, "deme": math.sqrt(2.0), "none": 0.0}[laws.tangential_damping]


def _rolling_spring(
    laws: ContactLaws, shear_modulus: float, radius: float, mass: float
) -> tuple[float, float]:
    """Return spring and dashpot of a rolling resistance, in its own units; 0 if it computes them itself."""
    if laws.rolling == "elastic_plastic":
        return laws.rolling_stiffness, laws.rolling_damping
    if laws.rolling not in ("sds", "yade"):
        return 0.0, 0.0
    own = laws.rolling_spring
    spring = 8.0 * shear_modulus * radius * math.sqrt(2.0 * ROLLING_OVERLAP) if own is None else own
    if laws.rolling == "yade":
        return spring * radius**2, 0.0
    dashpot = math.sqrt(spring * mass) if laws.rolling_dashpot is None else laws.rolling_dashpot
    return spring, dashpot


@functools.cache
def _nulls() -> dict[str, float]:
    """Return the parameters of every mechanism of the library at its null."""
    absent = (kind() for kind in MECHANISMS.values())
    return {name: value for mechanism in absent for name, value in mechanism.parameters.items()}


@dataclass(frozen=True, eq=False)
class Grains:
    """Initial grains of one world."""

    positions: np.ndarray
    orientations: np.ndarray
    """Positions [m], shape (n, 3), and orientations as quaternions x y z w, shape (n, 4)."""
    velocities: np.ndarray
    spins: np.ndarray
    """Velocities [m/s] and spins [rad/s] in the world's frame, shape (n, 3)."""
    sizes: np.ndarray
    densities: np.ndarray
    """Scale of the shape [1] and density [kg/m3], shape (n,)."""
    shapes: np.ndarray
    """Index into the world's shapes, shape (n,)."""
    release_steps: np.ndarray
    """First step with forces on a grain; before it the velocity is constant, shape (n,)."""

    def __post_init__(self) -> None:
        n = len(self.positions)
        widths = {"positions": 3, "orientations": 4, "velocities": 3, "spins": 3}
        for name in self.__dataclass_fields__:
            array = getattr(self, name)
            expected = (n, widths[name]) if name in widths else (n,)
            if np.shape(array) != expected:
                raise ValueError(f"Grains.{name}: must have shape {expected}, got {np.shape(array)}")
            bad = np.flatnonzero(~np.isfinite(array).reshape(n, -1).all(axis=1))
            if bad.size:
                raise ValueError(f"Grains.{name}: must be finite, got others for grains {bad[:5].tolist()}")
        for name in ("sizes", "densities"):
            bad = np.flatnonzero(np.asarray(getattr(self, name)) <= 0)
            if bad.size:
                raise ValueError(f"Grains.{name}: must be positive, got others for grains {bad[:5].tolist()}")

    @property
    def count(self) -> int:
        return len(self.positions)


@dataclass(frozen=True, eq=False)
class WorldSetup:
    """Initial state and parameters of one world."""

    grains: Grains
    shapes: tuple[ClumpShape, ...]
    """Shapes indexed by `Grains.shapes`."""
    contacts: tuple[ContactCoefficients, ...]
    """Contact of grain with grain, then one for each kind of wall surface."""
    walls: tuple[tuple[Wall, int], ...]
    """Each wall with the index of its contact in `contacts`."""
    time_step: Annotated[float, Parameter("s", above=0.0)]
    skin: Annotated[float, Parameter("m", above=0.0)]
    """Largest distance of two spheres that are listed as neighbours."""
    speed_limit: Annotated[float, Parameter("m/s", above=0.0)]
    """Speed of a grain above which the world has diverged."""
    domain: tuple[tuple[float, float, float], tuple[float, float, float]]
    """Corners of the box for grains [m]."""
    gravity: tuple[float, float, float] = (0.0, 0.0, -GRAVITY)
    """Gravity [m/s2]."""
    air_drag: Annotated[float, Parameter("1/s", at_least=0.0)] = 0.0
    """Rate at which the air slows a grain of any size."""
    rolling_holds: bool = True
    """True if rolling resistance stops a spin and never reverses it."""
    forms: LawForms = BASE_FORMS
    """Forms of the contact law."""
    weighed: tuple[int, ...] = ()
    """Numbers of the walls whose impulses are summed up in every step (`Solver.impulses`)."""
    free_wall: Annotated[int | None, Parameter("1", at_least=0)] = None
    """Number of the wall, one of the weighed, whose motion may have a mass."""
    period: Annotated[float | None, Parameter("m", above=0.0)] = None
    """Length after which the world repeats itself along x and y, about the middle of its domain. Walls must
    be alike everywhere; they stay in place along x and y, whatever their velocity. Default: it does not."""

    def __post_init__(self) -> None:
        check_parameters(self)
        if not np.all(np.subtract(self.domain[1], self.domain[0]) > 0):
            raise ValueError(f"WorldSetup.domain: lower corner must be below the upper, got {self.domain!r}")
        check_forms(self.mechanisms, self.forms)
        last = len(self.contacts) - 1
        if bad := [contact for _, contact in self.walls if not 1 <= contact <= last]:
            raise ValueError(f"WorldSetup.walls: each must have a contact from 1 to {last}, got {bad[0]}")
        if not set(self.weighed) <= set(range(len(self.walls))) or len(set(self.weighed)) < len(self.weighed):
            rule = f"must be different numbers of walls, 0 to {len(self.walls) - 1}"
            raise ValueError(f"WorldSetup.weighed: {rule}, got {self.weighed!r}")
        if self.free_wall is not None and self.free_wall not in self.weighed:
            raise ValueError(f"WorldSetup.free_wall: must be a weighed wall, got {self.free_wall!r}")
        if self.period is not None and self.triangle_count:
            raise ValueError("WorldSetup.period: walls must not be meshes, which are not alike everywhere")
        if self.period is not None and self.period < (least := CELLS_ACROSS * self.cell):
            raise ValueError(f"WorldSetup.period: must be at least {least:.3g} [m], got {self.period!r}")
        spheres = max(shape.sphere_count for shape in self.shapes)
        if spheres > MAX_SPHERES_PER_GRAIN:
            rule = f"each must have at most {MAX_SPHERES_PER_GRAIN} spheres"
            raise ValueError(f"WorldSetup.shapes: {rule}, got {spheres}")
        partners = spheres * self.grains.count + len(self.walls) + self.triangle_count
        if partners > (most := max_partners(spheres)):
            rule = f"must have at most {most} spheres, walls and triangles"
            raise ValueError(f"WorldSetup: {rule}, got {partners}")

    @property
    def force_rate(self) -> float:
        """Counts of the summed forces on a weighed wall [1/N]: a power of two, about 2**30 for all grains.

        Single forces then have an error of 1e-5 of a small grain's weight among 1e4, and 64 bits hold the sum
        over 1e9 steps.
        """
        weight = float(self.masses.sum()) * GRAVITY
        return float(2.0 ** math.floor(math.log2(2.0**30 / weight)))

    @property
    def largest_sphere(self) -> float:
        """Largest sphere radius of the world [m]."""
        largest = np.array([shape.radii.max() for shape in self.shapes])
        return float((largest[self.grains.shapes] * self.grains.sizes).max())

    @property
    def triangle_count(self) -> int:
        return sum(wall.triangle_count for wall, _ in self.walls)

    @property
    def mechanisms(self) -> Mechanisms:
        """Kinds of mechanism in the contacts, in the order of the library."""
        present = {type(mechanism) for contact in self.contacts for mechanism in contact.mechanisms}
        return tuple(kind for kind in MECHANISMS.values() if kind in present)

    @property
    def reach(self) -> float:
        """Largest distance of two surfaces that act on each other [m]."""
        radius = self.largest_sphere
        return max(
            (m.reach(radius, contact.modulus) for contact in self.contacts for m in contact.mechanisms),
            default=0.0,
        )

    @property
    def cell(self) -> float:
        """Width of a cell of the search [m]: the reach of a list and 1 %."""
        return 1.01 * (2 * self.largest_sphere + self.skin + self.reach)

    @property
    def masses(self) -> np.ndarray:
        """Mass of each grain [kg], (n,)."""
        volume = np.array([shape.volume for shape in self.shapes])
        return self.grains.densities * volume[self.grains.shapes] * self.grains.sizes**3

    @property
    def inertias(self) -> np.ndarray:
        """Principal moments of each grain [kg m2], (n, 3)."""
        specific = np.array([shape.inertia_over_mass for shape in self.shapes])
        return (self.masses * self.grains.sizes**2)[:, None] * specific[self.grains.shapes]

    @property
    def bounding_radii(self) -> np.ndarray:
        """Distance of the farthest point of each grain from its centre [m], (n,)."""
        reach = np.array([shape.bounding_radius for shape in self.shapes])
        return reach[self.grains.shapes] * self.grains.sizes

    @property
    def origin(self) -> np.ndarray:
        """Centre of the domain, the origin of fixed-point positions [m]."""
        return np.mean(self.domain, axis=0)

    @property
    def half_extent(self) -> np.ndarray:
        """Half the sides of the domain [m]."""
        return np.subtract(self.domain[1], self.domain[0]) / 2

    @property
    def length_unit(self) -> float:
        """Unit of fixed-point positions [m]: a power of two; 31 bits span the domain and a margin.

        Twice the distance of places in a period has to have as many bits.
        """
        extent = max(float(self.half_extent.max()), 2.5 * (self.period or 0.0))
        return float(2.0 ** np.ceil(np.log2(1.05 * extent / 2**31)))


def shape_table(worlds: Sequence[WorldSetup]) -> list[ClumpShape]:
    """Return every different shape of the worlds, in order of first appearance."""
    return list(dict.fromkeys(shape for world in worlds for shape in world.shapes))
