"""The next experiment, on fresh heaps of the engine: how often what the search proposes settles a tie.

    python -m experiments.evidence.trials.generate_trials bank out/bank.npz --scale small --device cuda
    python -m experiments.evidence.trials.tie_trials out/ties --bank out/bank.npz --device cuda

Each twin has one of three hidden effects that look alike. The engine makes its heaps with the time step and
the camera of the generator; the search has fresh runs. Where it ends in a tie, the heaps that it proposes are
made with other seeds. One camera reads all heaps again, and they are searched as those of a new trial; those
without an effect by themselves. What has ended is kept in the folder: the same command goes on.
"""

import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
import typer

from doe.discrepancy import Point, SearchSpace, Verdict
from experiments.cases import Resources, open_workers
from experiments.cases.store.outcome_table import OutcomeTable
from experiments.discover.engine_simulator import EngineSimulator
from experiments.discover.mechanism_files import library_for
from experiments.discover.search import Search
from experiments.evidence.record_page import markdown_table
from experiments.evidence.trials.analyses import analysis_name, run_together
from experiments.evidence.trials.declaration import Declaration, read_declaration
from experiments.evidence.trials.findings import EVERYTHING, read_findings
from experiments.evidence.trials.generate_trials import STUDY, generators_study
from experiments.evidence.trials.run_trials import run_trials
from experiments.evidence.trials.trial_heaps import cases_of, write_heaps
from experiments.evidence.trials.trials_folder import Folder, noted_run
from experiments.evidence.trials.truth import Kind, Label, Sealed
from experiments.evidence.trials.truths import Plan
from experiments.studyfile import load_study

HIDDEN, SIZES = ("contact_adhesion", "liquid_bridges", "rolling_torque"), (0.1, 0.5)
"""Effects that tie with one another, and coded sizes at which they do."""
REPLICATES, MORE = 10, "-more"
"""Heaps a condition, before more are proposed, and the end of the name of a twin that has these."""
OUTCOMES = ("the truth", "a tie", "unknown", "nothing", "a wrong name")
"""Answers, the best first."""


def twin(number: int, space: SearchSpace) -> Label:
    """Draw the truth of a twin."""
    rng, hidden = np.random.default_rng([number, 6]), HIDDEN[number % len(HIDDEN)]
    theta = tuple(rng.uniform(space.lower, space.upper).tolist())
    size, seed = space.natural_size(hidden, rng.uniform(*SIZES)), int(rng.integers(2**31))
    return Label(f"twin-{number:03d}", Kind.SINGLE, theta, ((hidden, size),), (), seed, "")


def proposal(folder: Folder, trial: str) -> dict[str, Any] | None:
    """Return the next experiment that the search of a twin proposes, if it ended in a tie."""
    path = folder.discovery(analysis_name(trial, EVERYTHING))
    found = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    return found["next_experiment"] if found.get("verdict") == Verdict.TIE else None


def proposed(label: Label, points: list[Point], step: Mapping[str, Any]) -> tuple[Label, list[Point]]:
    """Return the heaps of the next experiment: with the first ones, or by themselves where an effect goes."""
    sizes = tuple(pair for pair in label.sizes if pair[0] != step["without"])
    other = replace(label, seed=label.seed + 1, sizes=sizes)
    more = cases_of(other, step["conditions"], step["replicates"])
    return (other, more) if step["without"] else (label, [*points, *more])


def outcome(found: Mapping[str, Any], hidden: str, without: str = "") -> str:
    """Classify a finding, of heaps with all effects or without one of them."""
    if without:  # nothing is missing then if it was that one
        return OUTCOMES[0 if (found["verdict"] == Verdict.NONE) == (hidden == without) else -1]
    if found["verdict"] == Verdict.NAMED:
        return "the truth" if found["named"] == hidden else "a wrong name"
    return {"tie": "a tie", "unknown": "unknown", "none": "nothing"}.get(found["verdict"], found["verdict"])


