"""The paper's runs simulated again: every run of its Tables 3, 5 and 6 and of its verification.

    python -m experiments.evidence.studies.buckwheat --scale printed --device cuda --out out/paper

Each of the paper's stages is one batch. The page is ``record/README.md`` in the folder; ``--campaign`` also
runs the campaign of the study in the same folder, and the page compares both.
"""

from pathlib import Path
from typing import Annotated, Any

import pandas as pd
import typer

from experiments.calibrate.campaign import Campaign
from experiments.commands.console import clear_errors
from experiments.evidence.studies.buckwheat.records.paper_page import RECORD, write_record
from experiments.evidence.studies.buckwheat.replay.replay import Replay
from experiments.evidence.studies.buckwheat.replay.runs import STAGES, planned_cases
from experiments.report.writer import library_versions
from experiments.runs.calibration import run_campaign
from experiments.runs.choices import check_campaign, prepare
from experiments.runs.request import RunRequest
from experiments.runs.run_folder import Run, open_run


def replay_runs(run: Run, replicates: int) -> Replay:
    """Simulate the paper's runs, each stage as one batch."""
    tables = (run.run_cases(planned_cases(replicates, [stage]), f"paper, {stage}") for stage in STAGES)
    return Replay(pd.concat(tables, ignore_index=True))


def record_runs(run: Run, replay: Replay, campaign: Campaign | None = None) -> Path:
    """Write the page on the paper's runs, and its tables; return the page."""
    with run.publishing() as drafts:
        page = write_record(drafts / RECORD, replay.cases, _provenance(run, replay), campaign)
    return run.folder / page.relative_to(drafts)


def _provenance(run: Run, replay: Replay) -> dict[str, Any]:
    key = replay.cases["case_key"].iloc[0]
    return {
        "scale": run.study.scale,
        "fit": run.study.measurement.fit,
        "commit": run.provenance["commit"],
        "date": run.provenance["date"],
        **(run.store.load(key).provenance if run.store.has(key) else {}),
        "versions": library_versions(),
        "wall_times": run.wall_times,
    }


def main(
    out: Annotated[Path, typer.Option(help="Folder of the runs.")],
    scale: Annotated[
        str | None, typer.Option(help="Scale of the study. Default: that for the device.")
    ] = None,
    device: Annotated[str | None, typer.Option(help="cpu, cuda or cuda:N. Default: the GPU if any.")] = None,
    workers: Annotated[int | None, typer.Option(help="Processes or GPUs. Default: all.")] = None,
    replicates: Annotated[int, typer.Option(min=1, help="Heaps of each run.")] = 3,
    campaign: Annotated[bool, typer.Option("--campaign", help="Run the study's campaign, too.")] = False,
    resume: Annotated[bool, typer.Option("--resume", help="Continue the run of the folder.")] = False,
) -> None:
    """Simulate the paper's runs again and write the page on them."""
    with clear_errors("Resume with --resume."):
        request = RunRequest(out=out, scale=scale, device=device, workers=workers, resume=resume)
        with open_run("calibrate", prepare(None, request, check_campaign)) as run:
            replay = replay_runs(run, replicates)
            own = run_campaign(run) if campaign else None
            print(record_runs(run, replay, own))


if __name__ == "__main__":
    typer.run(main)
