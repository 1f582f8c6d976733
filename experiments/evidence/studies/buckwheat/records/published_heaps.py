"""The paper's tables as measured heaps, and our own runs of the same settings as the model of them.

EDEM's angles stand for reality: every distinct setting of Tables 3, 5 and 6 is a condition with one
observable, the repose angle. Tables 3 and 5 are fitted, Table 6 is held out. The settings are stated, so that
no friction is retuned: what calibration may move is how an outline is read, one shift of all angles. The
library is what the paper does not say of its model: the variants of the study that were simulated, each a
signature over the settings whose size runs from the study as written to the variant. No run can be added to
tables, so that every number carries the seed noise of the runs that are there.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd

from doe.discrepancy import (
    Discovery,
    Emulator,
    Measured,
    MechanismRange,
    Outcomes,
    Point,
    SearchSpace,
    Settings,
    analyse,
)
from doe.discrepancy.emulation.condition_surfaces import Addition, Polynomial, Surfaces, added, cubic
from doe.discrepancy.emulation.run_noise import Noise
from doe.discrepancy.fitting.fitted_model import Model, Stack
from doe.discrepancy.fitting.measured_means import gather
from doe.discrepancy.fitting.model_fit import minimise, whiten
from experiments.evidence.studies.buckwheat.replay.replay import Replay
from experiments.evidence.studies.buckwheat.replay.runs import DESIGNS, published_runs
from experiments.evidence.studies.buckwheat.sensitivity.sensitivities import Sensitivities
from experiments.evidence.studies.buckwheat.sensitivity.variants import BASE, variants
from experiments.studies.buckwheat import paper

OBSERVABLE = "flank_angle"

HELD_OUT = "composite"
"""Stage that takes no part in any fit: Table 6."""

CENTRE = "composite-2"
"""The setting in the middle of Table 6, next to the published optimum."""

READING = 5.0
"""Largest move of all angles by another way to read an outline [deg], as lines through parts of a flank."""

LEFT_OUT = ("base", "estimator")
"""Groups of variants that are no physical effect; how a picture is read is calibrated."""


def published_settings() -> pd.DataFrame:
    """Every run of Tables 3, 5 and 6 as `published_runs` has it, no factor left empty.

    The column condition names its setting, after the first run that has it.
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
    """Return the measured repose angle at `CENTRE`: five values of the published mean and standard deviation.

    The five themselves were not published. Any five with these two moments say the same of a mean.
    """
    target = paper.measured()
    steps = np.linspace(-1.0, 1.0, target.n)
    values = target.mean + target.sd * steps / steps.std(ddof=1)
    return Measured((CENTRE,), (OBSERVABLE,), {CENTRE: values[:, None]})


def tables_emulator(base: Replay, found: Sensitivities | None) -> Emulator:
    """Our runs of the paper's settings, with the study as written (`base`), as the emulator of EDEM's.

    The library holds the variants that were simulated; without any it is empty.
    """
    settings = published_settings()
    angles = _by_setting(settings, base).dropna(subset=["mean"])
    library = {} if found is None else _signatures(settings, found)
    surfaces = {}
    for condition, heap in angles.iterrows():
        noise = _noise(base, str(condition).partition("-")[0], 1)
        additions = {name: _addition(table.loc[condition], noise) for name, table in library.items()}
        # A mean, a shift as it is read, and no curvature.
        fitted, spread = np.array([heap["mean"], READING]), np.diag([1.0 / heap["count"], 0.0])
        surfaces[str(condition)] = _surfaces(fitted, spread, noise, additions)
    held_out = tuple(condition.startswith(HELD_OUT) for condition in surfaces)
    box = ("reading",), (-READING,), (READING,)
    space = SearchSpace(*box, tuple(surfaces), held_out, _ranges(library))
    return Emulator(space, (OBSERVABLE,), surfaces, (0,), _heap_count(base, found, library))


def physical_emulator(base: Replay, found: Sensitivities | None) -> Emulator:
    """Our runs of Table 6 as the emulator of the one physical test: a quadratic of its two static frictions.

    As of `tables_emulator`; a mechanism shifts the angle by as much at all frictions.
    """
    settings, noise = published_settings(), _noise(base, HELD_OUT, 2)
    table_6 = settings[settings["stage"] == HELD_OUT]
    library = {} if found is None else _signatures(table_6, found)
    terms = ["intercept", "E", "F", "E^2", "E:F", "F^2"]
    fit = base.surface.fit
    spread = fit.normalized_cov_params.loc[terms, terms].to_numpy()
    additions = {name: _addition(_averaged(table), noise) for name, table in library.items()}
    surfaces = _surfaces(fit.params[terms].to_numpy(), spread, noise, additions)
    factors = paper.composite_factors()
    names, low, high = (tuple(getattr(one, key) for one in factors) for key in ("name", "low", "high"))
    space = SearchSpace(names, low, high, (CENTRE,), (False,), _ranges(library))
    return Emulator(space, (OBSERVABLE,), {CENTRE: surfaces}, (0,), _heap_count(base, found, library))


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


