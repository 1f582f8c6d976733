"""Observables of a test that another code ran: its film and its balance, read by our own functions.

The film is a dump over time (``id id_multisphere x y z vx vy vz radius``, or ``mol`` for the body), a frame a
look from the start of the lift to the rest; the balance is the mean force on the tube from look to look. Our
controller of the test looks at the frames as it looks at our own worlds.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dem_warp import Case, ClumpShape, LiftedCylinder
from dem_warp.model import Grains, WorldSetup
from dem_warp.scenes.lifted_cylinder import LiftController
from dem_warp.scenes.walled_scene import default_skin
from dem_warp.view import WorldView, overviews
from experiments.cases.engines.program import AnswerError

FRAMES, DRAG = "film.dump", "balance.txt"
"""Files that an input leaves."""

_HEAD = 9
"""Lines of a frame before its rows."""

_RIGID = 1e-3
"""Largest part by which the distances of a grain's spheres may miss those of its shape."""


@dataclass(frozen=True, eq=False)
class Frame:
    """One look at the grains: places, velocities and sizes by grain, and where its spheres are."""

    step: int
    numbers: np.ndarray
    """Numbers of the grains in the code, rising, (n,)."""
    positions: np.ndarray
    velocities: np.ndarray
    """Places and velocities of the centres of mass [m], [m/s], (n, 3)."""
    sizes: np.ndarray
    """Scales of the shape, (n,)."""
    spheres: np.ndarray
    """Centres and radii [m], (n, S, 4)."""


@dataclass(frozen=True, eq=False)
class Grasp:
    """Numbers by which a grain is known from its spheres."""

    shape: ClumpShape

    @property
    def weights(self) -> np.ndarray:
        """Parts of the spheres' centres that add up to the centre of mass, (S,)."""
        count = self.shape.sphere_count
        system = np.vstack([self.shape.centers.T / self.shape.bounding_radius, np.ones(count)])
        wanted = np.array([0.0, 0.0, 0.0, 1.0])
        weights = np.linalg.lstsq(system, wanted, rcond=None)[0]
        if not np.allclose(system @ weights, wanted, atol=1e-6):
            raise AnswerError("the spheres of this grain do not show where its centre of mass is")
        return np.asarray(weights)

    def frame(self, step: int, rows: np.ndarray) -> Frame:
        """Take a frame from rows of a dump: id, body, x, y, z, vx, vy, vz, radius.

        Spheres without a body, which has the number -1 then, are left out: LIGGGHTS takes a grain away as
        soon as one of its spheres leaves the box, and its others at their next step.
        """
        count = self.shape.sphere_count
        rows = rows[rows[:, 1] > 0]
        rows = rows[np.lexsort((rows[:, 0], rows[:, 1]))]
        numbers, found = np.unique(rows[:, 1], return_counts=True)
        if not len(numbers) or not (found == count).all():
            raise AnswerError(f"step {step}: every grain must have {count} spheres")
        spheres = rows.reshape(len(numbers), count, -1)
        sizes = spheres[:, :, 8].sum(axis=1) / self.shape.radii.sum()
        centers, radii = spheres[:, :, 2:5], spheres[:, :, 8]
        self._check(step, centers, sizes)
        return Frame(
            step,
            numbers.astype(int),
            np.einsum("s,nsk->nk", self.weights, centers),
            np.einsum("s,nsk->nk", self.weights, spheres[:, :, 5:8]),
            sizes,
            np.concatenate([centers, radii[:, :, None]], axis=2),
        )

    def _check(self, step: int, centers: np.ndarray, sizes: np.ndarray) -> None:
        """Check that spheres are as far apart as in the shape."""
        own = self.shape.centers
        wanted = np.linalg.norm(own - np.roll(own, 1, axis=0), axis=1)
        apart = np.linalg.norm(centers - np.roll(centers, 1, axis=1), axis=2)
        if np.abs(apart - sizes[:, None] * wanted).max() > _RIGID * self.shape.bounding_radius:
            raise AnswerError(f"step {step}: the spheres of a grain are not where its shape has them")


def read_film(path: Path, shape: ClumpShape) -> Iterator[Frame]:
    """Frames of a dump, in order."""
    grasp = Grasp(shape)
    try:
        texts = path.read_text(encoding="utf-8").split("ITEM: TIMESTEP\n")[1:]
    except OSError:
        raise AnswerError(f"the program wrote no {path.name}") from None
    for text in texts:
        head, _, body = text.partition("ITEM: ATOMS")
        columns, _, rows = body.partition("\n")
        width = len(columns.split())
        try:
            numbers = np.array(rows.split(), dtype=np.float64).reshape(-1, width)
            step, count = int(head.split("\n", 1)[0]), int(head.split("\n")[2])
        except (ValueError, IndexError) as error:
            raise AnswerError(f"{path.name}: a frame is malformed: {error}") from None
        if len(numbers) != count:
            raise AnswerError(f"{path.name}: step {step} must have {count} rows, got {len(numbers)}")
        yield grasp.frame(step, numbers)


