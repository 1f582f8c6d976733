"""Jobs of a real SLURM that are requeued while a campaign runs: those of its workers, and that of its client.

    python -m experiments.evidence.robustness.faults.requeue out/requeue --campaigns 4

The client is a job of one core with the script of `docs/howto/cluster.md`, and submits its workers as jobs.
The SLURM is one node on this machine (`experiments.evidence.robustness.cluster.slurm`). It needs Linux, slurm-wlm and
munge.
"""

from __future__ import annotations

import os
import random
import shutil
import signal
import sys
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import typer

from experiments.evidence.robustness.cluster import slurm
from experiments.evidence.robustness.faults.attempt import STUDY, content, finished_cases
from experiments.evidence.robustness.faults.kills import differing, lost
from experiments.evidence.robustness.faults.run import WORDS, load_libraries, undisturbed
from experiments.io.files import write_text

PROFILE = Path(slurm.__file__).with_name("slurm.toml")

CLIENT, WORKER = "client", "dem-warp"
"""Names of the jobs; that of the workers is `experiments.cases.workers.dask_clusters`'s."""

KINDS = ("client job", "worker job", "worker job")

MOST = 4
"""Jobs that are requeued in one campaign."""

PATIENCE = 1800.0
"""Time in which a campaign must end [s]."""

SCRIPT = """\
#!/bin/bash
#SBATCH --requeue --open-mode=append --job-name={client} --output={said} --time=60
run() {{ {python} -c "from experiments.cli import main; main()" "$@"; }}
if [ -f "{out}/study.json" ]
then run calibrate {study} --cluster {profile} --out {out} --resume
else run calibrate {study} --cluster {profile} --out {out}
fi
"""


@dataclass(frozen=True)
class Requeue:
    """A job that was requeued, and what came of it."""

    campaign: int
    kind: str
    after: float
    """Time since the one before, or since the campaign began [s]."""
    kept: int
    """Cases that were finished then."""
    fault: str
    """Rule that the run broke; empty: none."""


class Campaign:
    """A campaign whose client is a job.

    Parameters
    ----------
    environment
        Of SLURM's commands.
    folder
        Folder of the results.
    """

    def __init__(self, environment: dict[str, str], folder: Path) -> None:
        self._environment, self._folder = environment, folder
        self._said, profile = folder.with_suffix(".txt"), folder.with_suffix(".toml")
        shared = folder.with_suffix(".shared")
        write_text(profile, PROFILE.read_text(encoding="utf-8") + f'shared = "{shared}"\n')
        names = {"out": folder, "study": STUDY, "profile": profile, "said": self._said}
        script = folder.with_suffix(".sh")
        write_text(script, SCRIPT.format(client=CLIENT, python=sys.executable, **names))
        self.job = slurm.command(environment, "sbatch", "--parsable", str(script)).strip()

    def facts(self) -> dict[str, str]:
        """Facts that SLURM tells of the client's job."""
        told = slurm.command(self._environment, "scontrol", "show", "job", self.job)
        return dict(word.split("=", 1) for word in told.split() if "=" in word)

    def has_ended(self) -> bool:
        """Tell that the client's job has ended for good."""
        return self.facts().get("JobState") in ("COMPLETED", "FAILED", "CANCELLED", "TIMEOUT", "NODE_FAIL")

    def running(self, name: str) -> list[str]:
        """Jobs of a name that run."""
        words = ("squeue", "--noheader", "--states=R", f"--name={name}", "--format=%i")
        return slurm.command(self._environment, *words).split()

    def requeue(self, kind: str, rng: random.Random) -> bool:
        """Requeue a job of a kind; tell that there was one, and that SLURM took the order."""
        jobs = self.running(CLIENT if kind == "client job" else WORKER)
        if not jobs:
            return False
        job = rng.choice(jobs)
        slurm.command(self._environment, "scontrol", "requeue", job)
        if kind == "client job":
            self._hasten()
        return True

    def _hasten(self) -> None:
        """Let the client's job begin again as soon as it has ended: SLURM waits two minutes otherwise."""
        end = time.monotonic() + PATIENCE
        while self.facts().get("JobState") != "PENDING" and time.monotonic() < end:
            time.sleep(0.2)
        slurm.command(self._environment, "scontrol", "update", f"JobId={self.job}", "StartTime=now")

    def said(self) -> str:
        """Last words of the client."""
        return self._said.read_text(encoding="utf-8", errors="replace")[-600:] if self._said.exists() else ""

    def left_behind(self) -> str:
        """Say which jobs of workers outlast the client by a minute; empty: none."""
        end = time.monotonic() + 60.0
        while jobs := self.running(WORKER):
            if time.monotonic() > end:
                return f"jobs left behind: {' '.join(jobs)}"
            time.sleep(0.5)
        return ""


