"""The analysis of `dem-warp discover` on the paper's tables, with a chosen base as the model.

The published angles of Tables 3 and 5 are the data, Table 6 is held out. The settings are stated: calibration
moves all angles by one shift. What may be missing is another clump or plate, whose heaps are there; a size of
1 is that base. No run can be added to a printed table.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from doe.discrepancy import (
    Discovery,
    Emulator,
    Measured,
    MechanismRange,
    Outcomes,
    SearchSpace,
    Settings,
    analyse,
)
from doe.discrepancy.emulation.condition_surfaces import Addition, Polynomial, Surfaces, added, polynomial
from doe.discrepancy.emulation.run_noise import Noise
from experiments.evidence.studies.buckwheat.replay.base_choice import Candidate
from experiments.evidence.studies.buckwheat.replay.base_heaps import BASES
from experiments.evidence.studies.buckwheat.replay.replay import Replay
from experiments.evidence.studies.buckwheat.replay.runs import DESIGNS, planned_cases
from experiments.studies.buckwheat import paper

READING = 5.0
"""Largest shift of all angles by another way to read an outline [deg]."""
MIDDLE = np.zeros((1, 1))
"""Coded shift at which noise and terms are taken."""


def disagreement(heaps: pd.DataFrame, best: Candidate) -> Discovery:
    """Ask which other clump or plate explains what the published angles have and the chosen base lacks."""
    own = BASES[best.base]
    near = [
        name for name, parts in BASES.items() if sum(a != b for a, b in zip(parts, own, strict=True)) == 1
    ]
    angles = heaps.assign(angle=heaps[best.estimator])
    others = {name: Replay(rows) for name, rows in angles.groupby("base") if name in near}
    others = {name: replay for name, replay in others.items() if replay.runs["n"].all()}
    runs = _settings()
    base, spread = _by_setting(best.replay, runs), {name: _by_setting(r, runs) for name, r in others.items()}
    surfaces = {
        condition: _surfaces(
            best.replay, heap, {name: table.loc[condition] for name, table in spread.items()}
        )
        for condition, heap in base.iterrows()
    }
    space = SearchSpace(
        ("reading",),
        (-READING,),
        (READING,),
        tuple(map(str, surfaces)),
        tuple(str(condition).startswith(DESIGNS[-1]) for condition in surfaces),
        tuple(MechanismRange(str(name), 0.0, 1.0) for name in others),
    )
    count = sum(len(replay.measured) for replay in (best.replay, *others.values()))
    observed = ("flank_angle",)
    emulator = Emulator(space, observed, {str(c): s for c, s in surfaces.items()}, (0,), count)
    values = {str(c): a.to_numpy()[:, None] for c, a in runs.groupby("condition", sort=False)["published"]}
    analysis = analyse(Measured(tuple(values), observed, values), emulator, Settings(), 1)
    try:
        wave = next(analysis)
        while True:
            none = np.full((len(wave), 1), np.nan)
            wave = analysis.send(Outcomes(none, ("a printed table takes no run",) * len(wave)))
    except StopIteration as end:
        found: Discovery = end.value
        return found


def _settings() -> pd.DataFrame:
    """Name the setting of each of the 31 runs after the first run that has it."""
    runs = planned_cases(1, DESIGNS)
    names = [factor.name for factor in paper.factors()]
    first = runs.groupby(["stage", *names], sort=False)["run"].transform("first")
    return runs.assign(condition=runs["stage"] + "-" + first.astype(str))


def _by_setting(replay: Replay, runs: pd.DataFrame) -> pd.DataFrame:
    heaps = replay.measured.merge(runs[["stage", "run", "condition"]], on=["stage", "run"])
    return heaps.groupby("condition")["angle"].agg(["mean", "count"]).reindex(runs["condition"].unique())


def _surfaces(replay: Replay, heap: pd.Series, others: dict[str, pd.Series]) -> Surfaces:
    """Mean of the base's heaps at a setting, a shift of it, and the shift of each other base."""
    stage = str(heap.name).partition("-")[0]
    known = replay.noise([stage]) if replay.noise([stage]).df > 0 else replay.noise()
    level = np.array([[np.log(replay.heap_variance[stage])], [0.0]])
    noise = Noise(level, np.diag([2.0 / known.df, 0.0]), np.eye(1), round(known.df), known.df)
    silent, terms = np.zeros(1, dtype=bool), polynomial(MIDDLE, 3).shape[1]
    additions = {}
    for name, other in others.items():
        width = added(MIDDLE, np.zeros(1)).shape[1]
        share = np.zeros((width, width))
        share[0, 0] = 1.0 / other["count"] + 1.0 / heap["count"]
        shift = _exact([other["mean"] - heap["mean"]], width)
        variance = noise.variance(MIDDLE[0])
        facts = {"growth": np.zeros(1), "variance": variance, "correlation": np.eye(1), "silent": silent}
        additions[name] = Addition(shift, np.zeros((width, terms)), share, share, **facts)
    error = np.zeros((terms, terms))
    error[0, 0] = 1.0 / heap["count"]
    return Surfaces(_exact([heap["mean"], READING], terms), error, error, noise, additions, silent)


def _exact(coefficients: list[float], terms: int) -> Polynomial:
    padded = np.zeros((terms, 1))
    padded[: len(coefficients), 0] = coefficients
    return Polynomial(padded, np.zeros(1), {})
