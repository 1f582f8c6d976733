"""A lifted cylinder with more to it than any study can say."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Annotated, Any

import numpy as np

from dem_warp import Case, LiftedCylinder, Parameter
from dem_warp.laws.capillary import CapillaryBridge
from dem_warp.model import ContactCoefficients, WorldSetup
from dem_warp.scenes.lifted_cylinder import TUBE, LiftController
from dem_warp.scenes.scene import Decision
from dem_warp.view import WorldView
from dem_warp.walls import Mesh, Motion, Wall
from experiments.export.lift import prism

PATCHES = 2
"""Number of the wall of wet patches, and of their contact less one."""

PATCH, PITCH, ROWS = 10e-3, 14e-3, 5
"""Side and distance of the square patches [m], half of the plate, and their rows: all that a heap covers."""

RINGS = 6
"""Prisms above one another that a bowed tube is made of."""

JERK_TIME = 4e-3
"""Time in which the tube jumps [s]."""

PULL_REACH = 0.1
"""Distance at which a wall lets a sphere go, over its radius."""


@dataclass(frozen=True)
class OddLift(LiftedCylinder):
    """A lifted cylinder of another workshop."""

    density_ratio: Annotated[float, Parameter("1", at_least=1.0)] = 1.0
    """Density of half of the grains over that of the others, at the same mean."""
    bow: Annotated[float, Parameter("m", at_least=0.0)] = 0.0
    """Displacement of the tube's middle along x; its ends are right."""
    jump: Annotated[float, Parameter("m", at_least=0.0)] = 0.0
    """Rise of the tube in its first moment."""
    charge: Annotated[float, Parameter("N", at_least=0.0)] = 0.0
    """Constant pull of tube and plate on each sphere that touches them."""
    wetting: Annotated[float, Parameter("N", at_least=0.0)] = 0.0
    """Pull of the wet patches of the plate on each sphere that touches them."""
    tube_sides: Annotated[int, Parameter("1", at_least=12)] = 24
    """Sides of the prism that stands for the tube, where it is a mesh."""
    look_time: Annotated[float, Parameter("s", above=0.0)] = JERK_TIME
    """Time between two looks of the film and the balance."""

    @property
    def densities(self) -> tuple[float, ...]:
        """Densities of equal parts of the number of grains, over their mean."""
        ratio = self.density_ratio
        return (1.0,) if ratio == 1.0 else (2.0 / (1.0 + ratio), 2.0 * ratio / (1.0 + ratio))

    @property
    def tube(self) -> np.ndarray:
        """Triangles of the tube, (n, 3, 3) [m]."""
        rings, height = (RINGS if self.bow else 1), self.height
        part = prism(self.diameter / 2, height / rings, self.tube_sides)
        corners = np.concatenate([part + np.array([0, 0, n * height / rings]) for n in range(rings)])
        along = corners[..., 2] / height
        corners[..., 0] += 4.0 * self.bow * along * (1.0 - along)
        return corners

    @property
    def patches(self) -> np.ndarray:
        """Corners of the wet patches, (n, 4, 3) [m]."""
        places = PITCH * (np.arange(ROWS) - ROWS // 2)
        middles = np.stack(np.meshgrid(places, places, [0.0]), axis=-1).reshape(-1, 1, 3)
        return middles + PATCH / 2 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])

    def walls(self, reach: float) -> tuple[Wall, ...]:
        plate, tube, *lip = super().walls(reach)
        if self.bow:
            corners = self.tube.reshape(-1, 3)
            tube = Mesh(corners, np.arange(len(corners)).reshape(-1, 3))
        return plate, tube, *lip, *([Mesh.plates(self.patches)] if self.wetting else [])

    def contacts(self, case: Case[Any]) -> tuple[ContactCoefficients, ...]:
        grains, tube, plate = super().contacts(case)
        radius = float(np.mean(case.grains.mixture.shapes[0].radii)) * case.grains.size_mean
        tube, plate, patches = (
            _pulling(contact, pull, radius)
            for contact, pull in ((tube, self.charge), (plate, self.charge), (plate, self.wetting))
        )
        return grains, tube, plate, patches

    def contact_of(self, wall: int) -> int:
        return PATCHES + 1 if wall == PATCHES else super().contact_of(wall)

    def prepare(self, cases: Sequence[Case[Any]], device: Any) -> list[WorldSetup]:
        return [
            _mixed(case, world) for case, world in zip(cases, super().prepare(cases, device), strict=True)
        ]

    def controller(self, case: Case[Any], setup: WorldSetup, chunk: int) -> LiftController:
        return JerkyLift(case, setup, chunk)


class JerkyLift(LiftController):
    """Controller of a tube that jumps before it rises."""

    scene: OddLift

    def begin(self, view: WorldView, kept: np.ndarray) -> Mapping[int, Motion]:
        """Begin with the jump, after which the tube waits for the next look."""
        moves, jump = super().begin(view, kept), self.scene.jump
        up = Motion(velocity=(0.0, 0.0, jump / JERK_TIME), duration=JERK_TIME)
        return {**moves, TUBE: up} if jump else moves

    def _lift(self, view: WorldView) -> Decision:
        decision = super()._lift(view)
        end = self.state.phase_start + JERK_TIME
        if not self.scene.jump or not view.time - self.period * self.setup.time_step < end <= view.time:
            return decision
        return replace(decision, move={**decision.move, TUBE: self.scene.lift[TUBE]})


def _pulling(contact: ContactCoefficients, pull: float, radius: float) -> ContactCoefficients:
    """Let a wall pull spheres of a radius [m] that touch it by a force [N]."""
    if not pull:
        return contact
    bridge = CapillaryBridge(
        surface_tension=pull / (2.0 * np.pi * radius), bridge_volume=(PULL_REACH * radius) ** 3
    )
    return replace(contact, mechanisms=(*contact.mechanisms, bridge))


def _mixed(case: Case[Any], world: WorldSetup) -> WorldSetup:
    """Give the grains of a world the densities of its scene, in a random order."""
    factors, grains = case.scene.densities, world.grains
    order = np.random.default_rng([case.seed, TUBE]).permutation(grains.count)
    mixed = grains.densities * np.resize(factors, grains.count)[order]
    return world if len(factors) == 1 else replace(world, grains=replace(grains, densities=mixed))


def odd(scene: LiftedCylinder, **changes: float) -> OddLift:
    """Take a test to the other workshop, with changes."""
    own = {field.name: getattr(scene, field.name) for field in fields(scene) if field.init}
    return OddLift(**own | changes)
