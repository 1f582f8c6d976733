"""The paper's simulated runs: every design point that it prints an angle for, to be simulated again."""

from collections.abc import Iterable

import pandas as pd

from experiments.studies.buckwheat import paper

STAGES = {
    "screening": "Table 3, Plackett-Burman screening",
    "climb": "Table 5, steepest climb",
    "composite": "Table 6, central composite design",
    "verification": "verification, at the optimum",
}
"""The paper's stages, in order, and where its angles stand."""

TABLES = {stage: place.partition(",")[0] for stage, place in STAGES.items()}
"""The paper's stages, in order, and the table of each."""

DESIGNS = ("screening", "climb", "composite")
"""Stages whose points differ: the 31 runs that a model is held against."""

OPTIMUM = {"E": 0.482, "F": 0.446}
"""The published optimum, where the verification was simulated."""

FIRST_SEED = 40_000
SEEDS_A_REPLICATE = 1_000
"""Run i, from 0, of replicate r, from 1, has the seed FIRST_SEED + i + (r - 1) SEEDS_A_REPLICATE."""


def published_runs() -> pd.DataFrame:
    """Every simulated run of the paper, a row a run: stage, run (from 1), factors, published (angle [deg]).

    Factors are in natural units, NaN where the stage leaves them at their middle.
    """
    names = [factor.name for factor in paper.factors()]
    tables = []
    for stage, (settings, angles) in _stages().items():
        table = settings.reset_index(drop=True).reindex(columns=names)
        label = {"stage": stage, "run": range(1, len(table) + 1)}
        tables.append(pd.concat([pd.DataFrame(label), table], axis=1).assign(published=list(angles)))
    return pd.concat(tables, ignore_index=True)


def planned_cases(replicates: int, stages: Iterable[str] = tuple(STAGES)) -> pd.DataFrame:
    """Lay out the cases of some stages: every run some times, each case with its own seed.

    A row a case: stage, run, replicate, every factor in its natural unit, published (angle [deg]), seed.
    """
    wanted = list(stages)
    if replicates < 1:
        raise ValueError(f"replicates: must be at least 1, got {replicates}")
    if unknown := [stage for stage in wanted if stage not in STAGES]:
        raise ValueError(f"a stage of the paper is one of {', '.join(STAGES)}, got {unknown[0]!r}")
    runs = published_runs().fillna({factor.name: factor.center for factor in paper.factors()})
    runs = runs.assign(seed=FIRST_SEED + runs.index)[runs["stage"].isin(wanted)]
    copies = [
        runs.assign(replicate=number, seed=runs["seed"] + (number - 1) * SEEDS_A_REPLICATE)
        for number in range(1, replicates + 1)
    ]
    return pd.concat(copies).sort_index(kind="stable").reset_index(drop=True)


def _stages() -> dict[str, tuple[pd.DataFrame, Iterable[float]]]:
    """Natural settings and angles of every stage."""
    screening, composite = paper.published("plackett_burman"), paper.published("central_composite")
    climb, angles = paper.published("steepest_climb"), paper.verification()
    return {
        "screening": (paper.screening_design().natural, screening[paper.RESPONSE]),
        "climb": (climb[["E", "F"]], climb[paper.RESPONSE]),
        "composite": (paper.composite_design().natural, composite[paper.RESPONSE]),
        "verification": (pd.DataFrame([OPTIMUM] * len(angles)), angles),
    }
