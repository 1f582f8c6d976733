"""The sections of a study file that describe the grains, the walls, the contacts, the test and the numerics.

A field's type names its dimension; its bounds are the hard physical limits, for a campaign too.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from dem_warp import Case, ClumpShape, GrainPopulation, Numerics, PouredScene, ShapeMixture, WallPart
from dem_warp.laws.mechanism import check_forms
from dem_warp.population import FRACTION_TOLERANCE, SIZE_LIMIT, size_of_mean_mass
from dem_warp.scenes.walled_scene import TooManyGrainsError
from experiments.io.plug_ins import made_in
from experiments.studyfile.generated import section_for
from experiments.studyfile.mechanisms import MechanismsSection, mechanisms_section
from experiments.studyfile.proportions import narrowness
from experiments.studyfile.scene_sections import SceneSection, scene_section
from experiments.studyfile.schema import Generated, Length, Mass, Number, Section, StudyFile, nested_error
from experiments.studyfile.sizes_section import SizesSection
from experiments.studyfile.solver_section import SolverSection
from experiments.studyfile.wall_sections import (
    LEAST_MODULUS,
    InteractionSection,
    MaterialSection,
    WallPartSection,
    density_doubt,
)

LEAST_SIZE, LARGEST_SIZE = 1e-6, 1e6
"""Sizes of grains, as multiples of their shape, whose cubes are numbers of the machine."""

MOST_GRAINS = 20_000_000
"""Grains of a case: more fill a GPU of 140 GB."""


class GrainCountError(ValueError):
    """More grains than a case can have: the problem, and their number."""

    def __init__(self, problem: str, number: str) -> None:
        super().__init__(f"{problem}, got {number}")
        self.problem, self.number = problem, number


class ShapeSection(Section):
    """Source of a shape: a file of spheres, or the radius of one."""

    clump: StudyFile | None = None
    """File with the clump's spheres, relative to the study file: x y z r a line, or a table, text or VTK file
    of LIGGGHTS, Yade, EDEM or DEM-Engine."""
    clump_unit: str | None = None
    """Unit of that file (mm, m, ...), or the length that is 1 in it. Default: the one it names, or mm."""
    sphere: Length | None = Field(default=None, gt=0.0)
    """Radius of spherical grains, instead of a clump."""

    @field_validator("clump_unit")
    @classmethod
    def _is_a_length(cls, unit: str | None) -> str | None:
        from experiments.grains.spheres import length_unit

        if unit is not None:
            length_unit(unit)
        return unit

    def one_shape(self) -> ClumpShape:
        if self.clump is not None and self.sphere is not None:
            raise ValueError("must have a clump (a file) or a sphere (a radius), not both")
        if self.clump_unit is not None and self.clump is None:
            raise ValueError("must have clump_unit only with a clump (a file)")
        if self.sphere is not None:
            return _sphere(self.sphere)
        if self.clump is not None:
            return _read_clump(self.clump, self.clump_unit, self.clump.stat().st_mtime_ns)
        raise ValueError("needs a clump (a file) or a sphere (a radius)")


class PartSection(ShapeSection):
    """``[grain.shapes.NAME]``: one of several shapes."""

    fraction: Number | None = Field(default=None, ge=0.0, le=1.0)
    """Part of the number of grains that has this shape. One of them may omit it and is the rest."""

    @model_validator(mode="after")
    def _has_a_shape(self) -> Self:
        self.one_shape()
        return self


class GrainSection(MaterialSection, ShapeSection):
    """``[grain]``: shape or shapes, size and material of the grains."""

    shapes: dict[str, PartSection] = Field(default_factory=dict)
    """Several shapes by name, instead of a clump or a sphere."""
    size_mean: Number = Field(default=1.0, ge=LEAST_SIZE, le=LARGEST_SIZE)
    """Mean size, as a multiple of the shape."""
    size_mean_of: Literal["sizes", "masses"] = "sizes"
    """Mean of the sizes, as a ruler gives it, or size of a grain of mean mass, as a balance does: a wider
    spread leaves the mass of a number of grains as it is."""
    size_sd: Number = Field(default=0.05, ge=0.0, le=LARGEST_SIZE)
    """Standard deviation of the size."""
    thousand_grain_mass: Mass | None = Field(default=None, gt=0.0)
    """Mass of 1,000 grains, in place of size_mean: the density of the grain gives the size of the shape, a
    sphere by default, and size_sd is a multiple of it."""
    elongation: Number = Field(default=0.0, ge=0.0)
    """Every shape is drawn out by this part along its longest axis, at the same volume."""
    sizes: SizesSection | None = None
    """Sizes as they were measured, in place of size_mean and size_sd."""

    @model_validator(mode="after")
    def _has_its_shapes(self) -> Self:
        shape = self.shape()
        if not SIZE_LIMIT * self.size_sd < self.size_mean:
            raise ValueError(f"size_sd must be below size_mean / {SIZE_LIMIT:g}, got {self.size_sd:g}")
        replaced = {"size_mean", "size_mean_of"} & self.model_fields_set
        if self.thousand_grain_mass is not None and (self.sizes is not None or replaced):
            raise ValueError("must have thousand_grain_mass or other sizes, not both")
        if self.sizes is None:
            return self
        if isinstance(shape, ShapeMixture):
            raise ValueError(
                "must have sizes ([grain.sizes]) of one shape only, not of several ([grain.shapes.NAME])"
            )
        if both := sorted({"size_mean", "size_mean_of", "size_sd"} & self.model_fields_set):
            raise ValueError(f"must have sizes ([grain.sizes]) or {' and '.join(both)}, not both")
        self.sizes.check_shape(shape)
        return self

    def shape(self) -> ClumpShape | ShapeMixture:
        """Build the grain's shape, or the mixture of its shapes."""
        if self.thousand_grain_mass is not None and not (self.shapes or self.clump or self.sphere):
            return _elongated(_sphere(1e-3), self.elongation)
        if not self.shapes:
            return _elongated(self.one_shape(), self.elongation)
        if self.clump is not None or self.sphere is not None:
            raise ValueError(
                "must have one shape (clump or sphere) or several ([grain.shapes.NAME]), not both"
            )
        shapes = (_elongated(part.one_shape(), self.elongation) for part in self.shapes.values())
        return ShapeMixture(tuple(shapes), self._fractions())

    def _fractions(self) -> tuple[float, ...]:
        parts = [part.fraction for part in self.shapes.values()]
        given = sum(fraction for fraction in parts if fraction is not None)
        rest = 1.0 - given
        if parts.count(None) > 1:
            raise ValueError("every shape but one needs its fraction")
        if rest < -FRACTION_TOLERANCE or (None not in parts and rest > FRACTION_TOLERANCE):
            raise ValueError(f"fractions of the shapes must add up to 1 (one may be omitted), got {given:g}")
        return tuple(max(rest, 0.0) if fraction is None else fraction for fraction in parts)

    @property
    def files(self) -> tuple[Path, ...]:
        """Every file of spheres, in order, and that of the sizes."""
        clumps = (section.clump for section in (self, *self.shapes.values()) if section.clump is not None)
        return (*clumps, *(self.sizes.files if self.sizes else ()))

    def population(self) -> GrainPopulation:
        shape = self.shape()
        if self.sizes is not None and isinstance(shape, ClumpShape):
            return self.sizes.population(shape, self.material())
        size, spread = self.size_mean, self.size_sd / self.size_mean
        if self.thousand_grain_mass is not None:
            size = self._scale(shape, self.thousand_grain_mass)
        by_mass = self.size_mean_of == "masses" or self.thousand_grain_mass is not None
        mean = size_of_mean_mass(1.0, spread) if by_mass else 1.0
        # the tests pour as many grains as their container holds of size 1
        return GrainPopulation(_scaled(shape, size), self.material(), size_mean=mean, size_sd=spread)

    def _scale(self, shape: ClumpShape | ShapeMixture, mass: float) -> float:
        """Return the size of a shape, or of a mixture, with a mass of 1,000 grains [kg]."""
        volume = GrainPopulation(shape=shape, material=self.material()).mean(lambda one: one.volume)
        return math.cbrt(1e-3 * mass / (self.density * volume))


