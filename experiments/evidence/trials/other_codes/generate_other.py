"""Draw, seal and measure trials whose heaps another code, LIGGGHTS, makes.

    python -m experiments.evidence.trials.other_codes.generate_other seal out/liggghts
    python -m experiments.evidence.trials.other_codes.generate_other measure out/liggghts --seconds 3000

Folders are those of `experiments.evidence.trials.generate_trials`. An equal part of every class of trials is
measured first, so that a record of some of them is balanced. After ``--seconds`` no trial is begun; the same
command continues.
"""

import json
import math
import secrets
import time
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from experiments.cases import Resources, Workers, open_workers
from experiments.cases.store.outcome_table import OutcomeTable
from experiments.commands.console import clear_errors
from experiments.discover.mechanism_files import LONG_LEVER
from experiments.discover.search import Search
from experiments.evidence.trials.declaration import Declaration, read_declaration
from experiments.evidence.trials.generate_trials import STUDY, bank_beside, seal_trials
from experiments.evidence.trials.other_codes.code_effects import DECLARED, OUTSIDE, UNSEEN
from experiments.evidence.trials.other_codes.code_process import Liggghts
from experiments.evidence.trials.other_codes.code_simulator import OtherCodeSimulator, workshop_study
from experiments.evidence.trials.other_codes.making import LAWS, MADE
from experiments.evidence.trials.other_codes.setting import Setting
from experiments.evidence.trials.run_trials import UNFINISHED
from experiments.evidence.trials.trial_heaps import CLOGGED, cases_of, write_heaps
from experiments.evidence.trials.trials_folder import REALITY, Folder, noted_run
from experiments.evidence.trials.truth import Kind, Label, read_labels, read_sealed, revealed
from experiments.evidence.trials.truths import Plan
from experiments.io.errors import InputError
from experiments.io.files import write_text
from experiments.io.toml_files import read_toml
from experiments.studyfile import load_study

PLAN = Plan(nulls=60, strong=13, weak=0, unresolved=6, withheld=0, outside=9, pairs=40, replicates=10)
"""Numbers of trials, where no other plan is given; mechanisms are those that the code can make."""

SCALE = "relative"
"""Scale whose laws resist rolling as LIGGGHTS does."""

MISSING = 0.1
"""Largest part of a trial's heaps that may fail; a clogged tube is none of them."""

app = typer.Typer(help="Draw, seal and measure blind trials whose heaps another code makes.")


def plan_for(plan: Plan) -> Plan:
    """Plan whose mechanisms LIGGGHTS can make: all of them, where it names none."""
    if strange := sorted(set(plan.mechanisms) - set(MADE)):
        raise InputError("Plan.mechanisms", f"liggghts makes only {', '.join(MADE)}", strange)
    return replace(plan, mechanisms=plan.mechanisms or tuple(MADE))


def write_reality(path: Path) -> None:
    """Write down which code makes the heaps, and how it makes each effect."""
    reality = {
        "code": Liggghts.program,
        "name": Liggghts.name,
        "laws": LAWS,
        "library": dict(MADE),
        "outside": {name: each.sentence for name, each in OUTSIDE.items() if name not in UNSEEN},
    }
    write_text(path, json.dumps(reality, indent=1) + "\n")


def in_turn(labels: Sequence[Label]) -> list[Label]:
    """Labels in the order in which they are measured: at every moment an equal part of each class.

    A class is what hides nothing, what hides one effect of a name, or two.
    """
    classes: dict[tuple[str, ...], list[Label]] = defaultdict(list)
    for label in sorted(labels, key=lambda label: label.trial):
        names = () if label.kind is Kind.PAIR else label.mechanisms
        classes[label.kind.value, *names].append(label)
    placed = [
        ((number + 0.5) / len(members), name, label)
        for name, members in classes.items()
        for number, label in enumerate(members)
    ]
    return [label for _, _, label in sorted(placed, key=lambda one: one[:2])]


