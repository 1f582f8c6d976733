"""A column of the benchmarks that the tests of the evidence share."""

import pytest

from dem_warp import LiftedCylinder
from dem_warp.device import resolve_device
from experiments.evidence.performance import columns as scene
from experiments.evidence.performance.columns import Columns


@pytest.fixture(scope="session")
def small_columns(tmp_path_factory: pytest.TempPathFactory) -> Columns:
    """Return the benchmarks' column with sixty grains, simulated and kept."""
    tube = LiftedCylinder(0.020, 0.020, scene.STEEL, rain_rate=300.0, grain_count=60)
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(scene.SCALES, "small", (tube, 400.0))
        return Columns("small", 1, resolve_device("cpu"), tmp_path_factory.mktemp("columns"))
