"""Version of the package, and the commit that its source comes from."""

import functools
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

COMMIT_FILE = "commit.txt"
"""File beside this one in whatever is built from a checkout; `setup.py` writes it."""

try:
    __version__ = version("dem-warp")
except PackageNotFoundError:  # a source tree that nobody has installed
    __version__ = "0+unknown"


@functools.cache
def source_commit() -> str:
    """Commit of the checkout or of the build, "-dirty" with changes; empty where it is not known."""
    here = Path(__file__).parent
    if (here.parent / ".git").exists():
        command = ["git", "describe", "--always", "--dirty", "--abbrev=12", "--exclude=*"]
        try:
            told = subprocess.run(command, cwd=here, capture_output=True, encoding="utf-8", check=True)
            return told.stdout.strip()
        except (OSError, subprocess.CalledProcessError):
            return ""
    built = here / COMMIT_FILE
    return built.read_text(encoding="utf-8").strip() if built.is_file() else ""
