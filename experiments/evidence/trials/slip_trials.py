"""Slips and effects that move one observable, in emulated heaps: how often each is taken for the other.

    python -m experiments.evidence.trials.slip_trials
    python -m experiments.evidence.trials.slip_trials --kind "effect on one" --table out/slips.csv

The emulator of the shipped bench bank, bent by what no polynomial follows, makes the heaps; the search has
the bank. In a twin one thing is wrong in all heaps of all conditions. The answer is what the headline says.
"""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer

from doe.discrepancy import Emulator, Measured, Settings, analyse, drive
from doe.discrepancy.contest.slips import find_slips
from experiments.evidence.record_page import markdown_table
from experiments.evidence.trials.baselines.emulated_world import REPLICATES, emulated_heaps, true_world
from experiments.evidence.trials.baselines.methods.search_method import no_runs
from experiments.studyfile.observables import OBSERVABLES

TABLE = Path(__file__).with_name("record") / "slips.csv"
UNITS, DIGITS = (10.0, 25.4, 60.0, 100.0, 1000.0), (10.0, 0.1, 2.0, 3.0, 0.5)
"""Factors of a wrong unit, or their inverses, and of a wrong digit or of a diameter for a radius."""
LEAST, MOST, UNEVEN = 1.5, 10.0, 0.5
"""Ratios of an effect and of a misreading by no usual factor, or their inverses: log-uniform. An effect's
logarithm differs by up to this share from condition to condition."""
KINDS = ("unit", "digit", "sign", "exchanged columns", "no usual factor", "effect on one")


def distortion(
    kind: str, rng: np.random.Generator, heaps: Measured
) -> tuple[list[int], np.ndarray, list[str]]:
    """Draw the order of the columns, factors (conditions, columns), and the observables that are wrong."""
    order, factor = list(range(len(heaps.observables))), np.ones((len(heaps.conditions), 1))
    if kind == "exchanged columns":
        first, second = rng.choice(len(order), 2, replace=False)
        order[first], order[second] = order[second], order[first]
        return order, factor, [heaps.observables[first], heaps.observables[second]]
    if kind == "unit":
        unit = rng.choice(["m", "s"])
        names = [one.name for one in OBSERVABLES if one.unit == unit and one.name in heaps.observables]
        factor *= rng.choice(UNITS) ** rng.choice([-1.0, 1.0])
    else:
        if kind == "effect on one":
            factor = rng.uniform(1.0 - UNEVEN, 1.0 + UNEVEN, factor.shape)
        names = [str(rng.choice(heaps.observables))]
        if kind in ("digit", "sign"):
            factor *= rng.choice(DIGITS) if kind == "digit" else -1.0
        else:
            factor = np.exp(rng.choice([-1.0, 1.0]) * rng.uniform(np.log(LEAST), np.log(MOST)) * factor)
    return order, np.where(np.isin(heaps.observables, names), factor, 1.0), names


def twin(kind: str, number: int) -> tuple[Measured, list[str]]:
    """Draw heaps in which one thing is wrong, and its observables."""
    truth, settings = true_world()
    rng, space = np.random.default_rng([number, *kind.encode()]), truth.emulator.space
    theta = rng.uniform(space.lower, space.upper).tolist()
    heaps = emulated_heaps(truth, theta, {}, REPLICATES, number, settings.systematic)
    order, factors, names = distortion(kind, rng, heaps)
    by_condition = dict(zip(heaps.conditions, factors, strict=True))
    values = {name: rows[:, order] * by_condition[name] for name, rows in heaps.values.items()}  # noqa: PD011
    kinds = (tuple(one.name for one in OBSERVABLES if one.unit == unit) for unit in ("m", "s"))
    return replace(heaps, values=values, kinds=tuple(kinds)), names


def answer(measured: Measured, names: list[str], emulator: Emulator, settings: Settings) -> str:
    """Return what the headline says of a twin."""
    slips = [one for one in find_slips(measured, emulator, settings) if one.replicate is None]
    if not slips:
        found = drive(analyse(measured, emulator, settings, 1), no_runs(max(emulator.columns) + 1))
        return {"none": "nothing", "unknown": "unknown"}.get(found.verdict, "a name, or a tie")
    there = any(set(names) & set(one.observables) and len(one.conditions) > 1 for one in slips)
    either = any(one.is_open for one in slips)
    return f"{'slip or effect' if either else 'slip'}{'' if there else ' elsewhere'}"


def main(
    kind: Annotated[list[str] | None, typer.Option(help="What is wrong. Default: each.")] = None,
    count: Annotated[int, typer.Option(help="Twins of each kind.", min=1)] = 100,
    table: Annotated[Path, typer.Option(help="Table of the record; it may be begun.")] = TABLE,
) -> None:
    """Draw twins, answer them, and print how often each kind got each answer."""
    truth, settings = true_world()
    done = (
        pd.read_csv(table) if table.is_file() else pd.DataFrame(columns=["kind", "twin", "wrong", "answer"])
    )
    for one in kind or KINDS:
        for number in sorted(set(range(count)) - set(done["twin"][done["kind"] == one])):
            heaps, names = twin(one, number)
            said = answer(heaps, names, truth.emulator, settings)
            done.loc[len(done)] = [one, number, " ".join(names), said]
            done.to_csv(table, index=False, lineterminator="\n")
    print(markdown_table(pd.crosstab(done["kind"], done["answer"]).reset_index()))


if __name__ == "__main__":
    typer.run(main)
