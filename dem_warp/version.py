"""Version of the package and commit of its source."""

import functools
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

COMMIT_FILE = "commit.txt"
"""File in this folder of a build; `setup.py` writes it."""

try:
    __version__ = version("dem-warp")
except PackageNotFoundError:  # a source tree without installation
    __version__ = "0+unknown"


@functools.cache
def source_commit() -> str:
    """Return the commit of the checkout or of the build, "-dirty" with changes; empty if unknown."""
    here = Path(__file__).parent
    if (here.parent / ".git").exists():
        command = ["git", "describe", "--always", "--dirty", "--abbrev=12", "--exclude=*"]
        try:
            found = subprocess.run(command, cwd=here, capture_output=True, encoding="utf-8", check=True)
            return found.stdout.strip()
        except (OSError, subprocess.CalledProcessError):
            return ""
    built = here / COMMIT_FILE
    return built.read_text(encoding="utf-8").strip() if built.is_file() else ""
