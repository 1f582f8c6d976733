"""The number of steps between two checks of the neighbour lists."""

import math
from collections.abc import Sequence

import numpy as np

from dem_warp.kernels.candidates import HEADROOM, LEAST_PATH, LONGEST_CYCLE
from dem_warp.model import WorldSetup

SHORTEST_CYCLE = 2
SKIN_PER_CYCLE, SKIN_PER_SERIAL_CYCLE = 0.1, 0.3
"""Part of the skin that the fastest grain of a world may use up between two checks of the neighbour lists, on
a GPU and on a CPU, where only moved grains cost in a rebuild."""

SHORT_CYCLES = {2: 0.25, 4: 0.25, 8: 0.2}
"""Cycle lengths in which it may use up more on a GPU, as the check costs as much as so few steps."""


GAIN = 0.1
"""Speed that grains may gain by their weight before the next choice on a GPU [m/s]: to choose again waits for
the device, as long as some 20 steps of one world take."""


class Cycles:
    """Choice of the cycle length: a power of two that the lists allow the fastest grain of any world."""

    def __init__(self, worlds: Sequence[WorldSetup], is_cuda: bool) -> None:
        self.limit = LONGEST_CYCLE
        self._is_cuda = is_cuda
        self._rates = np.array([(w.time_step, w.skin, np.linalg.norm(w.gravity)) for w in worlds]).T
        self._gain = self._rates[2] * self._rates[0]
        self._slowest = np.array([_slowest(*rates) for rates in self._rates.T])

    def valid(self, running: Sequence[int], most: int) -> int:
        """Return the steps after which a GPU chooses anew, `most` of them at most and always on a CPU."""
        gain = float(self._gain[running].max())
        return min(most, int(GAIN / gain)) if self._is_cuda and gain > 0.0 else most

    def length(self, running: Sequence[int], fastest: np.ndarray, ahead: int) -> int:
        """Return the steps of a cycle for the next `ahead` steps of the running worlds.

        `fastest` is the speed of each world's fastest grain [m/s], (worlds,). Grains gain speed by their
        weight; the lists allow for other accelerations.
        """
        time_step, skin, gravity = self._rates[:, running]
        speed = fastest[running] + gravity * ahead * time_step
        with np.errstate(divide="ignore"):
            free = float(np.min(skin / (speed * time_step)))
        if self._is_cuda:
            short = max((n for n, part in SHORT_CYCLES.items() if n <= part * free), default=0)
            length = min(max(SKIN_PER_CYCLE * free, short), float(np.min(self._slowest[running])))
        else:
            length = SKIN_PER_SERIAL_CYCLE * free
        length = max(length, SHORTEST_CYCLE)
        return int(2 ** np.floor(np.log2(min(length, self.limit))))


def _slowest(time_step: float, skin: float, gravity: float) -> float:
    """Return the steps in which a grain that begins to fall uses up half of its least path."""
    if gravity == 0.0:
        return LONGEST_CYCLE
    return math.sqrt(0.5 * LEAST_PATH * skin / (HEADROOM * gravity)) / time_step
