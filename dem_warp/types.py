"""Device types: precision and build of kernels, structs, flags of a world.

Every struct is made for one floating type: the same kernel source serves the production precision and the
float64 build for verification.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import IntEnum, IntFlag
from types import SimpleNamespace
from typing import Any

import warp as wp

from dem_warp.laws.conventions import BASE_FORMS, LawForms
from dem_warp.laws.library import parameters
from dem_warp.laws.mechanism import Mechanisms

FRAMES = 128
"""Number of steps whose wall frames are stored: a power of two above the longest cycle."""


Counts = wp.vec3l
"""Type of a summed force, in counts along x, y and z."""


class WorldFlag(IntFlag):
    """Failures of a world; 0: none."""

    DIVERGED = 1
    """A grain is faster than the speed limit, or not finite."""
    NEIGHBOUR_OVERFLOW = 2
    """A grain has more neighbours than its list holds."""
    LATE_REBUILD = 4
    """A grain moved farther than its lists allow, so that a contact may be found late."""


class CheckRate(IntEnum):
    """Frequency of the checks of the neighbour lists."""

    USUAL = 0
    """Checks as rare as the fastest grain allows."""
    CLOSE = 1
    """Every other step: a grain at rest may be hit, or begin to roll, sooner than its lists allow."""
    EVERY_STEP = 2
    """Before every step, with new lists: slow, but no contact is late."""


@dataclass(frozen=True)
class Precision:
    """Floating types of a build.

    `mixed` is for production: poses in float64, sphere positions as 32-bit integers of a power-of-two length
    unit, forces in float32. `double` is float64 throughout.
    """

    name: str
    real: Any
    vec3: Any
    vec4: Any
    quat: Any
    sphere: Any

    @property
    def is_fixed_point(self) -> bool:
        """True if sphere positions are integers of the length unit."""
        return self.sphere is wp.vec4i


MIXED = Precision("mixed", wp.float32, wp.vec3f, wp.vec4f, wp.quatf, wp.vec4i)
DOUBLE = Precision("double", wp.float64, wp.vec3d, wp.vec4d, wp.quatd, wp.vec4d)


@dataclass(frozen=True)
class Build:
    """Key of compiled kernels; worlds of one build can run in one batch."""

    precision: Precision
    sphere_count: int
    wall_count: int
    cooperative: bool
    mechanisms: Mechanisms = ()
    has_mesh: bool = False
    has_free_wall: bool = False
    is_periodic: bool = False
    forms: LawForms = BASE_FORMS

    @property
    def name(self) -> str:
        way = "warp" if self.cooperative else "serial"
        sizes = (self.sphere_count, self.wall_count)
        extras = (
            *(m.name for m in self.mechanisms),
            *self.forms.changed,
            *("mesh",) * self.has_mesh,
            *("free",) * self.has_free_wall,
        )
        extras += ("periodic",) * self.is_periodic
        return "_".join(map(str, (self.precision.name, way, *sizes, *extras)))

    @property
    def has_base_law(self) -> bool:
        """True if contacts have the base law and no mechanism."""
        return not self.mechanisms and self.forms == BASE_FORMS

    @property
    def without_forces(self) -> "Build":
        """Build of kernels without forces."""
        return replace(self, mechanisms=(), forms=BASE_FORMS)


PRECISIONS = {precision.name: precision for precision in (MIXED, DOUBLE)}


def _with_fields(kinds: dict[str, Any]) -> Callable[[type], type]:
    """Return a class decorator that adds fields, by name and kind."""

    def add(cls: type) -> type:
        cls.__annotations__ |= kinds
        return cls

    return add


@functools.cache
def device_structs(precision: Precision) -> SimpleNamespace:
    """Return the structs in a precision by name."""
    real, vec3, vec4, sphere = precision.real, precision.vec3, precision.vec4, precision.sphere
    count = int if precision.is_fixed_point else real

    @wp.struct
    @_with_fields(dict.fromkeys(parameters(), real))
    class ContactParams:
        modulus: real  # effective Young's modulus E* [Pa]
        shear_modulus: real  # effective shear modulus G* [Pa]
        damping: real  # 2 sqrt(5/6) |beta| [1]
        static_friction: real  # [1]
        rolling_friction: real  # [1]
        clamp_attraction: real  # 1: the damping force may not attract; 0: it may
        tangential_damping: real  # 1: the tangential spring is damped as the normal one is; 0: not at all

    @wp.struct
    class Contact:
        normal: vec3  # unit vector from the partner to the grain
        overlap: real  # d [m]; negative for separated surfaces
        radius: real  # effective radius R* [m]
        mass: real  # effective mass m* [kg]
        velocity: vec3  # of the grain's surface relative to the partner's [m/s]
        spin: vec3  # of the grain relative to the partner [rad/s]
        rolled: vec3  # for some laws: sliding velocity of both spins [m/s], or the grain's own spin [rad/s]
        lever: vec3  # from the grain's centre to the contact [m]
        partner_lever: vec3  # from the centre of a grain that is its partner [m]
        mobility: real  # 1 / (m lever^2) of the grain and of a grain that is its partner, added [1/(kg m2)]
        time_step: real  # [s]
        is_new: bool  # True: no memory from the step before

    @wp.struct
    class World:
        time_step: real  # [s]
        gravity: vec3  # [m/s2]
        rolling_holds: real  # 1: rolling resistance stops a spin at most; 0: it may reverse it
        unit: real  # length of one count of a sphere position [m]
        skin: real  # [m]
        reach: real  # largest distance of two surfaces that act on each other [m]
        cell_rate: real  # cells per count of a sphere position
        period: count  # period along x and y in counts of a sphere position; 0 without one
        across: int  # cells of a period
        speed_limit: real  # above it the world has diverged [m/s]
        drag_factor: real  # factor of the velocity by the air in a step; 1 without drag
        force_rate: real  # counts of a force on a weighed wall [1/N]
        origin: wp.vec3d  # origin of sphere positions [m]
        half_extent: wp.vec3d  # half sides of the domain about the origin [m]
        found_limit: int  # most partners of a sphere; its own, so that no other world changes it
        list_limit: int  # most entries of a grain's list

    @wp.struct
    class Wall:
        kind: int  # constant of the module walls
        pair: int  # number of its contact parameters
        axis: wp.vec3d  # unit axis or normal before the first motion
        radius: wp.float64  # of the profile's start [m]
        upper_radius: wp.float64  # of its end [m]
        length: wp.float64  # of the profile along the axis [m]
        reach: wp.float64  # from the wall's point to its farthest [m]
        start_step: int  # first step of the motion
        weighed: int  # its number among the walls whose forces are summed up, from 1; 0: it is none of them
        duration: wp.float64  # of the motion [s]
        point: wp.vec3d  # the wall's point at the start of the motion [m]
        orientation: wp.quatd  # its orientation then
        velocity: wp.vec3d  # [m/s]
        spin: wp.vec3d  # [rad/s]
        amplitude: wp.vec3d  # of the vibration [m]
        frequency: wp.float64  # [Hz]
        mass: wp.float64  # of a wall that is free along z [kg]; 0 for the others
        force: wp.float64  # on it along z, besides that of the grains [N]

    @wp.struct
    class Frame:
        origin: wp.vec3d  # the wall's point [m]
        rotation: wp.quatd  # orientation
        axis: wp.vec3d  # unit axis or normal
        velocity: vec3  # of the wall's point [m/s]
        spin: vec3  # [rad/s]

    @wp.struct
    class Triangle:
        # corners, from the wall's point and before any motion, in the order of the mesh's vertices [m]
        a: wp.vec3d
        b: wp.vec3d
        c: wp.vec3d
        normal: wp.vec3d  # unit vector, to either side
        first: int  # index of its neighbours
        count: int  # of them

    @wp.struct
    class Facets:
        bvh: wp.uint64  # of the wall's mesh
        first: int  # index of its triangles
        number: int  # of the first triangle, counted on from the world's walls
        count: int  # of triangles; 0 for a wall that is not a mesh

    @wp.struct
    class Model:
        world: wp.array(dtype=World)  # (worlds,)
        contact: wp.array(dtype=ContactParams)  # (worlds * pairs,)
        wall: wp.array(dtype=Wall)  # (worlds * walls,)
        # place in the steps about the present, (worlds * walls * FRAMES,)
        frame: wp.array(dtype=Frame)
        facets: wp.array(dtype=Facets)  # (worlds * walls,)
        triangle: wp.array(dtype=Triangle)  # of every different mesh
        # its neighbours: number in the mesh, and bits of the shared corners
        adjacent: wp.array(dtype=int)
        shape_spheres: wp.array(dtype=vec4)  # local centre and radius, (shapes * spheres,) [m]
        shape_sphere_count: wp.array(dtype=int)  # (shapes,)
        shape: wp.array(dtype=int)  # (grains,)
        inertia: wp.array(dtype=vec4)  # principal moments [kg m2] and bounding radius [m], (grains,)
        release_step: wp.array(dtype=int)  # a grain moves at constant velocity before it, (grains,)
        grain_count: int  # slots of a world
        pair_count: int  # contact parameters of a world

    @wp.struct
    class Grains:
        step: wp.array(dtype=int)  # steps done, (worlds,)
        position: wp.array(dtype=wp.vec3d)  # [m], (grains,)
        orientation: wp.array(dtype=wp.quatd)  # body to world, (grains,)
        velocity: wp.array(dtype=vec4)  # [m/s] and mass [kg], (grains,)
        spin: wp.array(dtype=vec4)  # [rad/s], world frame, (grains,)
        center: wp.array(dtype=sphere)  # position in counts and size factor, (grains,)
        spheres: wp.array(dtype=sphere)  # position in counts and radius [m], (grains * spheres,)

    @wp.struct
    class Near:  # candidates for contacts in the next steps
        count: wp.array(dtype=int)  # (grains,)
        item: wp.array(dtype=wp.vec2i)  # entries that may touch soon, and their slots, (grains * capacity,)
        speed: wp.array(dtype=float)  # of a grain's fastest point [m/s], (grains,)
        wall_speed: wp.array(dtype=float)  # of the fastest wall [m/s], (worlds,)
        pace: wp.array(dtype=float)  # speed that a grain may reach by collisions [m/s], (grains,)
        path: wp.array(dtype=real)  # longest path of a grain in the next steps [m], (grains,)
        wall_path: wp.array(dtype=real)  # longest path of a wall [m], (worlds,)
        travel: wp.array(dtype=real)  # travel of a grain at the last check [m], (grains,)
        moves: wp.array(dtype=int)  # 1: the grain used up much of the skin, (grains,)
        first: wp.array(dtype=int)  # first item of a grain, (grains,) on a CPU, else (0,)
        afar: wp.array(dtype=int)  # 1: it waits far above all free grains, without a list, (grains,)
        top: wp.array(dtype=float)  # highest point of the free grains [m], inf if unknown, (worlds,)

    @wp.struct
    class Reactions:  # of the contacts so far in a step, first those with earlier grains; 0 between steps
        force: wp.array(dtype=vec4)  # [N] and rolling torque [N m], (grains,) on a CPU, else (0,)
        torque: wp.array(dtype=vec4)  # [N m], of the same length

    @wp.struct
    class Neighbours:
        capacity: int  # entries a grain
        count: wp.array(dtype=int)  # (grains,)
        entry: wp.array(dtype=int)  # own sphere's number and partner, (grains * capacity,)
        history: wp.array(dtype=vec4)  # tangential displacement [m] and the step of it, one an entry
        memory: wp.array(dtype=real)  # values of a contact for mechanisms, in SI units
        rebuilt: wp.array(dtype=int)  # step of the last rebuild of all lists, (worlds,)
        # path of a grain's farthest point since the last search of its partners [m], (grains,)
        travel: wp.array(dtype=real)
        weighed: int  # weighed walls of a world
        # sum of a grain's forces on each weighed wall, in counts, (grains * weighed walls,)
        pushed: wp.array(dtype=Counts)
        # of the free wall: force of the grains along z in this step, in counts, 0 between steps, (worlds,)
        borne: wp.array(dtype=wp.int64)
        # its rise [m] and speed [m/s] along z since the start of its motion; its path since the last rebuild
        # of all lists, and the longest that the next check allows [m], (worlds,)
        lift: wp.array(dtype=wp.vec4d)
        near: Near
        reactions: Reactions

    @wp.struct
    class Cells:
        bits: wp.vec3i  # a bucket table of 2**bits in each direction
        bucket_size: wp.array(dtype=int)  # all zero between rebuilds, (worlds * buckets,)
        bucket_start: wp.array(dtype=int)  # (worlds * buckets,)
        cursor: wp.array(dtype=int)  # (worlds,)
        seeker: wp.array(dtype=int)  # places of `order` whose spheres search, (spheres,) on a GPU, else (0,)
        seekers: wp.array(dtype=int)  # number of them, (1,)
        bucket: wp.array(dtype=int)  # of a sphere, (spheres,)
        rank: wp.array(dtype=int)  # of a sphere in its bucket, (spheres,)
        order: wp.array(dtype=int)  # spheres by bucket, (spheres,)
        ordered: wp.array(dtype=sphere)  # their positions, (spheres,)
        found: wp.array(dtype=int)  # partners of a sphere, unsorted, (spheres * found_capacity,)
        found_count: wp.array(dtype=int)  # (spheres,)
        found_capacity: int
        # lists being written, with histories and memories, (lists * capacity,)
        drafts: wp.array(dtype=int)
        draft_history: wp.array(dtype=vec4)
        draft_memory: wp.array(dtype=real)

    structs: tuple[Any, ...] = (
        Cells, Contact, ContactParams, Facets, Frame, Grains, Model, Near, Neighbours, Reactions, Triangle,
        Wall, World,
    )  # fmt: skip
    return SimpleNamespace(**{struct.cls.__name__: struct for struct in structs})
