"""Stage (c): which factors the later stages vary."""

from __future__ import annotations

import math

import pandas as pd
from scipy import stats

from doe import NoiseFloor, detectable_effect
from experiments.calibrate.cases import StageEnd
from experiments.calibrate.results import (
    Decision,
    NoiseFloorResult,
    Outcome,
    ScreeningResult,
    SelectionResult,
)
from experiments.calibrate.settings import SelectionSettings
from experiments.calibrate.values import p_text

STAGE = "selection"


def select_factors(
    settings: SelectionSettings, screening: ScreeningResult, noise: NoiseFloorResult
) -> SelectionResult:
    """Keep the factors that the study names, or those that the rule finds significant."""
    ranked = screening.screen.table.sort_values("rank")
    significant = [str(name) for name in ranked.index[ranked["p"] < settings.alpha]]
    chosen = _chosen(settings, [str(name) for name in ranked.index], significant)
    kept = tuple(name for name in screening.design.names if name in chosen)
    cases = len(screening.screen.response)
    table = ranked[["effect", "p", "percent", "rank"]].copy()
    table["visible"] = table["effect"].abs() > _noise_effect(noise.floor, cases, settings.alpha)
    table["kept"] = table.index.isin(kept)
    table["reason"] = [_reason(settings, str(name), kept, significant) for name in table.index]
    visible = _visible_effect(settings, noise.floor, cases, screening.screen.error_df)
    decisions = (
        _kept_decision(settings, table, kept, significant),
        _noise_decision(settings, table, visible, noise),
    )
    return SelectionResult(kept, table, visible, decisions)


def require_kept(settings: SelectionSettings, selection: SelectionResult) -> None:
    """Go on when a factor was kept.

    Raises
    ------
    StageEnd
        When none was.
    """
    if selection.kept:
        return
    strongest = selection.table.iloc[0]
    raise StageEnd(
        Outcome.NO_SIGNIFICANT_FACTOR,
        f"No factor has p below {settings.alpha:g}; the strongest, {selection.table.index[0]}, has an effect "
        f"of {strongest['effect']:+.2f} deg ({p_text(strongest['p'])}). With this noise the design sees "
        f"effects from about {selection.visible_effect:.2f} deg on: widen the ranges, add screening "
        "replicates or dummies, or name the factors to keep in selection.keep.",
    )


def _chosen(settings: SelectionSettings, ranked: list[str], significant: list[str]) -> set[str]:
    if settings.keep is not None:
        return set(settings.keep)
    count = min(max(len(significant), settings.at_least), settings.at_most)
    return set(ranked[:count])


def _reason(settings: SelectionSettings, name: str, kept: tuple[str, ...], significant: list[str]) -> str:
    if settings.keep is not None:
        return "named in the study" if name in kept else "not named in the study"
    if name in kept:
        return "significant" if name in significant else f"strongest of at least {settings.at_least}"
    return f"beyond the strongest {settings.at_most}" if name in significant else "not significant"


def _noise_effect(floor: NoiseFloor, cases: int, alpha: float) -> float:
    """Return the effect [deg] that seeds alone exceed with probability alpha (its error: 2 sd / sqrt(n))."""
    return float(stats.t.isf(0.5 * alpha, floor.sample.df)) * 2.0 * floor.sd / math.sqrt(cases)


def _visible_effect(settings: SelectionSettings, floor: NoiseFloor, cases: int, error_df: float) -> float:
    if not floor.sd > 0.0:
        return 0.0
    return detectable_effect(floor.sd, cases, error_df, settings.alpha, settings.power)


def _kept_decision(
    settings: SelectionSettings, table: pd.DataFrame, kept: tuple[str, ...], significant: list[str]
) -> Decision:
    if settings.keep is not None:
        rule = "The study names the factors to keep."
    else:
        rule = (
            f"A factor is kept when p < {settings.alpha:g} in the screening; at least {settings.at_least}, "
            f"at most {settings.at_most}, strongest first."
        )
    outcome = f"Kept: {', '.join(kept)}." if kept else "No factor is kept."
    if settings.keep is None and len(significant) == len(table) > 1:
        outcome += " Every factor is significant."
    if settings.keep is None and len(significant) > len(kept):
        outcome += f" Of {len(significant)} significant ones the weaker stay at their middle."
    numbers = {f"p of {name}": float(p) for name, p in table["p"].items()}
    return Decision(STAGE, rule, numbers, outcome)


def _noise_decision(
    settings: SelectionSettings, table: pd.DataFrame, visible: float, noise: NoiseFloorResult
) -> Decision:
    missed = [str(name) for name in table.index[table["visible"] & ~table["kept"]]]
    outcome = f"Effects from {visible:.2f} deg on had a chance of {settings.power:.0%} to be seen."
    if missed:
        outcome += (
            f" {', '.join(missed)}: larger than the noise alone explains, yet not kept. The screening's "
            "error holds interactions too, and each of these effects may be one."
        )
    return Decision(
        STAGE,
        "The noise floor tells the smallest effect that the screening could see, were noise its only error.",
        {"noise sd [deg]": noise.floor.sd, "visible effect [deg]": visible, "power": settings.power},
        outcome,
    )