def read_balance(path: Path) -> Mapping[int, float]:
    """Mean force on the tube along its axis since the look before [N], by step."""
    try:
        rows = np.loadtxt(path, comments="#", ndmin=2)
    except (OSError, ValueError) as error:
        raise AnswerError(f"{path.name}: {error}") from None
    return {int(step): float(force) for step, force in rows[:, :2]}


class FilmedLift(LiftController):
    """Our controller of the lifted cylinder, looking at a film that begins with the lift."""

    def start(self, view: WorldView) -> None:
        """Measure the filling, and begin."""
        self._measure_fill(view, view.alive)
        self.begin(view, view.alive)

    def finish(self, view: WorldView) -> None:
        """End where the code has ended, which found the grains at rest at its own looks."""
        elapsed = view.time - self.state.phase_start
        if not self.scene.lift_speed * elapsed > view.highest + self.reach:
            raise AnswerError("the film ends before the tube is clear of the heap")
        self._finish(view, elapsed)


def filmed_observables(
    case: Case[LiftedCylinder], frames: Iterator[Frame], forces: Mapping[int, float]
) -> tuple[dict[str, float], Frame, str]:
    """Observables of a filmed test, its last frame, and why it failed; empty where it did not."""
    first = next(frames, None)
    if first is None:
        raise AnswerError("the film has no frame")
    setup = _world(case, first)
    controller = FilmedLift(case, setup, chunk=1)
    watch = _Watch(case.time_step, first, setup.masses)
    frame, view = first, watch.view(first, 0.0)
    controller.start(view)
    for frame in frames:
        if frame.step not in forces:
            raise AnswerError(f"step {frame.step}: the balance has no force")
        view = watch.view(frame, forces[frame.step])
        decision = controller.look(view)
        if decision.failure or decision.done:
            return dict(controller.state.observables), watch.kept(frame), decision.failure
        if decision.remove is not None:
            watch.alive[decision.remove] = False
    controller.finish(view)
    return dict(controller.state.observables), watch.kept(frame), ""


class _Watch:
    """Frames as views of a world whose grains are those of the first one."""

    def __init__(self, time_step: float, first: Frame, masses: np.ndarray) -> None:
        self._time_step, self._first, self._masses = time_step, first, masses
        self._step, self._impulse = first.step, 0.0
        self.alive = np.ones(len(masses), dtype=bool)
        """Grains that have not been lost, by their place in the first frame."""

    def view(self, frame: Frame, force: float) -> WorldView:
        """Look at a frame, the mean force on the tube since the last one being `force` [N]."""
        self._impulse += force * (frame.step - self._step) * self._time_step
        self._step = frame.step
        places = np.searchsorted(self._first.numbers, frame.numbers)
        present = np.zeros_like(self.alive)
        present[places] = True
        self.alive &= present
        positions, velocities = np.zeros((len(present), 3)), np.zeros((len(present), 3))
        positions[places], velocities[places] = frame.positions, frame.velocities
        rms, fastest, highest = overviews(positions[None], velocities[None], self.alive[None])
        step = frame.step - self._first.step
        return WorldView(
            step=step,
            time=step * self._time_step,
            alive=self.alive.copy(),
            released=np.ones_like(self.alive),
            positions=positions,
            velocities=velocities,
            masses=self._masses,
            impulses=np.array([[0.0, 0.0, self._impulse]]),
            rms_speed=float(rms[0]),
            fastest=float(fastest[0]),
            highest=float(highest[0]),
        )

    def kept(self, frame: Frame) -> Frame:
        """Leave out of a frame what has been taken away."""
        here = self.alive[np.searchsorted(self._first.numbers, frame.numbers)]
        return Frame(
            frame.step,
            frame.numbers[here],
            frame.positions[here],
            frame.velocities[here],
            frame.sizes[here],
            frame.spheres[here],
        )


def _world(case: Case[LiftedCylinder], first: Frame) -> WorldSetup:
    """World of ours with the grains of a frame, as our controller knows them."""
    scene, count = case.scene, len(first.numbers)
    walls = scene.walls(case.grains.grain_reach)
    contacts, holds = scene.surfaces(case, len(walls))
    grains = Grains(
        positions=first.positions,
        orientations=np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)),
        velocities=first.velocities,
        spins=np.zeros((count, 3)),
        sizes=first.sizes,
        densities=np.full(count, case.grain_material.density),
        shapes=np.zeros(count, dtype=int),
        release_steps=np.zeros(count, dtype=int),
    )
    half_x, half_y, bottom = scene.room(case.grains.grain_reach)
    return WorldSetup(
        grains=grains,
        shapes=tuple(case.grains.mixture.shapes),
        contacts=contacts,
        walls=tuple(zip(walls, holds, strict=True)),
        time_step=case.time_step,
        skin=default_skin(case),
        speed_limit=20.0 * scene.top_speed,
        domain=((-half_x, -half_y, bottom), (half_x, half_y, 4.0 * scene.height)),
        gravity=scene.gravity,
        weighed=scene.weighed,
    )
