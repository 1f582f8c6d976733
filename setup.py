"""Writes the commit of a build into wheels and source archives; all else is in pyproject.toml."""

import runpy
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist

VERSION = runpy.run_path("dem_warp/version.py")


def _note_commit(folder: str) -> None:
    Path(folder, "dem_warp", VERSION["COMMIT_FILE"]).write_text(VERSION["source_commit"]() + "\n", "utf-8")


class BuildWithCommit(build_py):
    def run(self) -> None:
        super().run()
        if not self.editable_mode:
            _note_commit(self.build_lib)


class ArchiveWithCommit(sdist):
    def make_release_tree(self, base_dir: str, files: list[str]) -> None:
        super().make_release_tree(base_dir, files)
        _note_commit(base_dir)


setup(cmdclass={"build_py": BuildWithCommit, "sdist": ArchiveWithCommit})
