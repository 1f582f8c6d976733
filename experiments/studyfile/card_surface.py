"""The response surface on a material card: the runs that it was fitted to, to be fitted again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd

from doe import Design, DesignError, Factor, Surface, fit_surface
from experiments.io.errors import StudyError

SURFACE = "surface"
"""Table of a card that holds the surface of each fitted response, by its name."""


def surface_table(surface: Surface) -> dict[str, Any]:
    """Lay out a surface: its factors' coding, every run with its response, and the terms that stayed."""
    factors = surface.design.factors
    runs = surface.design.natural.loc[surface.response.index]
    return {
        "terms": [name for name in surface.coded_coefficients.index if name != "intercept"],
        "full": [name for name in surface.unselected.coded_coefficients.index if name != "intercept"],
        "factors": [factor.name for factor in factors],
        "low": [factor.low for factor in factors],
        "high": [factor.high for factor in factors],
        "runs": [[*map(float, row)] for row in runs.to_numpy()],
        "values": [float(value) for value in surface.response],
    }


def surface_of(table: object, units: Mapping[str, str], place: str) -> Surface:
    """Fit the surface of a card again; StudyError where `surface_table` did not lay it out."""
    try:
        if not isinstance(table, Mapping):
            raise KeyError("factors")
        ends = zip(table["factors"], table["low"], table["high"], strict=True)
        factors = tuple(Factor(name, low, high, units.get(name, "")) for name, low, high in ends)
        names = [factor.name for factor in factors]
        runs = pd.DataFrame(table["runs"], columns=names)
        runs.index = pd.RangeIndex(1, len(runs) + 1, name="run")
        design = Design.from_table(runs, factors, coded=False)
        full = fit_surface(design, table["values"], table["full"])
        return replace(fit_surface(design, table["values"], table["terms"]), selected_from=full)
    except (DesignError, KeyError, TypeError, ValueError) as error:
        problem = f"is not a surface as dem-warp calibrate writes it ({type(error).__name__}: {error})"
        raise StudyError(place, problem) from None


def card_surfaces(card: Mapping[str, Any], path: Path) -> dict[str, Surface]:
    """Fit every surface of a card again, by the response's name; errors as in `surface_of`."""
    units = {name: str(factor.get("unit", "")) for name, factor in card.get("factor", {}).items()}
    tables = card.get(SURFACE, {})
    return {name: surface_of(table, units, f"{path}: {SURFACE}.{name}") for name, table in tables.items()}
