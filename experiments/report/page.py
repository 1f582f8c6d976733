"""The page: every stage's tables and charts, rendered by the templates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import jinja2
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from dem_warp import GrainPopulation
from experiments.calibrate.results import STAGES, Campaign, Outcome
from experiments.report import numbers
from experiments.report.pictures import HeapPicture
from experiments.report.published import published_for
from experiments.report.sections import (
    TITLES,
    Context,
    Section,
    failed_section,
    paper_sections,
    replay_sections,
    stage_sections,
)
from experiments.studies.buckwheat.replay import Replay
from experiments.studyfile import Study

OUTCOMES = {
    Outcome.CALIBRATED: "Calibrated",
    Outcome.NOT_VERIFIED: "Not verified",
    Outcome.NO_SIGNIFICANT_FACTOR: "No significant factor",
    Outcome.TARGET_NOT_REACHED: "Target not reached",
    Outcome.PLATEAU: "Plateau before the target",
    Outcome.NO_CONTOUR: "No setting gives the target",
    Outcome.TOO_MANY_FAILED_RUNS: "Too many failed runs",
}
"""Outcomes as headlines."""


def render_page(
    campaign: Campaign,
    study: Study,
    pictures: Sequence[HeapPicture] = (),
    provenance: Mapping[str, Any] | None = None,
    replay: Replay | None = None,
) -> str:
    """Render the report of a campaign as one self-contained HTML page.

    Parameters
    ----------
    campaign, study
        What was run.
    pictures
        Heaps to show.
    provenance
        What made the numbers: names and values, nested as they come.
    replay
        The paper's own runs simulated again.
    """
    context = Context(campaign, _labels(study), published_for(study))
    sections = stage_sections(context)
    if pictures:
        sections.append(Section("heaps"))
    sections += [failed_section(campaign), *replay_sections(replay, campaign)]
    sections += [*paper_sections(context.published), Section("provenance")]
    page = environment().get_template("page.html.j2")
    return page.render(
        kind="calibration report",
        folder="sections",
        campaign=campaign,
        leading=context.leading,
        study=study,
        outcome=OUTCOMES[campaign.outcome],
        calibrated=campaign.outcome is Outcome.CALIBRATED,
        sections=sections,
        unreached=[TITLES[name] for name in STAGES if name not in campaign.stages],
        published=context.published,
        labels=context.labels,
        facts=study_facts(study),
        pictures=pictures,
        provenance=flat(provenance or {}),
        settings=flat(campaign.settings.model_dump()),
        document=flat(study.document),
        plotly=Markup(get_plotlyjs()),
    )


def study_facts(study: Study) -> dict[str, str]:
    """Say what was simulated and measured, in the terms in which scales differ."""
    tube, numerics, measurement = study.scene.lifted_cylinder, study.numerics, study.measurement
    count = tube.grain_count if tube else study.case({}, seed=0).scene.grain_count
    grains = f"{count} grains" if count else "as many grains as fill it"
    spheres = _sphere_counts(study.grain.population())
    softened = "real" if numerics.modulus_scale == 1.0 else f"divided by {numerics.modulus_scale:g}"
    test = {"Test": _scene_text(study.document["scene"])}
    if tube is not None:
        test = {
            "Tube": f"{1e3 * tube.diameter:g} mm wide, {1e3 * tube.height:g} mm high",
            "Lift": f"{tube.lift_speed:g} m/s",
        }
    further = study.document.get("response-scene", {})
    return {
        "Scale": study.scale or "the study as written",
        **test,
        "Grains": f"{grains}, {spheres} each",
        "Shear modulus": softened,
        "Time step": f"{100.0 * numerics.time_step_fraction:g} % of the Rayleigh time",
        "Angle": f"“{measurement.fit}” fit, mean of {measurement.azimuths} views of a heap, both flanks",
    } | {f"Scene “{name}”": _scene_text(scene) for name, scene in further.items()}


def _scene_text(scene: Mapping[str, Any]) -> str:
    """Describe a scene as the study writes it."""
    [(kind, settings)] = scene.items()
    return ", ".join([kind, *(f"{key.replace('_', ' ')} {value}" for key, value in settings.items())])


def _sphere_counts(grains: GrainPopulation) -> str:
    """Say of how many spheres the grains are: ``9 spheres``, or ``1 or 9 spheres`` of several shapes."""
    counts = sorted({shape.sphere_count for shape in grains.mixture.shapes})
    return f"{' or '.join(map(str, counts))} sphere{'' if counts == [1] else 's'}"


def flat(settings: Mapping[str, Any], prefix: str = "") -> dict[str, str]:
    """Lay out nested settings as dotted names with their values as text."""
    rows: dict[str, str] = {}
    for name, value in settings.items():
        path = f"{prefix}{name}"
        match value:
            case Mapping() if value:
                rows |= flat(value, f"{path}.")
            case [Mapping(), *_]:
                for position, item in enumerate(value, start=1):
                    rows |= flat(item, f"{path} {position}.")
            case _:
                rows[path] = numbers.plain(value)
    return rows


def _labels(study: Study) -> dict[str, str]:
    return {section.name: section.label for section in study.factor_sections}


def environment() -> jinja2.Environment:
    """Open the templates, with the filters that they use."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("experiments.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "fixed": numbers.fixed,
        "trimmed": numbers.trimmed,
        "p_value": numbers.p_value,
        "interval": numbers.interval,
        "quantity": numbers.quantity,
        "span": numbers.span,
        "unit_sign": numbers.unit_sign,
        "plain": numbers.plain,
        "named_number": numbers.named_number,
        "prose": numbers.prose,
        "capital": numbers.capital,
        "enumeration": numbers.enumeration,
        "equation": numbers.equation,
        "term": numbers.term,
    }
    return environment
