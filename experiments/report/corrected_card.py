"""Corrected card of a bridge, and its folder."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

from experiments.bridge.result import Crossing
from experiments.io.files import copy_file, write_text
from experiments.io.texts import safe_text
from experiments.io.toml_files import toml_text
from experiments.report.material_card import (
    CARD,
    compatible_points,
    edges,
    quantity_text,
    sample_table,
    short,
)
from experiments.studyfile.card import BRIDGE, MATERIAL, SECTIONS, files_of
from experiments.studyfile.factor_section import with_factor_values

RESULTS, RUNS = "bridge.json", "runs.csv"
"""Files next to the card: all that was found, and every run of the other solver."""

HEAD = """\
# Material card, corrected by dem-warp bridge for {engine}.
# Its values hold in that solver, with the clump and the estimator below, and nowhere else.

"""


def write_crossing(crossing: Crossing, folder: Path) -> None:
    """Write what a bridge found into a folder, and the corrected card where there is a corrected point."""
    write_text(folder / RESULTS, json.dumps(crossing.to_dict(), indent=1, allow_nan=False) + "\n")
    write_text(folder / RUNS, crossing.runs.to_csv(index=False))
    if crossing.point is None:
        return
    card = corrected_card(crossing)
    for table, key in files_of(card[MATERIAL]):
        source = Path(table[key])
        table[key] = source.name
        copy_file(source, folder / source.name)
    write_text(folder / CARD, HEAD.format(engine=safe_text(crossing.engine)) + toml_text(card))


def corrected_card(crossing: Crossing) -> dict[str, Any]:
    """Lay out the corrected card as nested tables; clump files by their whole paths."""
    source, point, region = crossing.source, crossing.point or {}, crossing.region
    card = copy.deepcopy(source.card)
    chosen = with_factor_values(source.study.document, source.study.factor_sections, point)
    card[MATERIAL] = copy.deepcopy({key: chosen[key] for key in SECTIONS if key in chosen})
    card["fitted"]["outcome"], card["fitted"]["reason"] = crossing.outcome.value, crossing.reason
    card["fitted"]["response"][source.response]["fresh"] = _fresh(crossing)
    for name, value in point.items():
        card["factor"][name]["chosen"] = value
    if region is not None:
        card["compatible"] = compatible_points(region)
        for name, ends in region.ranges.iterrows() if region.mask.any() else ():
            card["factor"][name] |= {end: short(ends[end]) for end in ("low", "high")}
            card["factor"][name]["not_explored_beyond"] = edges(region.open_ends.loc[name])
    card[BRIDGE] = _bridge(crossing)
    return card


def _fresh(crossing: Crossing) -> dict[str, Any]:
    test, unit = crossing.fresh, crossing.source.unit
    if test is None:
        return {}
    interval = [quantity_text(end, unit) for end in test.interval]
    return sample_table(test.a, unit) | {
        "difference": quantity_text(test.difference, unit),
        "interval": interval,
    }


def _bridge(crossing: Crossing) -> dict[str, Any]:
    carried, unit = crossing.carried, crossing.source.unit
    facts: dict[str, Any] = {"engine": crossing.engine, "runs": len(crossing.runs)}
    facts |= {"beyond_design": crossing.extent > 1.0, "card_point": crossing.source.point}
    if carried is not None:
        ends = carried.intervals()
        facts |= {
            "shift": quantity_text(carried.shift, unit),
            "shift_interval": [quantity_text(end, unit) for end in ends["shift"]],
            "scale": short(carried.scale),
            "scale_interval": [short(end) for end in ends["scale"]],
            "noise": quantity_text(carried.noise, unit),
        }
    return facts
