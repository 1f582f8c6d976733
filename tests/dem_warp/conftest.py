"""Path of the engine tests, so that they can import `worlds`, and the heap that several of them look at."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from worlds import small_case

from dem_warp import CaseResult, simulate, solver
from dem_warp.kernels.candidates import candidate_kernels


@pytest.fixture(scope="module", autouse=True)
def _one_search() -> Iterator[None]:
    """Compile the search for partners once, not for each law: `test_neighbours` shows that it is the same."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(solver, "candidate_kernels", lambda build: candidate_kernels(build.without_forces))
        yield


@pytest.fixture(scope="session")
def heap() -> CaseResult:
    """Simulate the small case by itself in this process."""
    return simulate([small_case()], device="cpu", workers=1)[0]
