"""Device types: precision of a build; parameters of a contact, a wall and a world; flags of a world.

Every struct is made for one floating type, so that the same kernel source serves the production precision and
the float64 build used for verification.
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
"""Steps for which the places of the walls are kept: a power of two above the longest cycle."""


class WorldFlag(IntFlag):
    """Marks of what happened to a world while it ran; 0 is a healthy one."""

    DIVERGED = 1
    """A grain passed the speed limit of the scene (or is not finite)."""
    NEIGHBOUR_OVERFLOW = 2
    """A grain has more neighbours than the list holds."""
    LATE_REBUILD = 4
    """A grain came farther than its lists allow for, so a contact may have been seen late."""


class Care(IntEnum):
    """Frequency of the looks at the neighbour lists."""

    USUAL = 0
    """As seldom as the fastest grain allows."""
    CLOSE = 1
    """Every other step: a grain at rest may be struck, or begin to roll, sooner than its lists allow for."""
    EVERY_STEP = 2
    """Before every step, with lists made for it: slow, and nothing is seen late."""


@dataclass(frozen=True)
class Precision:
    """Floating types of a build.

    `mixed` is the production build: poses in float64, sphere positions as 32-bit integers of a power-of-two
    length unit, forces in float32. `double` is float64 throughout.
    """

    name: str
    real: Any
    vec3: Any
    vec4: Any
    quat: Any
    sphere: Any

    @property
    def is_fixed_point(self) -> bool:
        """True where sphere positions are integers of the length unit."""
        return self.sphere is wp.vec4i


MIXED = Precision("mixed", wp.float32, wp.vec3f, wp.vec4f, wp.quatf, wp.vec4i)
DOUBLE = Precision("double", wp.float64, wp.vec3d, wp.vec4d, wp.quatd, wp.vec4d)


@dataclass(frozen=True)
class Build:
    """Key of compiled kernels; worlds of one build run in one batch, none changing another's bits."""

    precision: Precision
    sphere_count: int
    wall_count: int
    cooperative: bool
    mechanisms: Mechanisms = ()
    has_mesh: bool = False
    forms: LawForms = BASE_FORMS

    @property
    def name(self) -> str:
        """Name of the compiled module."""
        way = "warp" if self.cooperative else "serial"
        sizes = (self.sphere_count, self.wall_count)
        extras = (*(m.name for m in self.mechanisms), *self.forms.changed, *("mesh",) * self.has_mesh)
        return "_".join(map(str, (self.precision.name, way, *sizes, *extras)))

    @property
    def has_base_law(self) -> bool:
        """True of contacts that have the base law and nothing beside."""
        return not self.mechanisms and self.forms == BASE_FORMS

    @property
    def without_forces(self) -> "Build":
        """The build of kernels that have nothing to do with forces."""
        return replace(self, mechanisms=(), forms=BASE_FORMS)


PRECISIONS = {precision.name: precision for precision in (MIXED, DOUBLE)}


def _with_fields(kinds: dict[str, Any]) -> Callable[[type], type]:
    """Class decorator that adds fields, by name and kind."""

    def add(cls: type) -> type:
        cls.__annotations__ |= kinds
        return cls

    return add


