"""Factor values by name: those that the study fixes, their bounds, and how a sentence writes them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from doe import Factor

if TYPE_CHECKING:
    from experiments.studyfile import Study
    from experiments.studyfile.campaign import Response

UNLIMITED = (float("-inf"), float("inf"))


def fixed_values(values: Mapping[str, float] | None, kept: Iterable[str]) -> dict[str, float] | None:
    """Return the study's values of the kept factors; None where it fixes none or lacks one of them."""
    kept = tuple(kept)
    if values is None or not set(kept) <= set(values):
        return None
    return {name: float(values[name]) for name in kept}


def p_text(p: float | None) -> str:
    """Return a p value in words: ``p = 0.042``, or ``p < 0.001``; where there was no test, say so."""
    if p is None:
        return "not tested"
    return "p < 0.001" if p < 0.001 else f"p = {p:.3f}"


def listed(values: Mapping[str, float]) -> str:
    """Write values as ``E = 0.48, F = 0.45``."""
    return ", ".join(f"{name} = {value:.4g}" for name, value in values.items())


def named(study: Study, names: Iterable[str]) -> str:
    """Name factors in words: ``grain-grain static friction (E), grain-steel static friction (F)``."""
    labels = {section.name: section.label for section in study.factor_sections}
    return ", ".join(f"{labels[name]} ({name})" for name in names)


def worded(study: Study, values: Mapping[str, float]) -> str:
    """Write values with their factors in words: ``grain-grain static friction (E) 0.48, ...``."""
    units = {section.name: section.unit for section in study.factor_sections}
    parts = (f"{named(study, [name])} {value:.4g} {units[name]}".rstrip() for name, value in values.items())
    return ", ".join(parts)


def numbered_values(prefix: str, values: Mapping[str, float]) -> dict[str, float]:
    """Return values keyed for a decision's numbers: ``start E``, ``start F``."""
    return {f"{prefix} {name}": float(value) for name, value in values.items()}


def quantity(value: float, unit: str, sign: str = "") -> str:
    """Write a value with its unit: angles with two decimals, others with four digits; ``"1"`` is not written.

    With ``sign`` ``"+"``, a plus sign is written too.
    """
    number = f"{value:{sign}.2f}" if unit == "deg" else f"{value:{sign}.4g}"
    return number if unit == "1" else f"{number} {unit}"


def interval_text(ends: tuple[float, float], unit: str, sign: str = "") -> str:
    """Write an interval as ``0.16 to 0.77 deg``."""
    low, _, _ = quantity(ends[0], unit, sign).partition(" ")
    return f"{low} to {quantity(ends[1], unit, sign)}"


def key_of(what: str, response: Response) -> str:
    """Key of a number that a decision looked at: ``sd of angle [deg]``."""
    unit = "" if response.unit == "1" else f" [{response.unit}]"
    return f"{what} of {response.name}{unit}"


def kept_factors(study: Study, kept: Iterable[str]) -> tuple[Factor, ...]:
    """Return the study's factors of these names, in the order of the names."""
    by_name = {factor.name: factor for factor in study.factors}
    return tuple(by_name[name] for name in kept)


def reach_limits(study: Study) -> dict[str, tuple[float, float]]:
    """Return how far a climb may go: the reach of the settings inside the hard physical limits."""
    reach = study.campaign.climb.reach
    limits = {}
    for factor in study.factors:
        low, high = study.limits.get(factor.name, UNLIMITED)
        # Twelve digits: a bound of 0.78 must admit the 0.78 that a person writes.
        first, last = (float(f"{factor.to_natural(side * reach):.12g}") for side in (-1.0, 1.0))
        limits[factor.name] = (max(low, first), min(high, last))
    return limits
