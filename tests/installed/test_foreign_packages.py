"""Packages of others that have the name of one of dem-warp's: recognised, and named with what to do."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from installation import Installed

from experiments.io.own_packages import foreign_packages

START = "from dem_warp_command import main; main()"


def _run(work: Path, *sites: Path) -> tuple[int, str]:
    paths = {"PYTHONPATH": os.pathsep.join(map(str, sites))}
    command = [sys.executable, "-c", START, "doctor"]
    done = subprocess.run(command, cwd=work, env=os.environ | paths, capture_output=True, text=True)
    return done.returncode, " ".join(done.stderr.split())


def test_the_packages_of_this_tree_are_its_own() -> None:
    assert foreign_packages() == []


@pytest.mark.parametrize("name", ["doe", "imaging", "experiments"])
def test_a_package_that_is_found_first_is_named_with_its_folder(
    name: str, installed: Installed, tmp_path: Path
) -> None:
    (tmp_path / "mine" / name).mkdir(parents=True)
    (tmp_path / "mine" / name / "__init__.py").write_text("FACTORS = 2\n", encoding="utf-8")
    code, said = _run(tmp_path, tmp_path / "mine", *installed.sites)
    place = tmp_path / "mine" / name
    assert code == 2
    assert said.startswith(f"Error: package {name}: {place / '__init__.py'} is not dem-warp's")
    assert f"Move or rename {place}" in said or "Uninstall" in said


@pytest.mark.parametrize("name", ["doe", "experiments"])
def test_a_package_that_was_installed_over_ours_is_named(
    name: str, installed: Installed, tmp_path: Path
) -> None:
    site = tmp_path / "site"
    (site / name).mkdir(parents=True)
    for entry in (*installed.sites[0].iterdir(), *(installed.sites[0] / name).iterdir()):
        there = site / entry.relative_to(installed.sites[0])
        if not there.exists():
            there.symlink_to(entry)
    (site / name / "__init__.py").unlink()
    (site / name / "__init__.py").write_text('"""Classical designs."""\n', encoding="utf-8")
    about = site / "classical-0.1.dist-info"
    about.mkdir()
    metadata = "Metadata-Version: 2.1\nName: classical\nVersion: 0.1\n"
    (about / "METADATA").write_text(metadata, encoding="utf-8")
    (about / "top_level.txt").write_text(f"{name}\n", encoding="utf-8")
    code, said = _run(tmp_path, site)
    assert code == 2
    assert "is not dem-warp's but of the package classical. Uninstall classical" in said
    assert "pip install --force-reinstall --no-deps . in the clone" in said
    (site / name / "__init__.py").unlink()  # as pip does when it uninstalls the other package
    code, said = _run(tmp_path, site)
    assert code == 2
    assert f"package {name}: files are missing in" in said


@pytest.mark.parametrize(("file", "moved"), [("doe/__init__.py", "doe"), ("doe.py", "doe.py")])
def test_a_module_next_to_a_script_is_named(
    file: str, moved: str, installed: Installed, tmp_path: Path
) -> None:
    (tmp_path / file).parent.mkdir(exist_ok=True)
    (tmp_path / file).write_text("FACTORS = 2\n", encoding="utf-8")
    (tmp_path / "script.py").write_text("from experiments.api import calibrate\n", encoding="utf-8")
    done = subprocess.run(
        [sys.executable, tmp_path / "script.py"],
        env=os.environ | {"PYTHONPATH": str(installed.sites[0])},
        capture_output=True,
        text=True,
    )
    last = done.stderr.strip().splitlines()[-1]
    assert f"package doe: {tmp_path / file} is not dem-warp's. Move or rename {tmp_path / moved};" in last
    assert "cannot import" not in done.stderr
