"""``[cluster]``: workers that are started for a run, in a study or in a profile of its own."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, field_validator

from experiments.io.toml_files import read_toml
from experiments.studyfile.places import Places
from experiments.studyfile.schema import Section, Time, validated

_MEMORY = re.compile(r"\d+(\.\d+)? ?[kMGT]i?B")
_LINE = re.compile(r"[^\n\r\0]*")


class ClusterSection(Section):
    """``[cluster]``: workers of Dask, on this machine or as jobs of a scheduler; on GPUs, or one a core."""

    kind: Literal["local", "slurm", "pbs", "lsf", "sge", "oar", "htcondor"] = "local"
    """Place where they run: processes of this machine, or jobs of a scheduler."""
    workers: int | None = Field(default=None, ge=1)
    """Workers in all, which fill whole jobs, or GPUs of this machine. Default: here all GPUs or one a core,
    of a scheduler those of a job."""
    gpu: bool | None = None
    """Each worker has a GPU. Default: on this machine where there is one, in jobs not."""
    workers_per_job: int = Field(default=1, ge=1)
    """Workers of a job."""
    cores: int = Field(default=1, ge=1)
    """Cores of a worker that a job asks for; a worker on a CPU uses one, one with a GPU about two."""
    memory: str = "4 GB"
    """Memory of a worker that a job asks for."""
    walltime: Annotated[Time, Field(ge=60.0)] = 14400.0
    """Time limit of a job; one that reaches it is submitted again while there is work."""
    queue: str | None = None
    """Queue or partition."""
    account: str | None = None
    """Account that is charged."""
    directives: tuple[str, ...] = ()
    """Further options of the scheduler, a line of the job's head each, e.g. "--constraint=h200"."""
    prologue: tuple[str, ...] = ()
    """Shell commands of a job before its worker starts, e.g. "module load cuda"."""
    python: str | None = None
    """Python that has dem-warp on the nodes. Default: the one that runs this."""
    interface: str | None = None
    """Network interface that nodes reach each other by, e.g. "ib0"."""
    shared: str = "~/.dem-warp"
    """Folder that all nodes see, for what jobs print and for the certificates of this run's connections."""

    @field_validator("memory")
    @classmethod
    def _is_a_size(cls, memory: str) -> str:
        if not _MEMORY.fullmatch(memory):
            raise ValueError('must be a size with its unit, e.g. "4 GB"')
        return memory

    @field_validator("queue", "account", "python", "interface", "shared")
    @classmethod
    def _is_a_line(cls, text: str | None) -> str | None:
        if text is not None and not _LINE.fullmatch(text):
            raise ValueError(f"must be one line, got {text!r}")
        return text

    @field_validator("directives", "prologue")
    @classmethod
    def _are_lines(cls, lines: tuple[str, ...]) -> tuple[str, ...]:
        if broken := [line for line in lines if not _LINE.fullmatch(line)]:
            raise ValueError(f"must be one line each, got {broken[0]!r}")
        return lines


class Profile(Section):
    """A file with a ``[cluster]`` and nothing else."""

    cluster: ClusterSection
    """The cluster."""


def read_profile(path: Path) -> ClusterSection:
    """Read a profile: a TOML file whose one section is ``[cluster]``."""
    text, document = read_toml(path)
    return validated(Profile, document, Places.read(path, text)).cluster
