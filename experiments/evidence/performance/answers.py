"""Time until a wrong study file is answered: `python -m experiments.evidence.performance.answers out/answers`."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Annotated

import pandas as pd
import typer

from experiments.evidence.machine import machine
from experiments.evidence.performance.results import write_results
from experiments.studyfile import write_template

WRONG: dict[str, tuple[str, str]] = {
    "no TOML": ("[wall]", "[wall"),
    "an unknown key": ("size_sd = 0.05", "size_sdd = 0.05"),
    "a wrong unit": ('density = "700 kg/m^3"', 'density = "700 mm"'),
    "a range reversed": ("low = 0.3\nhigh = 0.6", "low = 0.6\nhigh = 0.3"),
    "a clump file that is not there": ('sphere = "2 mm"', 'clump = "none.txt"'),
    "a clump that is none": ('sphere = "2 mm"', 'clump = "words.txt"'),
    "a factor that leads nowhere": (
        'parameter = "contact.grain-grain.static_friction"',
        'parameter = "contact.grain-grain.stickiness"',
    ),
    "laws that are none": ('laws = "relative"', 'laws = "liggghtz"'),
    "an engine that is none": ("[numerics]", '[engine]\nname = "nobody"\n\n[numerics]'),
    "a file of measurements without its columns": (
        'mean = "30 deg"\nsd = "0.5 deg"\nn = 5',
        'file = "words.txt"',
    ),
    "a decision on no factor": ("at_most = 3", 'at_most = 3\nkeep = ["Z"]'),
    "more grains than a case can have": ("# grain_count = 400 ", "grain_count = 1_000_000_000 "),
    "a tube that too many grains fill": ('height = "110 mm"', 'height = "10000 m"'),
    "a tube narrower than two grains": ('diameter = "35 mm"', 'diameter = "7 mm"'),
}
"""Mistakes of a study: the template's text, and what stands there instead."""


def wrong_study(folder: Path, kind: str) -> Path:
    """Write the template's study, wrong in one way.

    Raises
    ------
    ValueError
        When the template has not this text once.
    """
    path = folder / "study.toml"
    path.unlink(missing_ok=True)
    write_template("study", folder)
    (folder / "words.txt").write_text("no numbers here\n", encoding="utf-8")
    text = path.read_text(encoding="utf-8")
    old, new = WRONG[kind]
    if text.count(old) != 1:
        raise ValueError(f"{kind}: the template must hold {old!r} once, has it {text.count(old)} times")
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


def processor_time(words: list[str], folder: Path) -> tuple[float, int, str]:
    """Processor time of a command, user and system [s], its exit code, and what it says first."""
    order = [sys.executable, "-c", "from experiments.cli import main; main()", *words]
    # a shell that forbids byte code would let each run compile the sources anew
    surroundings = {name: text for name, text in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    before = os.times()
    done = subprocess.run(order, cwd=folder, env=surroundings, capture_output=True, text=True, check=False)
    after = os.times()
    seconds = after.children_user + after.children_system - before.children_user - before.children_system
    return seconds, done.returncode, (done.stderr or done.stdout).strip().partition("\n")[0]


def main(
    out: Annotated[Path, typer.Argument(help="Folder of the results.")],
    repeats: Annotated[int, typer.Option(min=1, help="Runs of each; the least time counts.")] = 5,
) -> None:
    """Measure wrong studies, `--help` and `new`; write answers.md and answers.csv."""
    rows = []
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for kind in [*WRONG, "--help", "new"]:
            if kind in WRONG:
                words = ["calibrate", wrong_study(folder, kind).name, "--out", "out"]
            else:
                words = ["--help"] if kind == "--help" else ["new", "fresh.toml"]
            runs = []
            for _ in range(repeats):
                (folder / "fresh.toml").unlink(missing_ok=True)
                runs.append(processor_time(words, folder))
            _, code, said = runs[0]
            rows.append(
                {"study": kind, "CPU s": min(run[0] for run in runs), "exit code": code, "says": said}
            )
            print(rows[-1], flush=True)
    head = f"# Answers\n\n{machine('cpu')}. Least of {repeats} runs."
    write_results(out, "answers", [("answers", head, pd.DataFrame(rows))])


if __name__ == "__main__":
    typer.run(main)
