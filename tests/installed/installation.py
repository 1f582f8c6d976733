"""Packages as a user has them: built, installed in a folder, run without the tree."""

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

COMMIT = "0123456789ab"
"""Commit that the built tree says it comes from."""


@dataclass(frozen=True)
class Installed:
    """Folders that packages are installed in, and the one that programs run in."""

    sites: tuple[Path, ...]
    work: Path

    def python(self, *arguments: object) -> str:
        """Run Python with these packages before those of the environment; return its output."""
        paths = os.pathsep.join(map(str, self.sites))
        return _output([sys.executable, *arguments], cwd=self.work, env=os.environ | {"PYTHONPATH": paths})

    def dem_warp(self, *arguments: object) -> str:
        """Run the command line; return its output."""
        return self.python("-c", "from experiments.cli import main; main()", *arguments)


def pip(*arguments: object) -> None:
    """Run pip without the network and without other packages; Python compiles what it imports."""
    environment = os.environ | {"PIP_COMPILE": "no"}
    words = [sys.executable, "-m", "pip", *arguments, "--no-deps", "--quiet", "--disable-pip-version-check"]
    _output(words, env=environment)


def build(project: Path, names: Sequence[str], folder: Path) -> Path:
    """Build the wheel of a copy of a project, so that the build leaves nothing in the tree."""
    source = folder / "source"
    source.mkdir()
    for name in names:
        if (project / name).is_dir():
            shutil.copytree(project / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(project / name, source)
    if (source / "dem_warp").is_dir():  # as in an archive of sources
        (source / "dem_warp" / "commit.txt").write_text(COMMIT, encoding="utf-8")
    pip("wheel", source, "--no-build-isolation", "--wheel-dir", folder)
    (wheel,) = folder.glob("*.whl")
    return wheel


def _output(command: Sequence[object], **settings: object) -> str:
    done = subprocess.run(
        [str(word) for word in command], capture_output=True, text=True, check=False, **settings
    )
    assert done.returncode == 0, done.stderr
    return done.stdout
