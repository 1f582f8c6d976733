"""Kinds of grains and walls of a case in another code: their materials, contacts and templates."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from dem_warp import Case, LiftedCylinder, effective_moduli
from dem_warp.laws.capillary import CapillaryBridge
from dem_warp.laws.jkr import JKR
from dem_warp.model import GRAVITY
from experiments.evidence.trials.other_codes.odd_lift import OddLift, odd
from experiments.export import ExportedTest
from experiments.export.contact import Contact, contacts_of
from experiments.export.lift import Lift, Template
from experiments.io.errors import InputError

DENSEST_RAIN = 0.17
"""Largest solid fraction of the grains that come in at once: in a denser lot some find no place at random."""

BIN = 4.0
"""Side of the bins of neighbours, in reaches of a pair: in smaller ones the empty box costs most."""

CHECKED = 4
"""Looks from one decision of an input to the next."""

FILL_MARGIN = 0.12
"""Time in which the last grains come in and down [s]."""


@dataclass(frozen=True, eq=False)
class Bench:
    """A case on the bench of another workshop: its test, grains and surfaces."""

    case: Case[LiftedCylinder]

    def __post_init__(self) -> None:
        if len(self.case.grains.mixture.shapes) != 1:
            shapes = len(self.case.grains.mixture.shapes)
            raise InputError("the case", "grains of the trials in other codes must have one shape", shapes)
        strange = [each.name for each in self.case.mechanisms if not isinstance(each, JKR | CapillaryBridge)]
        if strange or self.scene.wetting:
            raise InputError("the case", "another code makes adhesion and bridges only among grains", strange)

    @cached_property
    def scene(self) -> OddLift:
        """The test."""
        scene = self.case.scene
        return scene if isinstance(scene, OddLift) else odd(scene)

    @cached_property
    def lift(self) -> Lift:
        """The same test as exporters see it."""
        return Lift(ExportedTest("trial", replace(self.case, mechanisms=()), "the trial"))

    @property
    def templates(self) -> tuple[Template, ...]:
        """Grains of every class of size and density."""
        parts = self.scene.densities
        return tuple(
            replace(each, density=part * each.density, fraction=each.fraction / len(parts))
            for part in parts
            for each in self.lift.templates
        )

    @property
    def look_steps(self) -> int:
        """Steps between two looks."""
        return self.lift.steps(self.scene.look_time)

    @property
    def rain_top(self) -> float:
        """Upper end of the space that grains are put in [m]."""
        return self.lift.rain_bottom + self.lift.rain_height

    @property
    def rain_period(self) -> float:
        """Time in which grains fall through that space [s]."""
        speed, fall = self.scene.rain_speed, 2.0 * GRAVITY * self.lift.rain_height
        return (math.sqrt(speed**2 + fall) - speed) / GRAVITY

    @property
    def rain_rate(self) -> float:
        """Grains a second: the scene's, or the most that find a place."""
        volume = float(
            np.dot([t.fraction for t in self.templates], [t.mass / t.density for t in self.templates])
        )
        room = self.lift.rain_section.open_area(0.0) * self.lift.rain_height
        return min(self.scene.grains_per_second(self.case), DENSEST_RAIN * room / (volume * self.rain_period))

    def adhesion(self) -> float:
        """Work of adhesion among grains [J/m2]."""
        return sum(each.work_of_adhesion for each in self.case.mechanisms if isinstance(each, JKR))

    def bridges(self) -> CapillaryBridge | None:
        """Bridges among grains."""
        found = [each for each in self.case.mechanisms if isinstance(each, CapillaryBridge)]
        return found[0] if found and found[0].surface_tension > 0.0 else None

    @cached_property
    def radius(self) -> float:
        """Mean radius of the spheres of a grain of middle size [m]."""
        return float(np.mean(self.case.grains.mixture.shapes[0].radii)) * self.case.grains.size_mean

    @property
    def check_steps(self) -> int:
        """Steps between two decisions of an input, which take more time than looks."""
        return CHECKED * self.look_steps

    @property
    def modulus(self) -> float:
        """Effective modulus E* of two grains [Pa]."""
        return effective_moduli(self.case.grain_material, self.case.grain_material)[0]

    def contacts(self) -> tuple[Contact, Contact, Contact]:
        """Contacts of grains with grains, the tube and the plate."""
        case = replace(self.case, mechanisms=())
        heaviest = max(template.mass for template in self.templates)
        with_grain, with_tube = contacts_of(case, self.lift.largest_radius, heaviest)
        plate = replace(self.scene.contacts(case)[2], mechanisms=())
        surface = replace(with_tube.surface, static_friction=plate.static_friction)
        return with_grain, with_tube, replace(with_tube, surface=surface, coefficients=plate)
