"""The version that a run reports, also in a tree that is not installed."""

import tomllib
from importlib import metadata
from pathlib import Path
from runpy import run_path
from unittest.mock import Mock

import pytest

from dem_warp import version as dem_warp_version
from experiments.io import program_version as version
from experiments.io.program_version import program_version, with_version

ROOT = Path(__file__).resolve().parents[3]
STATED = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]


def test_a_tree_without_metadata_reports_its_own_version(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(metadata, "version", Mock(side_effect=metadata.PackageNotFoundError))
    assert run_path(dem_warp_version.__file__)["__version__"] == "0+unknown"
    assert program_version.__wrapped__() == STATED


@pytest.mark.parametrize("project", [None, "[project]\nname = 'another'\nversion = '9'\n", "no TOML", ""])
def test_without_a_tree_the_version_is_that_of_the_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, project: str | None
) -> None:
    if project is not None:
        (tmp_path / "pyproject.toml").write_text(project, encoding="utf-8")
    monkeypatch.setattr(version, "ROOT", tmp_path)
    monkeypatch.setattr(version.dem_warp, "__version__", "7.8.9", raising=False)
    monkeypatch.setattr(version, "program_version", program_version.__wrapped__)
    assert version.program_version() == "7.8.9"
    assert with_version({"dem-warp": "0+unknown", "commit": "abc"}) == {"dem-warp": "7.8.9", "commit": "abc"}
