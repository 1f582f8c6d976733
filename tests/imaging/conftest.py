"""A simulated heap and its angle for all tests, which import `drawn_heaps` from this folder."""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from imaging import HeapAngle, heap_angle

sys.path.insert(0, str(Path(__file__).parent))


class Heap(NamedTuple):
    centers: np.ndarray
    radii: np.ndarray
    grains: np.ndarray


@pytest.fixture(scope="session")
def heap() -> Heap:
    spheres = np.load(Path(__file__).parent / "data" / "heap.npz")["spheres"] * 1e-6
    return Heap(spheres[:, :3], spheres[:, 3], np.repeat(np.arange(len(spheres) // 9), 9))


@pytest.fixture(scope="session")
def angle(heap: Heap) -> HeapAngle:
    return heap_angle(heap.centers, heap.radii, azimuths=2)
