"""The paper's tables as measured heaps, and our own runs of the same settings as the model of them.

EDEM's angles stand for reality: every distinct setting of Tables 3, 5 and 6 is a condition with one
observable, the repose angle. Tables 3 and 5 are fitted, Table 6 is held out. What calibration may retune are
the two static frictions, by one shift in all runs. The library is what the paper does not say of its model:
the variants of the study that were simulated, each a signature over the settings whose size runs from the
study as written to the variant. No run can be added to tables, so that every number carries the seed noise of
the runs that are there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from doe.anova import least_squares
from experiments.discover.analysis import analyse
from experiments.discover.discovery import Discovery
from experiments.discover.emulator import Emulator
from experiments.discover.measured import Measured
from experiments.discover.noise import Noise
from experiments.discover.settings import Settings
from experiments.discover.simulator import Outcomes, Point
from experiments.discover.space import MechanismRange, SearchSpace
from experiments.discover.surfaces import Addition, Polynomial, Surfaces
from experiments.studies.buckwheat import paper
from experiments.studies.buckwheat.replay import Replay
from experiments.studies.buckwheat.runs import DESIGNS, published_runs
from experiments.studies.buckwheat.sensitivities import Sensitivities
from experiments.studies.buckwheat.variants import BASE, variants

OBSERVABLE = "flank_angle"

HELD_OUT = "composite"
"""Stage that takes no part in any fit: Table 6."""

CENTRE = "composite-2"
"""The setting in the middle of Table 6, next to the published optimum."""

RETUNED = ("E", "F")
"""Factors that calibration may shift: the static frictions, which the paper calibrates too."""

LEFT_OUT = ("base", "estimator")
"""Groups of variants that are no physical effect: how a picture is read is known."""


def published_settings() -> pd.DataFrame:
    """Distinct settings of Tables 3, 5 and 6.

    Returns
    -------
    DataFrame
        A row a run of the paper: stage, run, every factor in its natural unit, published (angle [deg]), and
        condition, the name of the setting after its first run.
    """
    runs = published_runs().fillna({factor.name: factor.center for factor in paper.factors()})
    runs = runs[runs["stage"].isin(DESIGNS)].reset_index(drop=True)
    names = [factor.name for factor in paper.factors()]
    first = runs.groupby(["stage", *names], sort=False)["run"].transform("first")
    return runs.assign(condition=runs["stage"] + "-" + first.astype(str))


def published_heaps() -> Measured:
    """EDEM's angles by setting: a run each, and the five of the centre of Table 6."""
    by_setting = published_settings().groupby("condition", sort=False)["published"]
    values = {str(name): angles.to_numpy()[:, None] for name, angles in by_setting}
    return Measured(tuple(values), (OBSERVABLE,), values)


def physical_heaps() -> Measured:
    """The measured repose angle at `CENTRE`: five values of the published mean and standard deviation.

    The five themselves were not published. Any five with these two moments say the same of a mean.
    """
    target = paper.measured()
    steps = np.linspace(-1.0, 1.0, target.n)
    values = target.mean + target.sd * steps / steps.std(ddof=1)
    return Measured((CENTRE,), (OBSERVABLE,), {CENTRE: values[:, None]})


def tables_emulator(base: Replay, found: Sensitivities | None) -> Emulator:
    """Our runs of the paper's settings as the emulator of EDEM's.

    Parameters
    ----------
    base
        The runs with the study as written.
    found
        The runs with its variants; None: none were simulated, and the library is empty.
    """
    settings = published_settings()
    angles = _by_setting(settings, base).dropna(subset=["mean"])
    shifts, noise = _shifts(settings, angles["mean"]), _noise(base)
    library = {} if found is None else _signatures(settings, found)
    surfaces = {}
    for condition, heap in angles.iterrows():
        additions = {name: _addition(table.loc[condition], noise) for name, table in library.items()}
        surfaces[str(condition)] = _surfaces(heap, *shifts[str(condition)], noise, additions)
    half_ranges = tuple(factor.half_range for factor in paper.factors() if factor.name in RETUNED)
    space = SearchSpace(
        tuple(f"shift_{name}" for name in RETUNED),
        tuple(-half for half in half_ranges),
        half_ranges,
        tuple(surfaces),
        tuple(condition.startswith(HELD_OUT) for condition in surfaces),
        tuple(MechanismRange(name, 0.0, 1.0) for name in library),
    )
    replays = [base, *(found.replays[name] for name in (BASE, *library))] if found else [base]
    heaps = sum(len(replay.measured) for replay in replays)
    return Emulator(space, (OBSERVABLE,), surfaces, (0,), heaps)


def physical_emulator(tables: Emulator) -> Emulator:
    """The same runs as the emulator of the one physical test, whose frictions are free about `CENTRE`."""
    space = replace(tables.space, conditions=(CENTRE,), held_out=(False,))
    return replace(tables, space=space, surfaces={CENTRE: tables.surfaces[CENTRE]})


def concluded(measured: Measured, emulator: Emulator, settings: Settings, seed: int = 1) -> Discovery:
    """Analyse data to which no run can be added: waves come back empty, and the runs there are decide."""
    analysis = analyse(measured, emulator, settings, seed)
    try:
        wave = next(analysis)
        while True:
            wave = analysis.send(_no_more_runs(wave))
    except StopIteration as end:
        found: Discovery = end.value
        return found