def _scaled(shape: ClumpShape | ShapeMixture, scale: float) -> ClumpShape | ShapeMixture:
    if scale == 1.0:
        return shape
    if isinstance(shape, ClumpShape):
        return shape.scaled(scale)
    return replace(shape, shapes=tuple(one.scaled(scale) for one in shape.shapes))


# The integrals over a shape take milliseconds, and every case of a campaign needs them.
@lru_cache(maxsize=32)
def _read_clump(path: Path, unit: str | None, modified: int) -> ClumpShape:
    # The readers of files know the units of this package.
    from experiments.grains.spheres import read_clump

    return read_clump(path, unit).shape


_elongated = lru_cache(maxsize=32)(ClumpShape.elongated)
_sphere = lru_cache(maxsize=32)(ClumpShape.sphere)


class ContactSection(Section):
    """``[contact]``: the two pairs of surfaces."""

    grain_grain: InteractionSection = Field(alias="grain-grain")
    """Grain on grain."""
    grain_wall: InteractionSection = Field(alias="grain-wall")
    """Grain on every wall."""


Scene = Annotated[SceneSection, Generated(scene_section)]
"""``[scene]``: one of the tests of the library."""


class Physics(Section):
    """Everything of a study that decides how a heap turns out."""

    grain: GrainSection
    """The grains."""
    wall: MaterialSection
    """Tube and plate, or whatever holds the grains."""
    walls: dict[str, WallPartSection] = Field(default_factory=dict)
    """Parts of the walls that are of another material than the rest, by the names that the test has for them,
    as ends of a drum."""
    contact: ContactSection
    """Contact properties of each pair of surfaces."""
    scene: Scene
    """The physical test."""
    numerics: Annotated[Any, Generated(partial(section_for, Numerics))] = section_for(Numerics)()
    """Time step, softening, precision."""
    solver: SolverSection = SolverSection()
    """Conventions of the contact law."""
    mechanism: Annotated[MechanismsSection, Generated(mechanisms_section)] = MechanismsSection()
    """Physical effects in addition to the base contact law."""

    @model_validator(mode="after")
    def _mechanisms_are_physical(self) -> Self:
        for kind in ("grains", "walls"):
            own = (one for one in self.mechanism.mechanisms() if one.acts_between(kind))
            try:
                check_forms(tuple(type(one) for one in own), self.solver.laws.forms)
            except ValueError as error:
                at = {"type": "value_error", "loc": ("solver", "laws"), "msg": str(error)}
                raise nested_error([at]) from None
        return self

    @model_validator(mode="after")
    def _container_holds_grains(self) -> Self:
        try:
            self.doubts()
        except ValueError as error:
            raise nested_error([{"loc": ("scene",), "type": "value_error", "msg": str(error)}]) from None
        return self

    @model_validator(mode="after")
    def _walls_have_their_parts(self) -> Self:
        scene = self.scene.scene(self.wall.material())
        for name in self.walls:
            try:
                scene.check_parts([name])
            except ValueError as error:
                at = {"loc": ("walls", name), "type": "value_error", "msg": str(error)}
                raise nested_error([at]) from None
        return self

    @model_validator(mode="after")
    def _modulus_carries_a_heap(self) -> Self:
        if self.grain.shear_modulus / self.numerics.modulus_scale < LEAST_MODULUS:
            rule = f"must leave [grain] a shear modulus of {LEAST_MODULUS / 1e3:g} kPa or more"
            at = {"loc": ("numerics", "modulus_scale"), "type": "value_error", "msg": rule}
            raise nested_error([at])
        return self

    def doubts(self) -> tuple[str, ...]:
        """Describe unlikely values: a container that is narrow for its grains, a density of no solid."""
        scene, grains = self.scene.scene(self.wall.material()), self.grain.population()
        size = grains.size_mean if grains.classes is None else grains.size_range[1]
        narrow = narrowness(getattr(scene, "diameter", None), grains.shape, size)
        densities = ((self.grain.density, "grain.density"), (self.wall.density, "wall.density"))
        of_test = scene.doubts(grains, self.numerics.build().softened(grains.material))
        return tuple(filter(None, (narrow, *(density_doubt(*each) for each in densities), *of_test)))

    def build_case(self, seed: int) -> Case:
        """Build one case of the engine; raise ValueError where it cannot be, e.g. `GrainCountError`."""
        case = Case(
            scene=self.scene.scene(self.wall.material()),
            grains=self.grain.population(),
            grain_grain=self.contact.grain_grain.interaction(),
            grain_wall=self.contact.grain_wall.interaction(),
            seed=seed,
            numerics=self.numerics.build(),
            mechanisms=self.mechanism.mechanisms(),
            laws=self.solver.laws,
            wall_parts=self.wall_parts(),
        )
        _check_supply(case)
        if isinstance(case.scene, PouredScene):
            _check_opening(case)
        case.scene.doubts(case.grains, case.grain_material)
        return case

    def wall_parts(self) -> tuple[WallPart, ...]:
        """Build the engine's parts of the walls that the test has, in the order of their names."""
        scene = self.scene.scene(self.wall.material())
        own = {name for names in getattr(scene, "part_names", ()) for name in names} or {*self.walls}
        parts = sorted((name, part) for name, part in self.walls.items() if name in own)
        return tuple(part.part(name, self.wall, self.contact.grain_wall) for name, part in parts)


