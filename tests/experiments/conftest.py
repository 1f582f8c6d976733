"""Studies, results and helpers (`commandline`, `drawn_heaps`) that the tests of `experiments` share."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from dem_warp import CaseResult
from dem_warp.clump_fitting import fit_clump
from experiments.cases import execute
from experiments.cases.forecast import speed
from experiments.report import solid
from experiments.studyfile import Study, load_study

if TYPE_CHECKING:
    from playwright.sync_api import Browser

ARGUMENTS = (
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-gpu-compositing",
)
"""A container has no user of its own; WebGL without a GPU, the rest of a page is drawn without it."""

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "imaging")]


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out tests of a program or library that is not installed: they do not count as skipped."""
    finders = {"program": shutil.which, "library": find_spec}
    missing = [
        item
        for item in items
        if any(
            find(mark.args[0]) is None for kind, find in finders.items() for mark in item.iter_markers(kind)
        )
    ]
    if missing:
        config.hook.pytest_deselected(items=missing)
        items[:] = [item for item in items if item not in missing]


@pytest.fixture(scope="session", autouse=True)
def _small_pictures() -> Iterator[None]:
    """Draw heaps to be turned at a fifth of their width, and measure in a thread; a test of each does not."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(solid, "PIXELS", solid.PIXELS // 5)
        patch.setattr(execute, "measuring_processes", lambda *_: ThreadPoolExecutor(1))
        yield


@pytest.fixture(scope="session", autouse=True)
def _own_notes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Note the speed of batches in a folder of the tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(speed, "NOTES", str(tmp_path_factory.mktemp("notes") / "batches.json"))
        yield


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    """Start the installed Chromium."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=[*ARGUMENTS])
        yield browser
        browser.close()


@pytest.fixture
def _coarse_clumps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fit clumps with half the samples along a side, an eighth in all, where more would show no more."""
    coarse = partial(fit_clump, resolution=20)
    monkeypatch.setattr("experiments.grains.clumps.clump_search.fit_clump", coarse)


SMALL_STUDY = Path(__file__).with_name("small.toml").read_text(encoding="utf-8")


@pytest.fixture(scope="session")
def small_text() -> str:
    """Text of the small study."""
    return SMALL_STUDY


@pytest.fixture
def write_study(tmp_path: Path) -> Callable[..., Path]:
    """Write the small study, some of its text replaced and some added."""

    def write(*replacements: tuple[str, str], add: str = "") -> Path:
        text = SMALL_STUDY
        for old, new in replacements:
            assert text.count(old) == 1, old
            text = text.replace(old, new)
        path = tmp_path / "small.toml"
        path.write_text(text + add, encoding="utf-8")
        return path

    return write


@pytest.fixture
def small_study(write_study: Callable[..., Path]) -> Study:
    """Return the small study: spheres, one factor."""
    return load_study(write_study())


@pytest.fixture
def cone() -> Callable[..., CaseResult]:
    """Build the result of a case that ended in a cone of spheres with a given slope."""

    def build(
        slope: float = 0.5, status: str = "finished", reason: str = "", radius: float = 1e-3
    ) -> CaseResult:
        from cone_engine import cone_of

        phases = [{"name": "fill", "time": 0.1, "steps": 1000}]
        return cone_of(slope, radius, status=status, reason=reason, phases=phases)

    return build
