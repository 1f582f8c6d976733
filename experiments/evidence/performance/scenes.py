"""Every scene once, with balls: what it measures, and a picture of it cut in the middle.

    python -m experiments.evidence.performance.scenes --out out/scenes

Results and pictures are in README.md beside this file. Grains in front of the plane y = 0 are left out.
"""

import time
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import typer

from dem_warp import (
    Case,
    CaseResult,
    ClumpShape,
    DrawDown,
    Drum,
    GrainPopulation,
    Hopper,
    Interaction,
    LiftedCylinder,
    Material,
    Numerics,
)
from dem_warp.batch import Batch
from dem_warp.device import resolve_device
from dem_warp.view import WorldView
from experiments.commands.options import OneDevice
from experiments.evidence.performance.cut_pictures import View, draw_cut, layers, speeds, wall_section
from imaging import save_picture
from imaging.geometry import Picture

BALL = Material(density=1200.0, shear_modulus=10e6, poisson_ratio=0.25)
STEEL = Material(density=7800.0, shear_modulus=70e9, poisson_ratio=0.3)
SURFACES = Interaction(restitution=0.3, static_friction=0.4, rolling_friction=0.05)
SOFTENED = 20.0


class Sketch(NamedTuple):
    """A scene, and when its picture is taken: of the layers that the bed had, or of how a drum's flows."""

    scene: LiftedCylinder | Hopper | Drum | DrawDown
    view: View
    phase: str
    after: float
    """Time since the phase began [s]."""


SKETCHES = {
    "lifted-cylinder": Sketch(
        LiftedCylinder(diameter=0.05, height=0.06, wall_material=STEEL),
        View(half_width=0.07, bottom=-0.003, top=0.09),
        phase="lift",
        after=0.35,
    ),
    "hopper": Sketch(
        Hopper(diameter=0.06, fill_depth=0.07, outlet=0.024, wall_material=STEEL),
        View(half_width=0.05, bottom=-0.012, top=0.085),
        phase="discharge",
        after=0.9,
    ),
    "drum": Sketch(
        Drum(diameter=0.1, length=0.02, wall_material=STEEL, rotation_rate=0.5, revolutions=1.0),
        View(half_width=0.053, bottom=-0.003, top=0.103),
        phase="turn",
        after=1.9,
    ),
    "draw-down": Sketch(
        DrawDown(width=0.13, depth=0.022, fill_depth=0.06, slot=0.032, drop=0.085, wall_material=STEEL),
        View(half_width=0.07, bottom=-0.003, top=0.155),
        phase="rest",
        after=0.0,
    ),
}


def sketch_case(sketch: Sketch, radius: float) -> Case:
    """The scene with balls of a mean radius [m]."""
    return Case(
        scene=sketch.scene,
        grains=GrainPopulation(ClumpShape.sphere(radius), BALL),
        grain_grain=SURFACES,
        grain_wall=SURFACES,
        numerics=Numerics(modulus_scale=SOFTENED),
    )


def run(sketch: Sketch, radius: float, device: str) -> tuple[CaseResult, Picture]:
    """Run a scene to its end and draw it at its moment, or at the end if that never comes."""
    batch = Batch([sketch_case(sketch, radius)], device)
    controller, settled, picture = batch.controllers[0], batch.setups[0].grains.positions[:, 2], None
    ended: list[tuple[int, CaseResult]] = []
    while picture is None or not ended:
        ended = batch.advance()
        [view] = batch.solver.view([0])
        state = controller.state
        if state.phase in ("fill", "settle"):
            settled = view.positions[:, 2].copy()
        at_moment = state.phase == sketch.phase and view.time - state.phase_start >= sketch.after
        if picture is None and (ended or at_moment):
            picture = _draw(sketch, batch, view, settled)
    return ended[0][1], picture


def _draw(sketch: Sketch, batch: Batch, view: WorldView, settled: np.ndarray) -> Picture:
    """Draw a world, of which the heights in the settled bed are known [m]."""
    setup, lines = batch.setups[0], []
    for number, (wall, _) in enumerate(setup.walls):
        moved = batch.solver.wall_pose(0, number)[0] - np.array(wall.point)
        lines += wall_section(wall, moved)
    colors = layers(settled, sketch.scene.floor, sketch.scene.brim)
    if isinstance(sketch.scene, Drum):
        colors = speeds(_seen_from_drum(sketch.scene, view))
    behind = view.alive & view.released & (view.positions[:, 1] > 0.0)
    radii = setup.bounding_radii
    return draw_cut(view.positions[behind], radii[behind], colors[behind], lines, sketch.view)


def _seen_from_drum(drum: Drum, view: WorldView) -> np.ndarray:
    """Velocities relative to what turns with a drum [m/s]."""
    from_axis = view.positions - np.array([0.0, 0.0, drum.diameter / 2])
    return view.velocities - np.cross([0.0, drum.spin, 0.0], from_axis)


def main(
    radius: Annotated[
        float, typer.Option(help="Mean radius of the balls [mm]; small ones want a GPU.")
    ] = 2.0,
    device: OneDevice = None,
    out: Annotated[Path, typer.Option(help="Folder of the pictures.")] = Path("out/scenes"),
) -> None:
    """Run every scene, print what it measures, and draw it."""
    out.mkdir(parents=True, exist_ok=True)
    for name, sketch in SKETCHES.items():
        started = time.perf_counter()
        result, picture = run(sketch, 1e-3 * radius, resolve_device(device))
        save_picture(out / f"{name}.png", picture)
        print(f"{name}: {result.status} {result.reason} in {time.perf_counter() - started:.1f} s")
        for observable, told in sketch.scene.observables.items():
            if observable in result.observables:
                print(f"  {observable}: {result.observables[observable]:.4g} {told.unit}")


if __name__ == "__main__":
    typer.run(main)
