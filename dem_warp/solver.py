"""The sequence of launches that steps a batch, captured once as a graph and replayed."""

from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import numpy as np
import warp as wp

from dem_warp.cycles import SHORTEST_CYCLE, Cycles
from dem_warp.kernels.candidates import LONGEST_CYCLE, PACE_LANES, candidate_kernels
from dem_warp.kernels.cells import cell_kernels
from dem_warp.kernels.lanes import BLOCK, WARP
from dem_warp.kernels.neighbours import list_threads, neighbour_kernels
from dem_warp.kernels.stale import ALL
from dem_warp.kernels.step import step_kernels
from dem_warp.kernels.summation import MIN_LANES
from dem_warp.kernels.walls import wall_kernels
from dem_warp.laws.contact_law import memory_size
from dem_warp.model import WorldSetup
from dem_warp.room import neighbour_room
from dem_warp.state import (
    Layout,
    build_cells,
    build_grains,
    build_model,
    build_neighbours,
    copy_grains,
    living_grains,
)
from dem_warp.triangles import place_triangles
from dem_warp.types import FRAMES, PRECISIONS, Build, CheckRate
from dem_warp.view import WorldView, overviews
from dem_warp.walls import Motion

CHUNK = 256
"""Least number of steps of `advance`; a multiple of every cycle length."""

LOOK_CHUNKS = 16
"""Most chunks after which the cycle length is chosen again from the speed of the grains."""

FULL_DEVICE_THREADS = 84_480
"""Threads of a step that a large GPU (132 multiprocessors) runs at once; with fewer threads more lanes per
grain shorten a step."""

MOST_LANES = 16

SEARCH_THREADS = 4 * FULL_DEVICE_THREADS
"""Least threads of a search, which needs fewer registers than a step."""

SEARCH_LANES = 1
"""Threads of a search for each sphere of large worlds."""

ANY_PACE = 1.0e9
"""Speed above that of any grain [m/s]: with it every entry of a list is a candidate."""