@functools.cache
def device_structs(precision: Precision) -> SimpleNamespace:
    """Structs in a precision, among them `Contact`, `ContactParams`, `Model`, `Grains` and `Neighbours`."""
    real, vec3, vec4, sphere = precision.real, precision.vec3, precision.vec4, precision.sphere

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
        overlap: real  # d [m]; negative where the surfaces stand apart
        radius: real  # effective radius R* [m]
        mass: real  # effective mass m* [kg]
        velocity: vec3  # of the grain's surface relative to the partner's [m/s]
        spin: vec3  # of the grain relative to the partner [rad/s]
        rolled: vec3  # of some laws: what the two spins slide [m/s], or the grain's own spin [rad/s]
        lever: vec3  # from the grain's centre to the contact [m]
        partner_lever: vec3  # from the centre of a grain that is its partner [m]
        mobility: real  # 1 / (m lever^2) of the grain and of a grain that is its partner, added [1/(kg m2)]
        time_step: real  # [s]
        is_new: bool  # nothing is remembered from the step before

    @wp.struct
    class World:
        time_step: real  # [s]
        gravity: vec3  # [m/s2]
        rolling_holds: real  # 1: rolling resistance stops a spin at most; 0: it may reverse it
        unit: real  # length of one count of a sphere position [m]
        skin: real  # [m]
        reach: real  # largest distance of two surfaces that act on each other [m]
        cell_rate: real  # cells per count of a sphere position
        speed_limit: real  # above it the world has diverged [m/s]
        kept: real  # part of a grain's velocity that the air leaves it in a step; 1 without drag
        force_rate: real  # counts of a force on the weighed wall [1/N]
        origin: wp.vec3d  # where sphere positions count from [m]
        half_extent: wp.vec3d  # a grain further from the origin has left the domain [m]
        most_found: int  # partners that a sphere may have; of its own, so that no other world changes it
        most_listed: int  # entries that a grain's list may have

    @wp.struct
    class Wall:
        kind: int  # as in the module walls
        pair: int  # which contact parameters hold
        axis: wp.vec3d  # unit axis or normal before the first motion
        radius: wp.float64  # of the profile's start [m]
        upper_radius: wp.float64  # of its end [m]
        length: wp.float64  # of the profile along the axis [m]
        reach: wp.float64  # from the wall's point to its farthest [m]
        start_step: int  # the motion starts with this step
        weighed: int  # 1: what grains put on it is summed up; 0: it is not
        duration: wp.float64  # and ends after this time [s]
        point: wp.vec3d  # the wall's point when the motion starts [m]
        orientation: wp.quatd  # how far it had then turned
        velocity: wp.vec3d  # [m/s]
        spin: wp.vec3d  # [rad/s]
        amplitude: wp.vec3d  # of the vibration [m]
        frequency: wp.float64  # [Hz]

    @wp.struct
    class Frame:
        origin: wp.vec3d  # the wall's point [m]
        rotation: wp.quatd  # how far it has turned
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
        count: int  # of triangles; 0 for a wall that is no mesh

    @wp.struct
    class Model:
        world: wp.array(dtype=World)  # (worlds,)
        contact: wp.array(dtype=ContactParams)  # (worlds * pairs,)
        wall: wp.array(dtype=Wall)  # (worlds * walls,)
        # where it stands in the steps about the present, (worlds * walls * FRAMES,)
        frame: wp.array(dtype=Frame)
        facets: wp.array(dtype=Facets)  # (worlds * walls,)
        triangle: wp.array(dtype=Triangle)  # of every different mesh
        # its neighbours: number in the mesh, and bits of the corners that they share
        beside: wp.array(dtype=int)
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
    class Near:  # what a step looks at; written anew every few steps
        count: wp.array(dtype=int)  # (grains,)
        item: wp.array(dtype=wp.vec2i)  # entries that may touch soon, and their slots, (grains * capacity,)
        speed: wp.array(dtype=float)  # of a grain's fastest point [m/s], (grains,)
        wall_speed: wp.array(dtype=float)  # and of any wall [m/s], (worlds,)
        pace: wp.array(dtype=float)  # speed that a grain may reach, struck by others [m/s], (grains,)
        path: wp.array(dtype=real)  # farthest that a grain may come meanwhile [m], (grains,)
        wall_path: wp.array(dtype=real)  # and any wall [m], (worlds,)
        travel: wp.array(dtype=real)  # of a grain when this was written [m], (grains,)
        moves: wp.array(dtype=int)  # 1: it used up much of the skin, (grains,)
        first: wp.array(dtype=int)  # first item of a grain, (grains,) on a CPU, else (0,)
        afar: wp.array(dtype=int)  # 1: it waits far above all that move freely, and has no list, (grains,)
        top: wp.array(dtype=float)  # highest point of these [m], inf if unknown, (worlds,)

    @wp.struct
    class Reactions:  # of contacts with grains before it, then of all, so far in a step; 0 between steps
        force: wp.array(dtype=vec4)  # [N] and rolling torque [N m], (grains,) on a CPU, else (0,)
        torque: wp.array(dtype=vec4)  # [N m], as long

    @wp.struct
    class Neighbours:
        capacity: int  # entries a grain
        count: wp.array(dtype=int)  # (grains,)
        entry: wp.array(dtype=int)  # own sphere's number and partner, (grains * capacity,)
        history: wp.array(dtype=vec4)  # tangential displacement [m] and the step of it, one an entry
        memory: wp.array(dtype=real)  # what the mechanisms remember of a contact, in SI units
        rebuilt: wp.array(dtype=int)  # step of the last rebuild of all lists, (worlds,)
        # path of a grain's farthest point since its partners were last searched [m], (grains,)
        travel: wp.array(dtype=real)
        pushed: wp.array(dtype=wp.int64)  # sum of its forces on the weighed wall, in counts, (grains,)
        near: Near
        reactions: Reactions

    @wp.struct
    class Cells:
        bits: wp.vec3i  # a bucket table of 2**bits in each direction
        bucket_size: wp.array(dtype=int)  # all zero between rebuilds, (worlds * buckets,)
        bucket_start: wp.array(dtype=int)  # (worlds * buckets,)
        cursor: wp.array(dtype=int)  # (worlds,)
        bucket: wp.array(dtype=int)  # of a sphere, (spheres,)
        rank: wp.array(dtype=int)  # of a sphere in its bucket, (spheres,)
        order: wp.array(dtype=int)  # spheres by bucket, (spheres,)
        ordered: wp.array(dtype=sphere)  # their positions, (spheres,)
        found: wp.array(dtype=int)  # partners of a sphere, unsorted, (spheres * found_capacity,)
        found_count: wp.array(dtype=int)  # (spheres,)
        found_capacity: int
        # lists while they are written, each with its histories and memories, (lists * capacity,)
        drafts: wp.array(dtype=int)
        draft_history: wp.array(dtype=vec4)
        draft_memory: wp.array(dtype=real)

    return SimpleNamespace(
        Cells=Cells,
        Contact=Contact,
        Facets=Facets,
        Frame=Frame,
        ContactParams=ContactParams,
        Triangle=Triangle,
        World=World,
        Wall=Wall,
        Model=Model,
        Grains=Grains,
        Near=Near,
        Reactions=Reactions,
        Neighbours=Neighbours,
    )