def answered(
    folder: Folder, what: str, waves: Mapping[str, tuple[Label, list[Point]]], bank: Path, device: str | None
) -> None:
    """Make the heaps of some trials, and search them in step."""
    study = generators_study(read_declaration(folder.declared).scale)
    table = OutcomeTable(folder.hidden / "outcomes.sqlite")
    with (
        open_workers(Resources(device)) as workers,
        EngineSimulator(study, library_for(study), table, workers) as engine,
        noted_run(folder, f"heaps, {what}", device, table),
    ):
        made = run_together([points for _, points in waves.values()], engine)
        for (trial, (label, points)), outcomes in zip(waves.items(), made, strict=True):
            write_heaps(folder.measured(trial), label, points, outcomes, engine.observables)
    run_trials(folder, [Sealed(trial, what, (), "") for trial in waves], (EVERYTHING,), bank, device)


def answers(folder: Folder, labels: Sequence[Label]) -> pd.DataFrame:
    """Tabulate the twins: what is hidden, the first answer, what is proposed, and the answer after it."""
    found = read_findings([folder.findings]).set_index("trial")
    rows = []
    for label in labels:
        (hidden, size), first = label.sizes[0], found.loc[label.trial]
        row: dict[str, Any] = {"twin": label.trial, "hidden": hidden, "size": size}
        row |= {"first": outcome(first, hidden), "named": first["named"], "chance": np.nan}
        if step := proposal(folder, label.trial):
            last = found.loc[label.trial + MORE]
            row |= {"condition": " ".join(step["conditions"]), "chance": step["chance"]}
            row |= {"heaps": step["replicates"] * len(step["conditions"]), "without": step["without"]}
            row |= {"after": outcome(last, hidden, step["without"]), "named after": last["named"]}
        rows.append(row)
    return pd.DataFrame(rows)


def compared(table: pd.DataFrame) -> pd.DataFrame:
    """Compare the answers after the proposed heaps with the stated chance, by effect and by that chance."""
    ties = table[table["chance"].notna()]
    parts = {"all": ties, **{name: ties[ties["hidden"] == name] for name in HIDDEN}}
    parts |= {"stated 80 % or more": ties[ties["chance"] >= 0.8], "stated less": ties[ties["chance"] < 0.8]}
    rows = []
    for words, part in parts.items():
        if part.empty:
            continue
        right = 100.0 * (part["after"] == OUTCOMES[0])
        tied = [hidden in named.split() for hidden, named in zip(part["hidden"], part["named"], strict=True)]
        row = {"ties": words, "number": len(part), "truth in the tie": sum(tied)}
        row |= {"heaps, mean": round(part["heaps"].mean()), "stated, %": round(100 * part["chance"].mean())}
        row["the truth alone, % (se)"] = f"{right.mean():.0f} ({right.sem():.1f})"
        rows.append(row | {one: int((part["after"] == one).sum()) for one in OUTCOMES[1:]})
    return pd.DataFrame(rows)


def main(
    root: Annotated[Path, typer.Argument(help="Folder of the twins; it may be begun.")],
    bank: Annotated[Path, typer.Option(help="Bank of the trial study at that scale.")],
    number: Annotated[int, typer.Option("--count", help="Twins.", min=1)] = 48,
    scale: Annotated[str, typer.Option(help="Scale of the trial study.")] = "small",
    device: Annotated[str | None, typer.Option(help="cpu, or cuda.")] = None,
) -> None:
    """Search twins, make the heaps that are proposed, search again, and print how the ties ended."""
    folder, search = Folder(root), Search.of(load_study(STUDY, scale))
    today, plan = time.strftime("%Y-%m-%d"), Plan(replicates=REPLICATES)
    Declaration(search.study.name, scale, today, plan, search.settings, (), ()).write(folder.declared)
    labels = [twin(one, search.space) for one in range(number)]
    first = {label.trial: (label, cases_of(label, search.space.conditions, REPLICATES)) for label in labels}
    answered(folder, "first", first, bank, device)
    more = {}
    for trial, (label, points) in first.items():
        if step := proposal(folder, trial):
            more[trial + MORE] = proposed(label, points, step)
    answered(folder, "more", more, bank, device)
    table = answers(folder, labels)
    table.to_csv(folder.root / "ties.csv", index=False, lineterminator="\n", float_format="%.4g")
    print(markdown_table(pd.crosstab(table["hidden"], table["first"]).reset_index()))
    print(markdown_table(compared(table)))


if __name__ == "__main__":
    typer.run(main)