def _check_supply(case: Case) -> None:
    """Refuse a case of more grains than it can have, by the engine's rule or by that of the studies."""
    advice = "lower grain_count, or make the container smaller"
    grains: float
    try:
        if isinstance(case.scene, PouredScene) and not (volume := case.scene.volume) > 0.0:
            raise ValueError(f"{made_in(type(case.scene))} has volume_below = {volume}: it must be positive")
        grains = case.scene.supply(case)
    except OverflowError:  # a length whose square is beyond all floats
        grains = math.inf
    except TooManyGrainsError as error:
        raise GrainCountError(f"{error.rule}: {advice}", f"{error.count:,.0f}") from None
    if grains > MOST_GRAINS:
        raise GrainCountError(f"must have at most {MOST_GRAINS:,} grains a case: {advice}", f"{grains:,}")


def _check_opening(case: Case) -> None:
    """Refuse an opening that no grain passes: every case would clog."""
    radii = [float(shape.radii.max()) for shape in case.grains.mixture.shapes]
    thinnest, opening = 2.0 * case.grains.size_mean * min(radii), case.scene.opening
    if opening < thinnest:
        rule = f"must let grains through, and be {1e3 * thinnest:.4g} mm wide or wider"
        raise ValueError(f"the opening of the {case.scene.name} {rule}, got {1e3 * opening:.4g} mm")
