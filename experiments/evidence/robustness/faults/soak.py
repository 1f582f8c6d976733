"""Two hours of campaigns whose processes are killed at random moments, beside processes that last.

    nice -n 19 python -m experiments.evidence.robustness.faults.soak out/soak --minutes 120

Five kinds of processes are killed with SIGKILL: the command itself, one of its workers, the client of a Dask
scheduler, such a scheduler, and its worker. Three processes last: one that runs command after command, and a
scheduler with its worker, whose clients are killed. It needs Linux. The record is written after each
campaign; an interrupted soak goes on where it was.
"""

from __future__ import annotations

import itertools
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from experiments.evidence.robustness.faults.attempt import calibrate, content
from experiments.evidence.robustness.faults.kills import Kill, differing
from experiments.evidence.robustness.faults.lasting import Cluster, Resident, Size
from experiments.evidence.robustness.faults.run import WORDS, load_libraries, undisturbed
from experiments.evidence.robustness.faults.torment import tormented, victims

TABLES = ("kills", "campaigns", "sizes")

UNDISTURBED = "none"
"""Kind of a campaign that is let alone: it tells how long one takes now, and must end as the others."""

GROWN = 0.05
"""Part by which a lasting process may hold more memory in its last quarter than in its second."""

FEWEST = 6
"""Campaigns that a lasting process must have taken part in, to be judged."""

LASTING = {"worker": "one process", UNDISTURBED: "one process", "client": "the lasting cluster"}
"""Processes that last, by the kinds of campaigns that they take part in: words of their names."""


class Soak:
    """Campaigns one after another, and their tables."""

    def __init__(self, out: Path, seed: int) -> None:
        import pandas as pd

        self.out, self._seed, self._work = out, seed, out / "work"
        shutil.rmtree(self._work, ignore_errors=True)
        self._work.mkdir(parents=True)
        self.rows: dict[str, list[dict[str, Any]]] = {
            name: pd.read_csv(path, keep_default_na=False).to_dict("records")
            if (path := out / f"soak-{name}.csv").is_file()
            else []
            for name in TABLES
        }
        earlier = self.rows["campaigns"]
        self._number = len(earlier)
        self._before = float(earlier[-1]["minutes"]) if earlier else 0.0
        self._piece = int(earlier[-1]["piece"]) + 1 if earlier else 1
        self._begun = time.monotonic()
        # Warp is not begun in a process that is forked
        words = "from experiments.evidence.machine import machine; print(machine('cpu'))"
        told = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, check=True)
        self._machine = told.stdout.splitlines()[-1]

    @property
    def minutes(self) -> float:
        """Time of all pieces so far [min]."""
        return self._before + (time.monotonic() - self._begun) / 60.0

    def run(self, minutes: float) -> None:
        """Run campaigns until the time is up; the one that is under way then is let end."""
        if self.minutes >= minutes:
            return
        expected, seconds, _ = undisturbed(self._work)
        rng = random.Random(f"{self._seed}/{self._piece}")
        with ExitStack() as stack:
            resident = Resident()
            stack.callback(resident.end)
            lasting, mortal = (Cluster(f"the {name} cluster", self._work) for name in ("lasting", "mortal"))
            stack.callback(lasting.end)
            stack.callback(mortal.end)
            kinds = victims(resident, lasting, mortal, rng)
            for kind in itertools.cycle((*kinds, *kinds, UNDISTURBED)):
                if self.minutes >= minutes:
                    return
                self._number += 1
                folder, begun = self._work / f"campaign-{self._number}", time.monotonic()
                kills: list[Kill] = []
                if kind == UNDISTURBED:
                    fault = self._undisturbed(folder, resident, expected)
                    seconds = time.monotonic() - begun
                else:
                    kills, fault = tormented(folder, kind, kinds[kind], expected, seconds, rng)
                self._note(kind, kills, fault, time.monotonic() - begun)
                self._measure([*resident.sizes(), *lasting.sizes()])
                self.write()

    def _undisturbed(self, folder: Path, resident: Resident, expected: dict[str, str]) -> str:
        ending = resident.run(calibrate(folder, 2), folder.with_suffix(".txt")).ending()
        fault = f"exit {ending.code}: {ending.said[-300:]}" if ending.code else ""
        fault = fault or differing(expected, content(folder))
        if not fault:
            shutil.rmtree(folder)
        return fault

    def _note(self, kind: str, kills: list[Kill], fault: str, seconds: float) -> None:
        place = {"campaign": self._number, "piece": self._piece, "minutes": round(self.minutes, 2)}
        left = sum(1 for path in Path(os.environ["TMPDIR"]).rglob("*") if path.is_file())
        facts = {"kind": kind, "kills": len(kills), "seconds": round(seconds, 1), "left in TMPDIR": left}
        self.rows["campaigns"].append({**place, **facts, "fault": fault})
        self.rows["kills"] += [{**place, **asdict(kill)} for kill in kills]
        print(self.rows["campaigns"][-1], flush=True)

    def _measure(self, sizes: list[Size]) -> None:
        place = {"campaign": self._number, "piece": self._piece, "minutes": round(self.minutes, 2)}
        self.rows["sizes"] += [{**place, **asdict(size)} for size in sizes]

    def write(self) -> None:
        """Write the tables, and the page `soak.md` beside them."""
        import pandas as pd

        from experiments.io.files import write_text
        from experiments.report.kit.markdown import markdown_table, write_page

        for name, rows in self.rows.items():
            write_text(self.out / f"soak-{name}.csv", pd.DataFrame(rows).to_csv(index=False))
        pieces = len({row["piece"] for row in self.rows["campaigns"]})
        command = f"`python -m experiments.evidence.robustness.faults.soak OUT --seed {self._seed}`"
        head = (
            f"# A soak\n\n{self._machine}, shared with other work, by {command}: {self.minutes:.0f} minutes "
            f"in {pieces} {'piece' if pieces == 1 else 'pieces'}, {self._number} campaigns. {WORDS}"
        )
        write_page(
            self.out / "soak.md",
            head,
            markdown_table(pd.DataFrame(kills_by_kind(self.rows))),
            *self._lasting(),
        )

    def _lasting(self) -> tuple[str, ...]:
        """Part of the page about the processes that last; empty before they can be judged."""
        import pandas as pd

        from experiments.report.kit.markdown import markdown_table

        if not (found := growths(self.rows)):
            return ()
        said = (
            f"Processes that last, after at least {FEWEST} campaigns that they took part in. One has grown "
            f"that holds {100 * GROWN:.0f} % more memory in its last quarter than in its second, or more "
            "open files."
        )
        return said, markdown_table(pd.DataFrame(found))


