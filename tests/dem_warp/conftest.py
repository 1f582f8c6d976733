"""Path of the engine tests, so that they can import `worlds`, and the heap that several of them look at."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from worlds import small_case

from dem_warp import CaseResult, simulate


@pytest.fixture(scope="session")
def heap() -> CaseResult:
    """Simulate the small case by itself in this process."""
    return simulate([small_case()], device="cpu", workers=1)[0]
