"""The request of a run: everything that a person says of it, apart from its study."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, TypedDict

if TYPE_CHECKING:
    from dem_warp.result import OnProgress

Watch = Callable[[str], AbstractContextManager["OnProgress | None"]]
"""Opens the display of one batch of cases, by its title; the block's value is called with the progress."""


class AwaitingRuns(Exception):  # noqa: N818  (nothing is wrong)
    """A campaign waits for runs that a person does; its text says where."""


class RunOptions(TypedDict, total=False):
    """Keywords of `experiments.api` that every run accepts: the fields of `RunRequest`."""

    scale: str | None
    device: str | None
    workers: int | None
    scheduler: str | None
    cluster: str | Path | None
    engine: str | None
    resume: bool
    watch: Watch


@dataclass(frozen=True, kw_only=True)
class RunRequest:
    """Place and means of a run, as a person asks for them."""

    out: str | Path | None = None
    """Folder of the results, new or empty; None: ``out/NAME-SCALE``."""
    scale: str | None = None
    """Scale of the study's file; None: the one for the device, ``paper`` on a GPU and ``bench`` without."""
    device: str | None = None
    """``"cpu"``, ``"cuda"``, ``"cuda:1"``, or several GPUs with commas; None: the GPU if there is one."""
    workers: int | None = None
    """Processes on the CPU, GPUs, or workers of a cluster; None: one a core, one GPU, the cluster's own."""
    scheduler: str | None = None
    """Address of a Dask scheduler whose workers simulate."""
    cluster: str | Path | None = None
    """File with a ``[cluster]``, whose workers are started; None: the study's own, if it has one."""
    engine: str | None = None
    """Name of an engine (`experiments.cases.ENGINES`); None: the study's own."""
    resume: bool = False
    """Continue the run of the folder: no finished case is simulated again."""
    watch: Watch = lambda title: nullcontext()
    """Opens the display of a batch."""
    made: float = field(default_factory=time.perf_counter, compare=False)
    """Time at which it was made, on the clock of `time.perf_counter` [s]."""
