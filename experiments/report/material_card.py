"""The material that a campaign found, as a card: values, what they were fitted to, and what is as good."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from doe import Region, Sample
from experiments.calibrate.campaign import Campaign
from experiments.calibrate.results import OptimumResult
from experiments.io.files import write_text
from experiments.io.plug_ins import plug_in_versions
from experiments.io.toml_files import toml_text
from experiments.report.clump_files import gather_clumps
from experiments.studyfile import Study
from experiments.studyfile.campaign import Direct, Response
from experiments.studyfile.card import FORMAT, MATERIAL, SECTIONS
from experiments.studyfile.card_surface import SURFACE, surface_table
from experiments.studyfile.factor_section import with_factor_values
from experiments.studyfile.manifest import PLUG_INS
from experiments.studyfile.solver_section import CORRECTED_FOR, LAWS, written

CARD = "material.toml"

MOST_POINTS = 60
"""Compatible settings that a card lists."""

HEAD = """\
# Material card, written by dem-warp calibrate. A study takes its values by  material = "{card}"
# They hold together with the contact laws [material.solver], the clump and the estimator that they were found
# with. Every point of [compatible] is as good as the chosen one; not so every combination of the ranges.
# A range goes on, perhaps, at an end that not_explored_beyond names: the study explored nothing there.

"""


def write_material_card(campaign: Campaign, study: Study, folder: Path) -> Path | None:
    """Write ``material.toml`` and its clump files into a folder; None where the campaign chose no point."""
    if campaign.optimum is None:
        return None
    card = material_card(campaign, campaign.optimum, study)
    gather_clumps(card[MATERIAL], study.file.parent, folder, "material-")
    write_text(folder / CARD, HEAD.format(card=CARD) + toml_text(card))
    return folder / CARD


def material_card(campaign: Campaign, optimum: OptimumResult, study: Study) -> dict[str, Any]:
    """Lay out a card as nested tables; clump files as the study names them."""
    chosen = with_factor_values(study.document, study.factor_sections, optimum.settings)
    solver = study.solver
    corrected = solver.corrected_for if solver.corrected_for != solver.card_solver else None
    chosen["solver"] = {LAWS: written(solver.laws)} | ({CORRECTED_FOR: corrected} if corrected else {})
    return {
        "format": FORMAT,
        "name": study.name,
        "fitted": _fitted(campaign, study) | {"test": chosen["scene"]},
        "factor": _factors(optimum, study),
        "compatible": compatible_points(optimum.region),
        **({SURFACE: surfaces} if (surfaces := _surfaces(campaign)) else {}),
        MATERIAL: copy.deepcopy({key: chosen[key] for key in SECTIONS if key in chosen}),
    }


def _fitted(campaign: Campaign, study: Study) -> dict[str, Any]:
    measurement, numerics = study.measurement, study.numerics
    facts: dict[str, Any] = {
        "outcome": campaign.outcome.value,
        "reason": campaign.reason,
        "scale": study.scale,
        "study": study.sha256,
        "estimator": f"repose angle, {measurement.fit!r} fit, mean of {measurement.azimuths} views",
        "measurement": measurement.settings,
        "numerics": numerics.model_dump(exclude_none=True),
        "response": {response.name: _response(campaign, response) for response in campaign.responses},
    }
    if campaign.direct:
        facts["direct"] = {direct.name: _direct(direct) for direct in campaign.direct}
    if study.engine is not None:
        facts["engine"] = study.engine.name or study.engine.command
    if added := plug_in_versions():
        facts[PLUG_INS] = added
    if study.walls:
        facts["walls"] = {name: part.model_dump(exclude_none=True) for name, part in study.walls.items()}
    scenes, document = {response.scene for response in campaign.responses}, study.document
    for kind in ("response-scene", "condition"):
        if used := {name: table for name, table in document.get(kind, {}).items() if name in scenes}:
            facts[kind] = used
    return facts


def _response(campaign: Campaign, response: Response) -> dict[str, Any]:
    facts: dict[str, Any] = {"observable": response.observable, "scene": response.scene}
    if campaign.target is not None:
        facts |= sample_table(campaign.target.responses[response.name], response.unit)
    if campaign.verification is not None:
        test, unit = campaign.verification.responses[response.name], response.unit
        interval = [quantity_text(end, unit) for end in test.interval]
        difference = {"difference": quantity_text(test.difference, unit), "interval": interval}
        facts["fresh"] = sample_table(test.a, unit) | difference
    return facts


def _direct(direct: Direct) -> dict[str, Any]:
    facts = {"factor": direct.factor, "by": direct.by, **sample_table(direct.measured, direct.unit)}
    return facts | {"model_sd": quantity_text(direct.model_sd, direct.unit)}


def sample_table(sample: Sample, unit: str) -> dict[str, Any]:
    """Write a sample as a card has it."""
    return {"mean": quantity_text(sample.mean, unit), "sd": quantity_text(sample.sd, unit), "n": sample.n}


def _factors(optimum: OptimumResult, study: Study) -> dict[str, Any]:
    ranges, found = optimum.ranges, bool(optimum.region.mask.any())
    parameters = {section.name: section.parameter for section in study.factor_sections}
    return {
        factor.name: {
            "parameter": ", ".join(parameters[factor.name]),
            "unit": factor.unit,
            "chosen": short(optimum.point[factor.name]),
            "low": short(ranges["low"][factor.name]) if found else None,
            "high": short(ranges["high"][factor.name]) if found else None,
            "not_explored_beyond": edges(ranges.loc[factor.name, ["low_open", "high_open"]]),
            "identified": factor.name not in optimum.unidentified,
        }
        for factor in optimum.region.factors
    }


def _surfaces(campaign: Campaign) -> dict[str, Any]:
    if campaign.surface is None or campaign.fidelity is not None:
        return {}  # those of a cheaper scale are not those of the card's test
    return {name: surface_table(found.reduced) for name, found in campaign.surface.responses.items()}


def edges(opened: pd.Series) -> list[str]:
    """Name the ends of a factor's range ("low", "high") beyond which nothing was explored."""
    return [str(end).removesuffix("_open") for end, edge in opened.items() if edge]


def compatible_points(region: Region) -> dict[str, Any]:
    """List points all over a compatible region, as a card does."""
    inside = np.flatnonzero(region.mask)
    count = min(len(inside), MOST_POINTS)
    points = region.natural.to_numpy()[inside[np.linspace(0, len(inside) - 1, count).astype(int)]]
    return {
        "share_of_design": short(region.fraction),
        "factors": [factor.name for factor in region.factors],
        "points": [[short(value) for value in point] for point in points],
    }


def short(value: float) -> float:
    """Round to the four digits that a card writes."""
    return float(f"{value:.4g}")


def quantity_text(value: float, unit: str) -> str | float:
    """Write a value as a study file has it: angles with three decimals, others with four digits."""
    if unit == "1":
        return short(value)
    return f"{value:.3f} deg" if unit == "deg" else f"{value:.4g} {unit}"