def kills_by_kind(rows: dict[str, list[dict[str, Any]]]) -> list[dict[str, Any]]:
    """One row a kind of process that is killed."""
    found = []
    for kind in dict.fromkeys(row["kind"] for row in rows["campaigns"]):
        ended = [row for row in rows["campaigns"] if row["kind"] == kind]
        kills = [row for row in rows["kills"] if row["kind"] == kind]
        broken = sum(bool(row["fault"]) for row in (*ended, *kills))
        found.append({"killed": kind, "kills": len(kills), "campaigns": len(ended), "rules broken": broken})
    return found


def growths(rows: dict[str, list[dict[str, Any]]]) -> list[dict[str, Any]]:
    """One row a lasting process: memory and open files in its second quarter and in its last."""
    parts = {row["campaign"]: LASTING.get(row["kind"], "none") for row in rows["campaigns"]}
    sizes = [row for row in rows["sizes"] if parts[row["campaign"]] in row["process"]]
    found = []
    for process, piece, born in dict.fromkeys((row["process"], row["piece"], row["born"]) for row in sizes):
        own = [row for row in sizes if (row["process"], row["born"]) == (process, born)]
        if len(own) < FEWEST:
            continue
        quarter = len(own) // 4
        early, late = own[quarter : 2 * quarter], own[-quarter:]
        memory = [sum(row["megabytes"] for row in some) / quarter for some in (early, late)]
        files = [max(row["files"] for row in some) for some in (early, late)]
        grown = memory[1] > (1.0 + GROWN) * memory[0] or files[1] > files[0]
        found.append(
            {
                "process": process,
                "piece": piece,
                "campaigns": len(own),
                "hours": round((own[-1]["minutes"] - own[0]["minutes"]) / 60.0, 2),
                "MB, second quarter": round(memory[0], 1),
                "MB, last quarter": round(memory[1], 1),
                "open files, second quarter": files[0],
                "open files, last quarter": files[1],
                "grown": "yes" if grown else "no",
            }
        )
    return found


def main(
    out: Annotated[Path, typer.Argument(help="Folder of the results.")],
    minutes: Annotated[float, typer.Option(help="Time of all pieces together.")] = 120.0,
    seed: Annotated[int, typer.Option(help="Seed of the moments.")] = 1,
) -> None:
    """Soak, or go on with a soak: soak.md, and a table of the kills, the campaigns and the sizes."""
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    out = out.resolve()
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    temporary = out / "tmp"
    shutil.rmtree(temporary, ignore_errors=True)
    temporary.mkdir(parents=True)
    os.environ["TMPDIR"] = str(temporary)
    load_libraries()
    soak = Soak(out, seed)
    soak.run(minutes)
    soak.write()
    faults = [row["fault"] for name in ("kills", "campaigns") for row in soak.rows[name] if row["fault"]]
    grown = [row for row in growths(soak.rows) if row["grown"] == "yes"]
    raise typer.Exit(int(bool(faults or grown)))


if __name__ == "__main__":
    typer.run(main)
