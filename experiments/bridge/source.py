"""The card that a bridge starts from: its test, its free factors, its surface, its target."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from doe import DesignError, Sample, Surface
from experiments.io.errors import StudyError
from experiments.io.toml_files import read_toml
from experiments.io.units import Quantity
from experiments.studyfile import Study, load_card
from experiments.studyfile.card import BRIDGE
from experiments.studyfile.card_surface import SURFACE, card_surfaces


@dataclass(frozen=True, eq=False)
class Source:
    """Parts of a card."""

    path: Path
    card: dict[str, Any]
    study: Study
    """Its own test; the factors of its surface vary, all else has its values."""
    response: str
    """Name of the response that it was fitted to."""
    observable: str
    """Column of the cases that holds it."""
    unit: str
    target: Sample
    surface: Surface
    point: dict[str, float]
    """Chosen value of every factor, natural unit."""


def read_source(path: Path) -> Source:
    """Read the card of a bridge.

    Raise StudyError when the file is not a card, a bridge has written it, it has no surface, or several
    responses were matched together.
    """
    _, card = read_toml(path)
    own = load_card(path)
    if BRIDGE in card:
        hint = "Start from the card that dem-warp calibrate wrote."
        raise StudyError(f"{path}: {BRIDGE}", "this card was already corrected by a bridge", hint=hint)
    surfaces = card_surfaces(card, path)
    if len(surfaces) != 1:
        problem = "a bridge needs a card with the surface of one response, [surface.NAME]"
        raise StudyError(f"{path}: {SURFACE}", problem, ", ".join(surfaces) or "no surface")
    [(response, surface)] = surfaces.items()
    facts = card.get("fitted", {}).get("response", {}).get(response, {})
    if facts.get("scene", "target") != "target":
        problem = "a bridge runs the card's own test, not a further scene"
        raise StudyError(f"{path}: fitted.response.{response}", problem, facts["scene"])
    target, unit = _target(facts, f"{path}: fitted.response.{response}")
    chosen = {name: card["factor"][name]["chosen"] for name in surface.design.names}
    study = _with_factors(own, card, surface)
    return Source(path, card, study, response, facts["observable"], unit, target, surface, chosen)


def _target(facts: dict[str, Any], place: str) -> tuple[Sample, str]:
    try:
        mean, sd = (Quantity.parse(facts[name]) for name in ("mean", "sd"))
        return Sample(mean.number, sd.number, facts["n"]), mean.unit or "1"
    except (DesignError, KeyError, ValueError) as error:
        problem = "must have the mean, sd and n of what was measured, and its observable"
        raise StudyError(place, problem, f"{type(error).__name__}: {error}") from None


def _with_factors(study: Study, card: dict[str, Any], surface: Surface) -> Study:
    """Free the factors of a surface in a card's study."""
    factors = []
    for factor in surface.design.factors:
        parameters = [name.strip() for name in card["factor"][factor.name]["parameter"].split(",")]
        ends = {name: Quantity(getattr(factor, name), factor.unit) for name in ("low", "high")}
        factors.append({"name": factor.name, "label": factor.name, "parameter": parameters, **ends})
    # a bridge begins anew, whichever solver some values were corrected for
    return study.with_factors(factors, solver=study.solver.model_copy(update={"corrected_for": None}))
