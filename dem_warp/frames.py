"""Frames of a running case: grains, walls and contact forces at equal intervals over its whole time."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dem_warp.batch import Batch, begin
from dem_warp.case import Case
from dem_warp.clumps import stack_spheres
from dem_warp.contact_forces import ContactForces, ForceProbe
from dem_warp.device import resolve_device
from dem_warp.processes import REPORT_EVERY
from dem_warp.result import CaseResult, OnProgress, Progress, place_spheres
from dem_warp.walls import Wall

LEAST_FRAMES = 2
"""Least number of frames: the first state and the last."""

FINENESS = 4
"""Most stored frames over the requested ones, so that these can be chosen at equal intervals."""


@dataclass(frozen=True, eq=False)
class Frame:
    """State of a world between two steps, without grains that wait for their release."""

    time: float
    """Time [s]."""
    phase: str
    """Phase of the test."""
    grains: np.ndarray
    """Number of each grain, the same in every frame, shape (n,)."""
    positions: np.ndarray
    orientations: np.ndarray
    """Centres of mass [m], (n, 3), and quaternions x y z w from the body to the world, (n, 4)."""
    velocities: np.ndarray
    spins: np.ndarray
    """Velocities [m/s] and spins [rad/s] in the world's frame, shape (n, 3)."""
    wall_poses: tuple[tuple[np.ndarray, np.ndarray], ...]
    """Place of each wall's own point [m] and orientation of the wall (quaternion x y z w)."""
    contacts: ContactForces


@dataclass(frozen=True, eq=False)
class Film:
    """Frames of one case, and the data common to all."""

    walls: tuple[Wall, ...]
    """Walls before the first motion."""
    wall_names: tuple[str, ...]
    sizes: np.ndarray
    """Scale of every grain's shape, by the grain's number, shape (m,)."""
    shapes: np.ndarray
    """Index of its shape into `clumps`, shape (m,)."""
    clumps: np.ndarray
    """Spheres of the shapes, as in `CaseResult`."""
    masses: np.ndarray
    """Mass of every grain [kg], shape (m,)."""
    volumes: np.ndarray
    """Volume of every grain, with overlaps counted once [m3], shape (m,)."""
    frames: tuple[Frame, ...] = ()

    def spheres(self, frame: Frame) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the spheres of a frame: centres [m], (s, 3), radii [m] and row of their grain, (s,)."""
        sizes, shapes = self.sizes[frame.grains], self.shapes[frame.grains]
        return place_spheres(frame.positions, frame.orientations, sizes, self.clumps[shapes])


def simulate_frames(
    case: Case, count: int, device: str | None = None, on_progress: OnProgress | None = None
) -> tuple[CaseResult, Film | None]:
    """Simulate one case, and return its result, with the bits of `simulate`, and frames.

    `count` includes the first state and the last, and is LEAST_FRAMES or more; a very short case has fewer.
    The other parameters are as in `simulate`. The film is None if the case could not begin.
    """
    if count < LEAST_FRAMES:
        raise ValueError(f"simulate_frames.count: must be {LEAST_FRAMES} or more, got {count!r}")
    batch, _, refused = begin([case], resolve_device(device))
    if batch is None:
        return refused[0], None
    camera, reel, started = _Camera(batch), _Reel(count), time.perf_counter()
    reel.offer(0, camera.frame)
    reported, ended = started, list[tuple[int, CaseResult]]()
    while not ended:
        ended = batch.advance()
        if ended:
            reel.close(camera.frame)
        elif batch.steps[0] % batch.controllers[0].period == 0:
            reel.offer(batch.steps[0] // batch.controllers[0].period, camera.frame)
        if on_progress and (ended or time.perf_counter() - reported > REPORT_EVERY):
            reported = time.perf_counter()
            counts = {} if ended else {batch.phase(0): 1}
            on_progress(Progress(len(ended), 1, batch.fraction(0), counts, reported - started))
    return ended[0][1], camera.film(reel.chosen())


class _Camera:
    """Source of frames of the only world of a batch."""

    def __init__(self, batch: Batch) -> None:
        self._batch, self._probe = batch, ForceProbe(batch.solver)

    def frame(self) -> Frame:
        solver, setup = self._batch.solver, self._batch.setups[0]
        step = int(solver.grains[0].step.numpy()[0])
        poses = solver.poses(0)
        seen = setup.grains.release_steps[poses["slots"]] <= step
        slots, positions, orientations, velocities, spins = (np.array(poses[name])[seen] for name in poses)
        return Frame(
            step * setup.time_step, self._batch.phase(0), slots, positions, orientations,
            velocities.astype(float), spins.astype(float),
            tuple(solver.wall_pose(0, wall) for wall in range(len(setup.walls))),
            self._probe.forces(0),
        )  # fmt: skip

    def film(self, frames: tuple[Frame, ...]) -> Film:
        setup, scene = self._batch.setups[0], self._batch.cases[0].scene
        numbered = tuple(f"wall-{number}" for number in range(len(setup.walls)))
        return Film(
            walls=tuple(wall for wall, _ in setup.walls),
            wall_names=getattr(scene, "wall_names", numbered),
            sizes=setup.grains.sizes,
            shapes=setup.grains.shapes,
            clumps=stack_spheres(setup.shapes),
            masses=setup.masses,
            volumes=setup.masses / setup.grains.densities,
            frames=frames,
        )


class _Reel:
    """Frames at equal intervals over a run of unknown length.

    When there are too many, every second one is dropped and the interval doubles.
    """

    def __init__(self, count: int) -> None:
        self._count, self._stride = count, 1
        self._frames: list[Frame] = []

    def offer(self, number: int, take: Callable[[], Frame]) -> None:
        """Store the frame of a look, by the look's number, if it is due."""
        if number % self._stride:
            return
        self._frames.append(take())
        if len(self._frames) > FINENESS * self._count:
            self._frames, self._stride = self._frames[::2], 2 * self._stride

    def close(self, take: Callable[[], Frame]) -> None:
        """Store the last frame of a run."""
        self._frames.append(take())

    def chosen(self) -> tuple[Frame, ...]:
        """Return the requested number of frames, with the first and the last."""
        places = np.linspace(0, len(self._frames) - 1, min(self._count, len(self._frames)))
        return tuple(self._frames[place] for place in np.rint(places).astype(int))
