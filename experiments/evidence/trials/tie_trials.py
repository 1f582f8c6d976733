"""The next experiment, in emulated ties: how often the proposed condition settles one, next to other choices.

    python -m experiments.evidence.trials.tie_trials
    python -m experiments.evidence.trials.tie_trials --fresh-runs 4 --count 50 --table out/ties-more.csv

The world is `emulated_world`; the search has a bank that is drawn from it, and fresh runs. Where it ends
in a tie, each condition is repeated in turn, or every condition, in as many heaps in all as the search
proposes, and searched again.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from itertools import combinations, count, islice, pairwise
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer

from doe.discrepancy import Discovery, Emulator, Measured, Settings, Verdict, analyse, drive, fit_emulator
from doe.discrepancy.fitting.model_fit import Fitted
from doe.discrepancy.verdict.next_experiment import TIMES
from experiments.evidence.record_page import markdown_table
from experiments.evidence.trials.baselines.emulated_world import (
    REPLICATES,
    emulated_heaps,
    fresh_runs,
    redrawn_bank,
    true_world,
)
from experiments.evidence.trials.baselines.method_tables import paired
from experiments.evidence.trials.baselines.protocol import Problem

TABLE = Path(__file__).with_name("record") / "ties.csv"
BANKS = 4
HIDDEN, SIZES = ("contact_adhesion", "liquid_bridges", "rolling_torque"), (0.1, 0.5)
"""Effects that tie with one another, and coded sizes at which they do."""
OUTCOMES = ("the truth", "a tie", "unknown", "nothing", "a wrong name")
"""Answers after the repetition, the best first."""
SEARCH, RANDOM, EVERY = "the search", "random", "every condition"
CHOICES = (SEARCH, "2604.01231", RANDOM)
Searched = tuple[Problem, Discovery]
FORECASTS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.01)


@cache
def bank_of(number: int) -> Emulator:
    """Fit a bank of the world."""
    return fit_emulator(redrawn_bank(*true_world(), number))


def heaps_of(number: int) -> tuple[Measured, str, float]:
    """Draw all heaps that anyone may measure of a twin; return its effect, too."""
    truth, settings = true_world()
    space, rng = truth.emulator.space, np.random.default_rng([number, 4])
    theta, hidden = rng.uniform(space.lower, space.upper).tolist(), HIDDEN[number % len(HIDDEN)]
    size = space.natural_size(hidden, rng.uniform(*SIZES))
    most = (1 + TIMES[-1] * len(space.conditions)) * REPLICATES
    return emulated_heaps(truth, theta, {hidden: size}, most, number, settings.systematic), hidden, size


def searched(heaps: Measured, number: int, rules: Settings, repeated: str = "", more: int = 0) -> Searched:
    """Search the first heaps of every condition, and more of one, or as many more of all together."""
    share = math.ceil(more / len(heaps.conditions)) * (repeated == EVERY)
    counts = {name: REPLICATES + (more if name == repeated else share) for name in heaps.conditions}
    values = {name: rows[: counts[name]] for name, rows in heaps.values.items()}  # noqa: PD011
    seen = replace(heaps, values=values, reasons={})
    problem = Problem(str(number), bank_of(number % BANKS), seen, rules, number)
    return problem, drive(analyse(seen, problem.emulator, rules, number), fresh_runs)


def contrast(models: Sequence[Fitted], condition: str) -> float:
    """Compute the criterion of arXiv:2604.01231 for a condition.

    It is the mean over pairs of plausible models of the largest squared difference of their predictions, at
    their fits. Where its authors have one observable, there are several here, in deviations of one run.
    """
    sd = np.sqrt(np.diag(models[0].model.run_covariance(models[0].x, condition)))
    means = [one.model.predict(one.x[None], condition)[0] / sd for one in models]
    return float(np.mean([np.max((one - other) ** 2) for one, other in combinations(means, 2)]))


def outcome(found: Discovery, hidden: str) -> str:
    """Classify an answer."""
    if found.verdict is Verdict.NAMED:
        return "the truth" if found.named == (hidden,) else "a wrong name"
    return {Verdict.TIE: "a tie", Verdict.UNKNOWN: "unknown"}.get(found.verdict, "nothing")


def ties(start: int, rules: Settings) -> Iterator[dict[str, object]]:
    """Yield ties from a twin on: the choices of a condition, and the answer after each is repeated."""
    for number in count(start):
        heaps, hidden, size = heaps_of(number)
        problem, found = searched(heaps, number, rules)
        step = found.next_experiment
        if found.verdict is not Verdict.TIE or step is None:
            continue
        models = [problem.fitted((name,)) for name in found.named]
        proposed = step.conditions[0] if len(step.conditions) == 1 else EVERY
        heaps_more = step.replicates * len(step.conditions)
        drawn = str(np.random.default_rng([number, 5]).choice(heaps.conditions))
        farthest = max(heaps.conditions, key=lambda name: contrast(models, name))
        again = {c: searched(heaps, number, rules, c, heaps_more)[1] for c in (*heaps.conditions, EVERY)}
        row = {"twin": number, "hidden": hidden, "size": f"{size:.4g}", "tied": " ".join(found.named)}
        row |= {"heaps": heaps_more, "chance": f"{step.chance:.3f}"}
        row |= dict(zip(CHOICES, (proposed, farthest, drawn), strict=True))
        yield row | {name: outcome(one, hidden) for name, one in again.items()}


def compared(table: pd.DataFrame) -> pd.DataFrame:
    """Compare the choices: the share of ties that each settles, and McNemar's test against the search."""
    after = table.loc[:, RANDOM:].iloc[:, 1:]
    ends = {one: pd.Series([row[row[one]] for _, row in table.iterrows()]) for one in CHOICES}
    ends["best in hindsight"] = after.map(OUTCOMES.index).min(axis=1).map(OUTCOMES.__getitem__)
    ends |= {f"always {name}": after[name] for name in after}
    own, rows = ends[SEARCH] == OUTCOMES[0], []
    for name, end in ends.items():
        right = end == OUTCOMES[0]
        gap = 100.0 * (own.astype(float) - right)
        share = f"{100 * right.mean():.0f} ({100 * right.sem():.1f})"
        rows.append({"condition": name, "the truth alone, % (se)": share})
        rows[-1] |= {one: str((end == one).sum()) for one in OUTCOMES[1:]}
        rows[-1]["the search more, % (se)"] = f"{gap.mean():+.0f} ({gap.sem():.1f})"
        rows[-1]["only the search : only it"] = str(paired(own, right))
    for low, high in pairwise(FORECASTS):
        among = (table["chance"] >= low) & (table["chance"] < high)
        each, mean = own[among], 100 * table["chance"][among].mean()
        share = f"{100 * each.mean():.0f} ({100 * each.sem():.1f})"
        words = f"forecast from {100 * low:.0f} % on, {mean:.0f} on average: {len(each)}"
        rows += [{"condition": words, "the truth alone, % (se)": share}] if len(each) else []
    return pd.DataFrame(rows).fillna("")


def main(
    number: Annotated[int, typer.Option("--count", help="Ties.", min=1)] = 100,
    table: Annotated[Path, typer.Option(help="Table of the record; it may be begun.")] = TABLE,
    runs: Annotated[int, typer.Option("--fresh-runs", help="Multiple of the study's fresh runs.", min=1)] = 1,
) -> None:
    """Draw ties, settle them, and print what each choice of a condition gives."""
    rows = pd.read_csv(table).to_dict("records") if table.is_file() else []
    start, rules = int(rows[-1]["twin"]) + 1 if rows else 0, true_world()[1]
    points = runs * rules.refinement_points
    rules = replace(rules, refinement_points=points, finish_points=2 * points * (runs > 1))
    for row in islice(ties(start, rules), number - len(rows)):
        rows.append({str(name): value for name, value in row.items()})
        pd.DataFrame(rows).to_csv(table, index=False, lineterminator="\n")
    print(markdown_table(compared(pd.read_csv(table))))


if __name__ == "__main__":
    typer.run(main)