def base_q(
    emulator: Emulator, mechanisms: Sequence[str], sizes: Sequence[float], settings: Settings
) -> float:
    """Q of the study as written against the tables, in the errors of a model with mechanisms.

    A signature brings the seed noise of its heaps: it widens the errors, and lowers every Q, whether it
    explains anything or not.
    """
    evidence = gather(published_heaps(), emulator)
    blocks = (*evidence.training, *evidence.held_out)
    base, with_them = (Model(emulator, names, settings.systematic) for names in ((), tuple(mechanisms)))
    # How an outline is read brings no error: any reading will do.
    whitening = whiten(Stack(with_them, blocks).covariance(np.array([0.0, *sizes])))
    stack = Stack(base, blocks)
    _, q = minimise(stack, whitening, stack.target, base.start[None], base.lower, base.upper)
    return float(q[0])


def _no_more_runs(points: Sequence[Point]) -> Outcomes:
    reason = "no run can be added to a printed table"
    return Outcomes(np.full((len(points), 1), np.nan), (reason,) * len(points))


def _by_setting(settings: pd.DataFrame, replay: Replay) -> pd.DataFrame:
    """Mean and count of a replay's heaps by condition."""
    heaps = replay.measured.merge(settings[["stage", "run", "condition"]], on=["stage", "run"])
    found = heaps.groupby("condition")["angle"].agg(["mean", "count"])
    return found.reindex(settings["condition"].unique())


def _noise(base: Replay, stage: str, factors: int) -> Noise:
    """Variance of one of our heaps by its seed, the same at all settings of a stage."""
    known = base.noise([stage]) if base.noise([stage]).df > 0 else base.noise()
    coefficients = np.zeros((1 + factors, 1))
    coefficients[0] = np.log(base.heap_variance[stage])
    spread = np.zeros((1 + factors, 1 + factors))
    spread[0, 0] = 2.0 / known.df
    return Noise(coefficients, spread, np.eye(1), round(known.df), known.df)


def _signatures(settings: pd.DataFrame, found: Sensitivities) -> dict[str, pd.DataFrame]:
    """For each variant: its shift of every setting's angle [deg], and the variance of that over one heap's.

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
        known = {"shift": shift.fillna(shift.mean()), "share": share, "lost": shift.isna()}
        signatures[name] = pd.DataFrame(known | {"spread": shift.var(ddof=1)})
    return signatures


def _averaged(signature: pd.DataFrame) -> pd.Series:
    """One shift for several settings: the mean of theirs."""
    kept = signature[~signature["lost"]]
    mean = kept.mean()
    return mean.replace({"share": mean["share"] / len(kept)})


def _surfaces(
    fitted: np.ndarray, spread: np.ndarray, noise: Noise, additions: dict[str, Addition]
) -> Surfaces:
    terms = _base_terms(noise)
    coefficients, gram_inverse = np.zeros(terms), np.zeros((terms, terms))
    coefficients[: len(fitted)] = fitted
    gram_inverse[: len(fitted), : len(fitted)] = spread
    base, silent = _exact(coefficients), np.zeros(1, dtype=bool)
    return Surfaces(base, gram_inverse, gram_inverse, noise, additions, silent)


def _addition(signature: pd.Series, noise: Noise) -> Addition:
    middle = np.zeros((1, len(noise.coefficients) - 1))
    variance, terms = noise.variance(middle[0]), added(middle, np.zeros(1)).shape[1]
    coefficients, gram_inverse = np.zeros(terms), np.zeros((terms, terms))
    coefficients[0] = signature["shift"]
    gram_inverse[0, 0] = signature["spread"] / variance[0] if signature["lost"] else signature["share"]
    return Addition(
        _exact(coefficients),
        base_terms=np.zeros((terms, _base_terms(noise))),
        gram_inverse=gram_inverse,
        chance=gram_inverse,
        growth=np.zeros(1),
        variance=variance,
        silent=np.zeros(1, dtype=bool),
        correlation=noise.correlation,
    )


def _base_terms(noise: Noise) -> int:
    return int(cubic(np.zeros((1, len(noise.coefficients) - 1))).shape[1])


def _exact(coefficients: np.ndarray) -> Polynomial:
    return Polynomial(coefficients[:, None], np.zeros(1), {})


def _ranges(library: Iterable[str]) -> tuple[MechanismRange, ...]:
    return tuple(MechanismRange(name, 0.0, 1.0) for name in library)


def _heap_count(base: Replay, found: Sensitivities | None, library: Iterable[str]) -> int:
    replays = [base, *(found.replays[name] for name in (BASE, *library))] if found else [base]
    return sum(len(replay.measured) for replay in replays)
