"""The wheel of the tree, and the path of these tests, so that they can import `installation`."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from installation import Installed, build, pip

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("dem_warp", "doe", "imaging", "experiments")
BUILT_FROM = (*PACKAGES, "dem_warp_command.py", "pyproject.toml", "setup.py", "README.md", "LICENSE")


@pytest.fixture(scope="session")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the wheel of this tree."""
    return build(ROOT, BUILT_FROM, tmp_path_factory.mktemp("build"))


@pytest.fixture(scope="session")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """Install the wheel."""
    folder = tmp_path_factory.mktemp("installed")
    pip("install", wheel, "--target", folder / "site")
    (folder / "work").mkdir()
    return Installed((folder / "site",), folder / "work")