class Solver:
    """A batch of worlds on one device, with equal numbers of walls and contacts, and equal mechanisms.

    Every world has its own time step and parameters; worlds share only the launches. The state of a world
    after a number of steps depends on its setup alone, not on other worlds, its place, the lanes or the skin.
    `precision` is "mixed" or "double"; `capacity` is the number of neighbours per grain. Default: from the
    densest packing of the spheres.
    """

    def __init__(
        self,
        worlds: Sequence[WorldSetup],
        device: Any = "cpu",
        precision: str = "mixed",
        capacity: int | None = None,
    ) -> None:
        self.worlds = list(worlds)
        self.device = wp.get_device(device)
        self.precision = PRECISIONS[precision]
        self.layout = Layout.of(worlds)
        layout = self.layout
        self.build = Build(
            self.precision, layout.sphere_count, layout.wall_count, self.device.is_cuda,
            layout.mechanisms, layout.has_mesh, layout.has_free_wall,
            layout.is_periodic, layout.forms,
        )  # fmt: skip
        self._step_kernels = step_kernels(self.build)
        self._cell_kernels = cell_kernels(self.build.without_forces)
        self._wall_kernels = wall_kernels(self.build.without_forces)
        self._list_kernels = neighbour_kernels(self.build)
        room = [neighbour_room(world) for world in worlds]
        self._candidate_kernels = candidate_kernels(self.build.without_forces)
        self.cycles = Cycles(worlds, self.device.is_cuda)
        self.check_rate = CheckRate.USUAL
        with wp.ScopedDevice(self.device):
            self._build_state([(found, capacity or listed) for found, listed in room])
        self._running = list(range(len(worlds)))
        self._time_steps = np.array([world.time_step for world in worlds])
        self._releases = [np.sort(world.grains.release_steps) for world in worlds]
        self._free_grains = sum(world.grains.count for world in worlds)
        self._impulse_of_count = np.array([w.time_step / w.force_rate for w in worlds])
        self._graphs: dict[tuple[int, int, int, CheckRate], Any] = {}
        self._commands: tuple[Any, ...] = ()
        self._place()

    def _build_state(self, room: Sequence[tuple[int, int]]) -> None:
        layout, device = self.layout, self.device
        found_capacity, capacity = (max(sizes) for sizes in zip(*room, strict=True))
        self.model = build_model(self.worlds, room, layout, self.precision, device)
        self._trees = place_triangles(self.model, self.worlds, self.precision, device)
        first = build_grains(self.worlds, layout, self.precision, device)
        # a single thread moves grains after all forces are known, without a second copy
        self.grains = (first, copy_grains(first, self.precision) if self.device.is_cuda else first)
        remembered = memory_size(layout.mechanisms, layout.forms)
        self.neighbours = build_neighbours(layout, capacity, remembered, self.precision, device)
        self.cells = build_cells(layout, found_capacity, capacity, remembered, self.precision, device)
        self.alive = living_grains(self.worlds, layout, device)
        self.flags, self.stale, self.idle, self.rebuilds, self.running = (
            wp.zeros(layout.world_count, dtype=int) for _ in range(5)
        )
        self.any_stale = wp.zeros(1, dtype=int)
        self.fastest = wp.zeros(layout.world_count, dtype=float)

    def _place(self) -> None:
        for grains in self.grains:
            self._launch(self._step_kernels.place_spheres, self.layout.grain_total, [self.model, grains])
        self._set_running(self._running)
        self._place_walls(FRAMES - 1)
        self.stale.fill_(ALL)
        self._rebuild(0)
        self._check_cycle(0, 0)

    def _whole_warps(self, threads: int) -> int:
        """Return the number of threads rounded up to whole warps of a GPU."""
        return -(-threads // WARP) * WARP if self.device.is_cuda else threads

    def _launch(self, kernel: Any, dim: int, inputs: list[Any]) -> None:
        wp.launch(kernel, dim, inputs=inputs, device=self.device, block_dim=BLOCK)

    @property
    def lanes(self) -> int:
        """Threads per grain: more if few grains move freely."""
        if not self.device.is_cuda:
            return 1
        grains = max(self._free_grains, 1)
        lanes = MOST_LANES
        while lanes > MIN_LANES and lanes * grains > FULL_DEVICE_THREADS:
            lanes //= 2
        return lanes

    def _step_command(self, read: int) -> Any:
        """Return a recorded launch of a step, which is faster to repeat than to create."""
        slots = len(self._running) * self.layout.grain_count
        threads = self._whole_warps(slots * self.lanes) if self.device.is_cuda else 1
        inputs = [
            self.lanes, slots, self.model, self.running, self.grains[read], self.neighbours, self.alive,
            self.flags, self.grains[1 - read],
        ]  # fmt: skip
        kernel = self._step_kernels.step
        return wp.launch(kernel, threads, inputs=inputs, device=self.device, block_dim=BLOCK, record_cmd=True)

    def _step(self, read: int) -> None:
        self._commands[read].launch()
        if self.layout.has_free_wall:
            inputs = [self.model, self.idle, self.grains[1 - read], self.neighbours]
            self._launch(self._wall_kernels.carry, self.layout.world_count, inputs)

    def _place_walls(self, ahead: int, read: int = 0) -> None:
        frames = len(self.worlds) * self.layout.wall_count * (ahead + 1)
        self._launch(
            self._wall_kernels.place_walls, frames, [ahead, self.model, self.grains[read], self.neighbours]
        )

    def _rebuild(self, read: int) -> None:
        spheres, grains = self.layout.sphere_total, self.grains[read]
        cells, lists = self._cell_kernels, self._list_kernels
        near = self.neighbours.near
        binned = [self.model, grains, self.alive, self.stale, near, self.cells]
        self._launch(cells.bin_spheres, spheres, binned)
        self._launch(cells.open_buckets, self._whole_warps(spheres), [self.model, self.stale, self.cells])
        filled = [self.model, grains, self.stale, near, self.cells]
        self._launch(cells.fill_buckets, self._whole_warps(spheres), filled)
        threads = spheres
        if self.device.is_cuda:
            threads = min(WARP * spheres, max(SEARCH_THREADS, SEARCH_LANES * self._whole_warps(spheres)))
        self._launch(cells.search, threads, [threads, *filled])
        threads = self.layout.grain_total * list_threads(self.build)
        written = [self.model, grains, self.stale, self.cells, self.neighbours, self.flags]
        self._launch(lists.write_lists, threads, written)
        finish = [grains, self.cells, self.neighbours, self.stale, self.any_stale, self.rebuilds]
        self._launch(lists.finish, self.layout.world_count, finish)

    def _rebuild_together(self, steps: int, read: int) -> None:
        inputs = [steps, self.model, self.grains[read], self.alive, self.idle, self.neighbours, self.stale]
        self._launch(self._candidate_kernels.join, self.layout.grain_total, inputs)
        self._rebuild(read)

    def _prepare_cycle(self, steps: int, read: int) -> None:
        """Prepare wall places, neighbour lists and contact candidates for the next steps."""
        kernels, grains, total = self._candidate_kernels, self.grains[read], self.layout.grain_total
        self._place_walls(steps, read)
        if self.check_rate == CheckRate.EVERY_STEP:
            self.stale.fill_(ALL)
            self.any_stale.fill_(1)
        seen = [self.model, grains, self.alive, self.idle]
        inputs = [steps, *seen, self.fastest, self.neighbours, self.stale, self.any_stale]
        self._launch(kernels.mark_stale, total, inputs)
        wp.capture_if(self.any_stale, self._rebuild_together, steps=steps, read=read)
        threads = total * WARP if self.device.is_cuda else total
        inputs = [steps, self.model, self.alive, self.idle, self.fastest, self.neighbours]
        self._launch(kernels.raise_pace, total * (PACE_LANES if self.device.is_cuda else 1), inputs)
        if self.check_rate == CheckRate.EVERY_STEP:
            self.neighbours.near.pace.fill_(ANY_PACE)
        self._launch(kernels.select_near, threads, [steps, *seen, self.neighbours, self.fastest])

    def _check_cycle(self, read: int, past: int) -> None:
        """After some steps find the fastest grains, and flag worlds that may have missed a contact."""
        row = self._whole_warps(self.layout.grain_count)
        inputs = [
            row, past, self.model, self.alive, self.idle, self.grains[read], self.grains[1 - read],
            self.neighbours, self.fastest, self.flags,
        ]  # fmt: skip
        self._launch(self._candidate_kernels.find_fastest, row * self.layout.world_count, inputs)

    def _cycle(self, steps: int, read: int = 0) -> None:
        """Take steps between two checks of the lists, or with a check before each."""
        each = 1 if self.check_rate == CheckRate.EVERY_STEP else steps
        self._commands = self._step_command(0), self._step_command(1)
        for first in range(read, read + steps, each):
            self._prepare_cycle(each, first % 2)
            for step in range(first, first + each):
                self._step(step % 2)
            self._check_cycle((first + each) % 2, each)

    def _graph(self, cycle: int) -> Any:
        key = (self.lanes, len(self._running), cycle, self.check_rate)
        if key not in self._graphs:
            with wp.ScopedCapture(self.device) as capture:
                for _ in range(self._cycles_captured(cycle)):
                    self._cycle(cycle)
            self._graphs[key] = capture.graph
        return self._graphs[key]

    def _cycles_captured(self, cycle: int) -> int:
        """Return the cycles of a graph: several short ones on a GPU, where starting a graph is slow."""
        return LONGEST_CYCLE // cycle if self.device.is_cuda else 1

    def _cycle_length(self, chunks: int) -> int:
        """Return the steps of a cycle in the next chunks."""
        if self.check_rate != CheckRate.USUAL:
            return SHORTEST_CYCLE
        return self.cycles.length(self._running, self.fastest.numpy(), chunks * CHUNK)

    def _count_free(self, chunks: int) -> int:
        """Return how many grains of the running worlds move freely within the next chunks."""
        last = self.grains[0].step.numpy() + chunks * CHUNK
        return sum(int(np.searchsorted(self._releases[w], last[w])) for w in self._running)

    def advance(self, chunks: int = 1) -> None:
        """Take `chunks` times CHUNK steps in every running world."""
        while chunks > 0 and self._running:
            ahead = min(chunks, max(self.cycles.valid(self._running, LOOK_CHUNKS * CHUNK) // CHUNK, 1))
            cycle, self._free_grains = self._cycle_length(ahead), self._count_free(ahead)
            graph = self._graph(cycle)
            for _ in range(ahead * CHUNK // (cycle * self._cycles_captured(cycle))):
                wp.capture_launch(graph)
            chunks -= ahead

    def _set_running(self, running: Sequence[int]) -> None:
        self._running = list(running)
        slots = np.zeros(self.layout.world_count, dtype=np.int32)
        slots[: len(running)] = running
        idle = np.ones(self.layout.world_count, dtype=np.int32)
        idle[list(running)] = 0
        self.running.assign(slots)
        self.idle.assign(idle)

    def stop(self, world: int) -> None:
        """Freeze a world in its present state."""
        self._set_running([w for w in self._running if w != world])

    def remove(self, world: int, grains: np.ndarray) -> None:
        """Remove grains from a world, by slot."""
        rows = np.asarray(grains, dtype=np.int32) + world * self.layout.grain_count
        if rows.size:
            removed: Any = wp.array(rows, dtype=int, device=self.device)
            self._launch(
                self._step_kernels.remove, rows.size, [self.model, removed, self.alive, *self.grains]
            )

    def move_wall(self, world: int, wall: int, motion: Motion) -> None:
        """Give a wall a new motion from its present place, from the present step on."""
        self.move_walls([(world, wall, motion)])

    def move_walls(self, moves: Sequence[tuple[int, int, Motion]]) -> None:
        """Give walls new motions, each by world and number, in about the time of one."""
        if not moves:
            return
        walls, stale = np.array(self.model.wall.numpy()), np.array(self.stale.numpy())
        steps = self.grains[0].step.numpy()
        self._place_walls(0)
        for world, wall, motion in moves:
            if motion.mass and wall != self.worlds[world].free_wall:
                raise ValueError(
                    f"Motion.mass: must be 0 for wall {wall}, which is not free, got {motion.mass!r}"
                )
            if wall == self.worlds[world].free_wall:
                self.neighbours.lift[world : world + 1].zero_()
            row = walls[world * self.layout.wall_count + wall]
            row["start_step"] = steps[world]
            frame = self._frame(world, wall).numpy()[0]
            row["point"], row["orientation"] = frame["origin"], frame["rotation"]
            for field in fields(motion):
                row[field.name] = getattr(motion, field.name)
            stale[world] = ALL
        self.model.wall.assign(walls)
        self._place_walls(0)
        # the lists allow for the old motion only
        self.stale.assign(stale)
        self._rebuild(0)
        self._check_cycle(0, 0)

    def wall_pose(self, world: int, wall: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the place of the wall's own point [m] and its orientation (quaternion x y z w)."""
        self._place_walls(0)
        frame = self._frame(world, wall).numpy()[0]
        return np.array(frame["origin"]), np.array(frame["rotation"])

    def _frame(self, world: int, wall: int) -> Any:
        """Return the frame of a wall in the present step, as an array of one on the device."""
        step = int(self.grains[0].step[world : world + 1].numpy()[0])
        place = (world * self.layout.wall_count + wall) * FRAMES + step % FRAMES
        return self.model.frame[place : place + 1]

    def impulses(self) -> np.ndarray:
        """Return the impulses of the grains from step 0 [N s], shape (worlds, weighed walls, 3).

        Each is the sum over all steps of force times time step.
        """
        layout = self.layout
        by_grain = self.neighbours.pushed.numpy().reshape(
            layout.world_count, layout.grain_count, layout.weighed_count, 3
        )
        return np.asarray(by_grain.sum(axis=1) * self._impulse_of_count[:, None, None])

    def view(self, worlds: Sequence[int]) -> list[WorldView]:
        """Return the state of some worlds for their scenes, copied from the device."""
        n, grains = self.layout.grain_count, self.grains[0]
        chosen: Any = list(worlds)
        if self.device.is_cuda and chosen == list(range(self.layout.world_count)):
            chosen = slice(None)  # the arrays are already copies
        steps = grains.step.numpy()[chosen]
        alive = self.alive.numpy().reshape(-1, n)[chosen] > 0
        released = self.model.release_step.numpy().reshape(-1, n)[chosen] <= steps[:, None]
        positions = grains.position.numpy().reshape(-1, n, 3)[chosen]
        velocities = grains.velocity.numpy().reshape(-1, n, 4)[chosen]
        numbers = [
            steps.tolist(),
            (steps * self._time_steps[chosen]).tolist(),
            alive,
            released,
            positions,
            velocities[:, :, :3],
            velocities[:, :, 3],
            self.impulses()[chosen],
            *(each.tolist() for each in overviews(positions, velocities, alive)),
            *([self.neighbours.lift.numpy()[chosen, 0].tolist()] if self.layout.has_free_wall else []),
        ]
        return [WorldView(*each) for each in zip(*numbers, strict=True)]

    def poses(self, world: int) -> dict[str, np.ndarray]:
        """Return slots, positions [m], orientations, velocities [m/s] and spins [rad/s] of the grains."""
        n = self.layout.grain_count
        rows = slice(world * n, (world + 1) * n)
        slots = np.flatnonzero(self.alive[rows].numpy() > 0)
        grains = self.grains[0]
        return {
            "slots": slots,
            "positions": grains.position[rows].numpy()[slots],
            "orientations": grains.orientation[rows].numpy()[slots],
            "velocities": grains.velocity[rows].numpy()[slots, :3],
            "spins": grains.spin[rows].numpy()[slots, :3],
        }