def measure_in_time(
    folder: Folder, labels: Sequence[Label], declaration: Declaration, workers: Workers, deadline: float
) -> int:
    """Measure trials one after the other until a deadline of ``time.monotonic``; count what is left.

    A trial of which too many heaps fail is reported and left, to be tried again.
    """
    study = workshop_study(declaration.scale)
    conditions = [condition.name for condition in study.conditions]
    table = OutcomeTable(folder.hidden / "outcomes.sqlite")
    waiting = [label for label in in_turn(labels) if not folder.measured(label.trial).exists()]
    refused = 0
    for done, label in enumerate(waiting):
        if time.monotonic() > deadline:
            return len(waiting) - done + refused
        setting = Setting.drawn(label.seed)
        with (
            OtherCodeSimulator(study, setting, table, workers) as simulator,
            noted_run(folder, f"heaps, {Liggghts.name}", "cpu", table),
        ):
            wave = cases_of(label, conditions, declaration.plan.replicates)
            outcomes = simulator(wave)
        failed = sum(bool(reason) and CLOGGED not in reason for reason in outcomes.reasons)
        if failed > MISSING * len(wave):
            problem = f"{failed} of {len(wave)} heaps failed: {max(outcomes.reasons)}"
            print(f"{label.trial} not measured: {problem}", flush=True)
            refused += 1
            continue
        # another laboratory's clock and balance: the analysis allows for what is usual
        write_heaps(
            folder.measured(label.trial), label, wave, outcomes, simulator.observables, calibrated=False
        )
        lacking = f", {failed} of {len(wave)} heaps failed" if failed else ""
        print(f"{label.trial} measured{lacking}; {len(waiting) - done - 1} left", flush=True)
    return refused


@app.command()
def seal(
    folder: Annotated[Path, typer.Argument(help="Folder of the trials.")],
    bank: Annotated[Path | None, typer.Option(help="Bank of the trial study; left out: its own.")] = None,
    scale: Annotated[str, typer.Option(help="Scale of the trial study.")] = SCALE,
    plan: Annotated[Path | None, typer.Option(help="TOML file with numbers of trials.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the drawing; left out: a secret one.")] = None,
) -> None:
    """Draw the truths; write their seals, to be published, and their labels, to be kept."""
    with clear_errors():
        numbers = plan_for(Plan(**read_toml(plan)[1]) if plan else PLAN)
        place, search = Folder(folder), Search.of(load_study(STUDY, scale or None))
        if search.study.solver.laws.rolling in LONG_LEVER:
            raise InputError("--scale", "must resist rolling with the lever R*, as LIGGGHTS does", scale)
        waves = search.read_bank(bank or bank_beside(scale))
        drawn = secrets.randbits(63) if seed is None else seed
        seal_trials(
            place, search, waves, numbers, drawn, [each for each in DECLARED if each.name not in UNSEEN]
        )
        write_reality(place.record / REALITY)
        print(f"{len(read_sealed(place.sealed))} trials sealed: {place.sealed}")


@app.command()
def measure(
    folder: Annotated[Path, typer.Argument(help="Folder of the trials.")],
    workers: Annotated[int | None, typer.Option(help="Heaps at once; left out: one a core.")] = None,
    seconds: Annotated[float, typer.Option(help="Begin no trial after this time.")] = math.inf,
) -> None:
    """Let the code make the heaps of the trials, and measure them."""
    deadline = time.monotonic() + seconds
    with clear_errors("Resume with the same command."):
        place = Folder(folder)
        declaration = read_declaration(place.declared)
        if not place.hidden_labels.is_file():
            rule = "needs the labels of the sealed trials; where they are lost, seal new ones"
            raise InputError(str(place.hidden_labels), rule, "no such file")
        labels = list(revealed(read_labels(place.hidden_labels), read_sealed(place.sealed)).values())
        with open_workers(Resources("cpu", workers)) as simulators:
            left = measure_in_time(place, labels, declaration, simulators, deadline)
    if left:
        print(f"{left} trials have not been measured: run it again")
        raise typer.Exit(UNFINISHED)


if __name__ == "__main__":
    app()