def _no_more_runs(points: Sequence[Point]) -> Outcomes:
    reason = "no run can be added to a printed table"
    return Outcomes(np.full((len(points), 1), np.nan), (reason,) * len(points))


def _by_setting(settings: pd.DataFrame, replay: Replay) -> pd.DataFrame:
    """Mean and count of a replay's heaps by condition."""
    heaps = replay.measured.merge(settings[["stage", "run", "condition"]], on=["stage", "run"])
    found = heaps.groupby("condition")["angle"].agg(["mean", "count"])
    return found.reindex(settings["condition"].unique())


def _noise(base: Replay) -> Noise:
    """Variance of one of our heaps by its seed, the same at all settings."""
    seeds = base.noise()
    coefficients = np.zeros((1 + len(RETUNED), 1))
    coefficients[0] = np.log(seeds.mean_sq)
    return Noise(coefficients, np.eye(1), round(seeds.df))


def _variance(noise: Noise) -> float:
    return float(noise.variance(np.zeros(len(RETUNED)))[0])


def _shifts(settings: pd.DataFrame, angles: pd.Series) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """What a shift of the two frictions does at every setting, by a regression over all of our angles.

    The model has every factor and the quadratic of the two frictions, b0 + b . x + x' B x in coded units. A
    shift t of the two changes it by (b + 2 B x) . t + t' B t.

    Returns
    -------
    dict
        By condition: coefficients of t1, t2, t1^2, t1 t2, t2^2 [deg], and their covariance.
    """
    factors = paper.factors()
    table = settings.drop_duplicates("condition").set_index("condition").loc[angles.index]
    x = pd.DataFrame({factor.name: factor.to_coded(table[factor.name]) for factor in factors})
    first, second = RETUNED
    squares = {"11": x[first] ** 2, "12": x[first] * x[second], "22": x[second] ** 2}
    fit = least_squares(pd.DataFrame({"1": 1.0, **x, **squares}), angles)
    terms = list(fit.params.index)
    shifts = {}
    for condition, row in x.iterrows():
        change = pd.DataFrame(0.0, index=range(5), columns=terms)
        change.loc[0, [first, "11", "12"]] = [1.0, 2.0 * row[first], row[second]]
        change.loc[1, [second, "22", "12"]] = [1.0, 2.0 * row[second], row[first]]
        for line, term in enumerate(squares, start=2):
            change.loc[line, term] = 1.0
        matrix = change.to_numpy()
        spread = matrix @ fit.cov_params().to_numpy() @ matrix.T
        shifts[str(condition)] = (matrix @ fit.params.to_numpy(), spread)
    return shifts


def _signatures(settings: pd.DataFrame, found: Sensitivities) -> dict[str, pd.DataFrame]:
    """By variant: its shift of every setting's angle [deg], and the variance of that over one heap's.

    Where a run failed, the shift is the mean of the others, as uncertain as they differ.
    """
    without = _by_setting(settings, found.replays[BASE])
    signatures = {}
    for name, replay in found.replays.items():
        variant = variants()[name]
        if variant.group in LEFT_OUT or not variant.candidate:
            continue
        with_it = _by_setting(settings, replay)
        shift = with_it["mean"] - without["mean"]
        share = 1.0 / with_it["count"] + 1.0 / without["count"]
        signatures[name] = pd.DataFrame(
            {"shift": shift.fillna(shift.mean()), "share": share, "lost": shift.isna()}
        )
        signatures[name]["spread"] = shift.var(ddof=1)
    return signatures


def _surfaces(
    heap: pd.Series, shifts: np.ndarray, spread: np.ndarray, noise: Noise, additions: dict[str, Addition]
) -> Surfaces:
    """One setting: its own mean, with the slopes that all settings have together."""
    coefficients = np.concatenate([[heap["mean"]], shifts])[:, None]
    gram_inverse = np.zeros((len(coefficients), len(coefficients)))
    gram_inverse[0, 0], gram_inverse[1:, 1:] = 1.0 / heap["count"], spread / _variance(noise)
    return Surfaces(_exact(coefficients), gram_inverse, noise, additions)


def _addition(signature: pd.Series, noise: Noise) -> Addition:
    """A mechanism that is linear in its size."""
    terms = 2 + len(RETUNED)
    coefficients = np.zeros((terms, 1))
    coefficients[0] = signature["shift"]
    gram_inverse = np.zeros((terms, terms))
    gram_inverse[0, 0] = signature["spread"] / _variance(noise) if signature["lost"] else signature["share"]
    base_terms = np.zeros((terms, (1 + len(RETUNED)) * (2 + len(RETUNED)) // 2))
    return Addition(_exact(coefficients), base_terms, gram_inverse, noise.variance(np.zeros(len(RETUNED))))


def _exact(coefficients: np.ndarray) -> Polynomial:
    """A polynomial that nothing was fitted to, so that it misses nothing."""
    return Polynomial(coefficients, np.zeros((len(coefficients), 0)), np.zeros(1), {})
