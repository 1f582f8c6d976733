"""The benchmarks' scene: columns of the buckwheat study's clump, caught while filling, settled and lifting.

A moment of a column is a world that can go on from there: the poses and speeds of its grains, the steps until
the next are released, the height of its tube. Contact histories are not kept; a measurement lets them grow
again before it counts. A column lives through all its moments in one simulation, so they are kept in a file.
"""

import hashlib
import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dem_warp import Case, ClumpShape, GrainPopulation, Interaction, LiftedCylinder, Material, Numerics
from dem_warp.batch import Batch
from dem_warp.model import Grains, WorldSetup
from dem_warp.scenes.lifted_cylinder import TUBE
from dem_warp.view import WorldView
from dem_warp.walls import Motion
from experiments.io.files import replacing

CLUMP = Path(__file__).parents[2] / "studies" / "buckwheat" / "clump.txt"
BUCKWHEAT = Material(density=698.0, shear_modulus=34.325e6, poisson_ratio=0.29)
STEEL = Material(density=7800.0, shear_modulus=70e9, poisson_ratio=0.30)
GRAIN_GRAIN = Interaction(restitution=0.18, static_friction=0.46, rolling_friction=0.055)
GRAIN_WALL = Interaction(restitution=0.50, static_friction=0.38, rolling_friction=0.055)

SCALES = {
    "printed": (LiftedCylinder(0.035, 0.110, STEEL, rain_rate=3e3), 1.0),
    "soft": (LiftedCylinder(0.035, 0.110, STEEL, rain_rate=3e3), 100.0),
    "bench": (LiftedCylinder(0.028, 0.036, STEEL, grain_count=400, rain_rate=3e3), 400.0),
}
"""Tube and divisor of the shear modulus, as at the study's scales."""

MOMENTS = {"filling": (0.4, 0.5, 0.6, 0.7), "settled": (1.0,), "lifting": (0.3, 0.4, 0.5, 0.6)}
"""When a column is caught: part of the whole rain's duration, and of the time that the tube takes to rise by
its diameter; a settled one at the end of settling."""

_STATE = ("positions", "orientations", "velocities", "spins", "sizes", "release_steps")


def reference_case(scale: str, seed: int = 0) -> Case[LiftedCylinder]:
    """Return the study's centre point with grains of one size, the reference clump."""
    if scale not in SCALES:
        raise ValueError(f"scale: must be one of {', '.join(SCALES)}, got {scale!r}")
    scene, softening = SCALES[scale]
    grains = GrainPopulation(ClumpShape.read(CLUMP), BUCKWHEAT, size_sd=0.0)
    return Case(scene, grains, GRAIN_GRAIN, GRAIN_WALL, seed, Numerics(modulus_scale=softening))


REST = Motion()


@dataclass(frozen=True, eq=False)
class Moment:
    """A column from a moment on."""

    setup: WorldSetup
    """Its living grains, and its tube where it then is."""
    tube_motion: Motion = REST


class Columns:
    """Moments of columns of one scale of the study and several seeds, simulated unless a folder has them.

    Part of a file's name in the folder is made from all that determines the moments.
    """

    def __init__(self, scale: str, seeds: int, device: str, folder: Path) -> None:
        self.scale, self.device = scale, device
        self.cases = [reference_case(scale, seed) for seed in range(seeds)]
        self._setups = self.cases[0].scene.prepare(self.cases, device)
        path = folder / f"columns-{scale}-{seeds}-{self._key()}.npz"
        if not path.exists():
            arrays = self._simulate()
            with replacing(path) as temporary:
                np.savez_compressed(temporary, **arrays)  # type: ignore[arg-type]
        with np.load(path) as file:
            self._arrays = dict(file.items())

    def moments(self, phase: str, count: int) -> list[Moment]:
        """`count` columns in a phase, first all seeds at one moment, then at the next.

        Beyond seeds times moments they repeat.
        """
        seeds, moments = len(self.cases), len(MOMENTS[phase])
        return [self._moment(phase, i // seeds % moments, i % seeds) for i in range(count)]

    def _moment(self, phase: str, moment: int, seed: int) -> Moment:
        setup, place = self._setups[seed], f"{phase}/{moment}/{seed}"
        state = {name: self._arrays[f"{place}/{name}"] for name in _STATE}
        count = len(state["positions"])
        density = self.cases[seed].grain_material.density
        grains = Grains(**state, densities=np.full(count, density), shapes=np.zeros(count, dtype=int))
        walls = list(setup.walls)
        tube, pair = walls[TUBE]
        walls[TUBE] = (replace(tube, point=(0.0, 0.0, float(self._arrays[f"{place}/rise"]))), pair)
        setup = replace(setup, grains=grains, walls=tuple(walls))
        lift = Motion(velocity=(0.0, 0.0, self.cases[seed].scene.lift_speed))
        return Moment(setup, lift if phase == "lifting" else REST)

    def _key(self) -> str:
        """Digest of what the arrays depend on, but for the code."""
        content = [self.cases[0].to_dict(), MOMENTS, self.device.partition(":")[0]]
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:8]

    def _simulate(self) -> dict[str, np.ndarray]:
        """Arrays of every moment of every column, by phase, number of the moment, seed and name."""
        batch = Batch(self.cases, self.device)
        worlds = range(len(self.cases))
        missing = {(phase, k, w) for phase in MOMENTS for k in range(len(MOMENTS[phase])) for w in worlds}
        arrays: dict[str, np.ndarray] = {}
        while missing:
            for world, result in batch.advance():
                reason = result.reason or "at rest"
                raise RuntimeError(f"column of seed {world} ended before its last moment: {reason}")
            views = batch.solver.view(worlds)
            elapsed = [_elapsed(batch, w, views[w]) for w in worlds]
            for phase, k, w in sorted(missing):
                if elapsed[w][phase] >= MOMENTS[phase][k]:
                    missing.remove((phase, k, w))
                    for name, array in _state(batch, w, views[w]).items():
                        arrays[f"{phase}/{k}/{w}/{name}"] = array
        return arrays


def _state(batch: Batch, world: int, view: WorldView) -> dict[str, np.ndarray]:
    """Living grains of a column, and how high its tube stands [m]."""
    poses = batch.solver.poses(world)
    slots, grains = poses.pop("slots"), batch.setups[world].grains
    return {
        **poses,
        "sizes": grains.sizes[slots],
        "release_steps": np.maximum(grains.release_steps[slots] - view.step, 0),
        "rise": batch.solver.wall_pose(world, TUBE)[0][2],
    }


def _elapsed(batch: Batch, world: int, view: WorldView) -> dict[str, float]:
    """Progress of a column in each phase, in the parts of which MOMENTS speaks."""
    state, setup, scene = batch.controllers[world].state, batch.setups[world], batch.cases[world].scene
    rain = float(setup.grains.release_steps.max()) * setup.time_step
    lifting = state.phase == "lift"
    since = view.time - state.phase_start
    return {
        "filling": view.time / rain if state.phase == "fill" else 0.0,
        "settled": float(lifting),
        "lifting": since * scene.lift_speed / scene.diameter if lifting else 0.0,
    }
