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
from experiments.calibrate.values import key_of, named, p_text, quantity
from experiments.studyfile import Study
from experiments.studyfile.campaign import Response, SelectionSettings

STAGE = "selection"


def select_factors(
    settings: SelectionSettings, screening: ScreeningResult, noise: NoiseFloorResult, response: Response
) -> SelectionResult:
    """Keep the factors that the study names, or those that the rule finds significant for any response.

    The effects on the leading ``response`` rank them.
    """
    leading, floor = screening.leading, noise.leading
    ranked = leading.screen.table.sort_values("rank")
    # By factor and response, the leading one first.
    screens = {name: found.screen for name, found in screening.responses.items()}
    p = pd.DataFrame({name: screen.table["p"].reindex(ranked.index) for name, screen in screens.items()})
    significant = [str(name) for name in ranked.index if (p.loc[name] < settings.alpha).any()]
    count = min(max(len(significant), settings.at_least), settings.at_most)
    chosen = _by_strength(p, settings.alpha)[:count] if settings.keep is None else settings.keep
    kept = tuple(name for name in screening.design.names if name in chosen)
    cases = len(leading.screen.response)
    table = ranked[["effect", "p", "percent", "rank"]].copy()
    # what seeds alone exceed with probability alpha: an effect's error is 2 sd / sqrt(n)
    alone = float(stats.t.isf(0.5 * settings.alpha, floor.sample.df)) * 2.0 * floor.sd / math.sqrt(cases)
    table["visible"] = table["effect"].abs() > alone
    for name in p.columns[1:]:
        table[f"p_{name}"] = p[name]
    table["kept"] = table.index.isin(kept)
    table["reason"] = [_reason(settings, str(name), kept, p.loc[name]) for name in table.index]
    visible = 0.0
    if floor.sd > 0.0:
        visible = detectable_effect(floor.sd, cases, leading.screen.error_df, settings.alpha, settings.power)
    decisions = (
        _kept_decision(settings, p, kept, significant),
        _noise_decision(settings, table, visible, floor, response),
    )
    return SelectionResult(kept, table, visible, decisions)


def require_kept(study: Study, selection: SelectionResult) -> None:
    """Go on when a factor was kept; else StageEnd."""
    settings, response = study.campaign.selection, study.target.leading
    if selection.kept:
        return
    strongest, name = selection.table.iloc[0], named(study, [str(selection.table.index[0])])
    raise StageEnd(
        Outcome.NO_SIGNIFICANT_FACTOR,
        f"No factor has p below {settings.alpha:g}; the strongest, {name}, has an effect "
        f"of {quantity(strongest['effect'], response.unit, '+')} ({p_text(strongest['p'])}). With this noise "
        f"the design sees effects from about {quantity(selection.visible_effect, response.unit)} on: widen "
        "the ranges, add screening replicates or dummies, or name the factors to keep in selection.keep.",
    )


def _by_strength(p: pd.DataFrame, alpha: float) -> list[str]:
    """Order the factors: those that move the leading response, as the climb needs, then by their smallest p.

    The rows are in the order of the effects on the leading response.
    """

    def order(name: str) -> tuple[bool, float]:
        first, *others = p.loc[name]
        return not first < alpha, 0.0 if first < alpha or not others else min(others)

    return sorted(map(str, p.index), key=order)


def _reason(settings: SelectionSettings, name: str, kept: tuple[str, ...], p: pd.Series) -> str:
    if settings.keep is not None:
        return "named in the study" if name in kept else "not named in the study"
    moved = [str(response) for response in p.index[p < settings.alpha]]
    if name not in kept:
        return f"beyond the strongest {settings.at_most}" if moved else "not significant"
    if not moved:
        return f"strongest of at least {settings.at_least}"
    return "significant" if len(p) == 1 else f"significant for {', '.join(moved)}"


def _kept_decision(
    settings: SelectionSettings, p: pd.DataFrame, kept: tuple[str, ...], significant: list[str]
) -> Decision:
    if settings.keep is not None:
        rule = "The study names the factors to keep."
    else:
        several = len(p.columns) > 1
        whose = " for any of the responses" if several else ""
        first = f", those that move the {p.columns[0]} before the others" if several else ""
        rule = (
            f"A factor is kept when p < {settings.alpha:g} in the screening{whose}; at least "
            f"{settings.at_least}, at most {settings.at_most}, strongest first{first}."
        )
    outcome = f"Kept: {', '.join(kept)}." if kept else "No factor is kept."
    if settings.keep is None and len(significant) == len(p) > 1:
        outcome += " Every factor is significant."
    if settings.keep is None and len(significant) > len(kept):
        outcome += f" Of {len(significant)} significant ones the weaker stay at their middle."
    pairs = ((name, response) for response in p.columns for name in p.index)
    numbers = {f"p of {name} for {response}": float(p.loc[name, response]) for name, response in pairs}
    return Decision(STAGE, rule, numbers, outcome)


def _noise_decision(
    settings: SelectionSettings, table: pd.DataFrame, visible: float, floor: NoiseFloor, response: Response
) -> Decision:
    missed = [str(name) for name in table.index[table["visible"] & ~table["kept"]]]
    numbers = {key_of("sd", response): floor.sd, key_of("visible effect", response): visible}
    seen = quantity(visible, response.unit)
    outcome = f"Effects from {seen} on had a chance of {settings.power:.0%} to be seen."
    if missed:
        outcome += (
            f" {', '.join(missed)}: larger than the noise alone explains, yet not kept. The screening's "
            "error holds interactions too, and each of these effects may be one."
        )
    return Decision(
        STAGE,
        "The noise floor tells the smallest effect that the screening could see, were noise its only error.",
        numbers | {"power": settings.power},
        outcome,
    )