def requeued(
    number: int,
    campaign: Campaign,
    folder: Path,
    expected: Mapping[str, str],
    seconds: float,
    rng: random.Random,
) -> list[Requeue]:
    """Requeue jobs of a campaign at random moments; the last one bears the faults that the end shows."""
    rows: list[Requeue] = []
    before: dict[str, tuple[int, int]] = {}
    begun = time.monotonic()
    wanted = rng.randint(1, MOST)
    while not campaign.has_ended() and time.monotonic() - begun < PATIENCE:
        if len(rows) == wanted:
            time.sleep(0.5)
            continue
        since, kind = time.monotonic(), rng.choice(KINDS)
        moment = since + rng.uniform(0.0, seconds)
        while not campaign.has_ended():
            if time.monotonic() > moment and campaign.requeue(kind, rng):
                now = finished_cases(folder)
                after = round(time.monotonic() - since, 1)
                rows.append(Requeue(number, kind, after, len(now), lost(before, now)))
                before = now
                break
            time.sleep(0.2)
    facts = campaign.facts()
    fault = lost(before, finished_cases(folder))
    if facts.get("JobState") != "COMPLETED":
        fault = fault or f"{facts.get('JobState')}, exit {facts.get('ExitCode')}: {campaign.said()}"
    fault = fault or differing(expected, content(folder)) or campaign.left_behind()
    if rows and fault and not rows[-1].fault:
        rows[-1] = Requeue(number, rows[-1].kind, rows[-1].after, rows[-1].kept, fault)
    elif fault:
        rows.append(Requeue(number, "none", 0.0, len(before), fault))
    return rows


def main(
    out: Annotated[Path, typer.Argument(help="Folder of the results.")],
    campaigns: Annotated[int, typer.Option(min=1, help="Campaigns, of up to four requeued jobs each.")] = 4,
    seconds: Annotated[float, typer.Option(help="Longest time to the next requeue [s].")] = 30.0,
    seed: Annotated[int, typer.Option(help="Seed of the moments.")] = 1,
) -> None:
    """Requeue jobs of small campaigns, and write what came of it: requeue.md and requeue.csv."""
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    load_libraries()
    out = out.resolve()
    work, rng = out / "work", random.Random(seed)
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    expected, _, _ = undisturbed(work)
    rows: list[Requeue] = []
    with slurm.one_node(work / "node") as environment:
        for number in range(1, campaigns + 1):
            folder = work / f"campaign-{number}"
            campaign = Campaign(environment, folder)
            rows += requeued(number, campaign, folder, expected, seconds, rng)
            print(number, rows[-4:], flush=True)
            write(out, rows, number)
    raise typer.Exit(int(any(row.fault for row in rows)))


def write(out: Path, rows: list[Requeue], campaigns: int) -> None:
    """Write the page and the table."""
    import pandas as pd

    from experiments.evidence.machine import machine
    from experiments.evidence.performance.results import write_results

    head = (
        f"# Requeued jobs\n\n{machine('cpu')}, shared with other work; a SLURM of one node. {campaigns} "
        f"campaigns of 20 cases. {WORDS} No job may be left behind."
    )
    write_results(out, "requeue", [("requeue", head, pd.DataFrame([asdict(row) for row in rows]))])


if __name__ == "__main__":
    typer.run(main)
