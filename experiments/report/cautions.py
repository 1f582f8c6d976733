"""Cautions: what a reader must know of a campaign before its values are used."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from experiments.calibrate.results import Campaign
from experiments.measurement.filling import filling_missed, filling_reached, filling_text
from experiments.report.kit.numbers import capital, enumeration, fixed
from experiments.studyfile import Study
from experiments.studyfile.campaign import TARGET_SCENE

FEW_GRAINS = 1000
"""Grains of a heap below which its size shows: buckwheat heaps of 400 grains stood 2.7 degrees flatter than
those of 2,490, in 30 pairs of runs (record of the buckwheat study)."""

POOR_PREDICTION = 0.5
"""Predicted R² below which a surface describes its own runs better than those to come."""

PREDICTION_GAP = 0.2
"""Difference of adjusted and predicted R² above which a surface is too flexible for its runs (the rule of
Stat-Ease's Design-Expert)."""

FILLED_BY = ("drum.filling", "drum.grain_count")
"""Parameters of a study that fill a drum; of a factor among them each case has its own filling."""

FEW_MEASUREMENTS = 3
"""Measurements of a target below which its scatter is hardly known."""

WIDE_MARGIN = 0.1
"""Margin of equivalence above which it says little, as a share of the target."""


@dataclass(frozen=True)
class Caution:
    """One sentence or two, and the chapter that has more."""

    text: str
    chapter: str


def cautions(campaign: Campaign, study: Study) -> list[Caution]:
    """List what limits a campaign's values, the gravest first."""
    return [caution for rule in _RULES for caution in rule(campaign, study)]


def study_cautions(study: Study) -> list[Caution]:
    """List what limits any values found with a study's heaps, whatever they are compared with."""
    grains = study.case({}, seed=0).scene.grain_count
    return [*_small(grains), *_narrow(study), *_softened(study)]


def _twin(campaign: Campaign, study: Study) -> Iterator[Caution]:
    if campaign.target is not None and campaign.target.truth is not None:
        yield Caution(
            "The target was simulated, not measured. This run tests the method; its values are not those of "
            "a material.",
            "target",
        )


def _heaps(campaign: Campaign, study: Study) -> Iterator[Caution]:
    cases = campaign.cases
    if "grain_count" in cases:
        yield from _small(cases.loc[cases["scene"] == TARGET_SCENE, "grain_count"].median())
    yield from _narrow(study)


def _filling(campaign: Campaign, study: Study) -> Iterator[Caution]:
    varied = [parameter for factor in study.factor_sections for parameter in factor.parameter]
    if "fill_height" not in campaign.cases or any(parameter.endswith(FILLED_BY) for parameter in varied):
        return
    for name, rows in campaign.cases.groupby("scene"):
        scene = study.case({}, 0, str(name)).scene
        reached = filling_reached(scene, {"fill_height": float(rows["fill_height"].median())})
        if reached is not None and filling_missed(scene, reached):
            yield Caution(
                f"The drum was filled otherwise than stated: {filling_text(scene, reached)}. Change filling, "
                "or count the grains (grain_count).",
                "summary",
            )


def _small(grains: float | None) -> Iterator[Caution]:
    if grains and grains < FEW_GRAINS:
        yield Caution(
            f"Each heap has fewer than {FEW_GRAINS} grains. So small a heap stands flatter and scatters more "
            "than a large one; its values may not carry over.",
            "summary",
        )


def _narrow(study: Study) -> Iterator[Caution]:
    if narrow := study.narrowness():
        yield Caution(f"{capital(narrow).rstrip('.')}.", "summary")


def _modulus(campaign: Campaign, study: Study) -> Iterator[Caution]:
    yield from _softened(study)


def _softened(study: Study) -> Iterator[Caution]:
    if study.numerics.modulus_scale != 1.0:
        yield Caution(
            "The shear modulus was softened. Use the values with the same softened modulus, or verify them "
            "again with the real one.",
            "provenance",
        )


def _open_region(campaign: Campaign, study: Study) -> Iterator[Caution]:
    optimum = campaign.optimum
    if optimum is None:
        return
    if not optimum.region.mask.any():
        yield Caution("No setting that was explored agrees with every response.", "optimum")
    elif optimum.unidentified:
        names = enumeration(f"{study.labels[name]} ({name})" for name in optimum.unidentified)
        what = "These responses leave" if optimum.joint else "The target alone leaves"
        yield Caution(
            f"The compatible region is wide: {fixed(100.0 * optimum.region.fraction, 0)} % of the settings "
            f"that were explored fit as well. {what} open {names}. Another kind of test narrows it.",
            "optimum",
        )


def _poor_surface(campaign: Campaign, study: Study) -> Iterator[Caution]:
    if campaign.surface is None:
        return
    for name, found in campaign.surface.responses.items():
        fit = found.reduced
        predicted, adjusted = fit.r2_predicted, fit.r2_adjusted
        if predicted < POOR_PREDICTION or adjusted - predicted > PREDICTION_GAP:
            yield Caution(
                f"The surface of the {name} predicts new runs poorly: its predicted R² is "
                f"{fixed(predicted, 2)}, its adjusted R² {fixed(adjusted, 2)}. Add replicates, or widen the "
                "design.",
                "surface",
            )
        if found.full.anova["p"]["lack of fit"] < study.campaign.surface.lack_of_fit_alpha:
            yield Caution(
                f"A quadratic is too simple for the {name}: its lack of fit is significant. Shrink the "
                "design.",
                "surface",
            )


def _beyond_ranges(campaign: Campaign, study: Study) -> Iterator[Caution]:
    if campaign.optimum is None:
        return
    for factor in study.factors:
        value = campaign.optimum.point.get(factor.name, factor.center)
        if not factor.low <= value <= factor.high:
            yield Caution(
                f"The value of {study.labels[factor.name]} ({factor.name}) lies outside the range that the "
                "study states.",
                "factors",
            )


def _thin_target(campaign: Campaign, study: Study) -> Iterator[Caution]:
    for name, sample in (campaign.target.responses if campaign.target else {}).items():
        if sample.n < FEW_MEASUREMENTS:
            yield Caution(
                f"The target of the {name} rests on fewer than {FEW_MEASUREMENTS} measurements: its scatter "
                "is hardly known.",
                "target",
            )


def _wide_margin(campaign: Campaign, study: Study) -> Iterator[Caution]:
    if campaign.verification is None or campaign.target is None:
        return
    for name, test in campaign.verification.responses.items():
        aim = abs(campaign.target.responses[name].mean)
        if test.equivalent and (test.margin or 0.0) > WIDE_MARGIN * aim:
            yield Caution(
                f"The margin within which the {name} is shown to agree is wide: more than "
                f"{fixed(100.0 * WIDE_MARGIN, 0)} % of the target.",
                "verification",
            )


def _failed(campaign: Campaign, study: Study) -> Iterator[Caution]:
    if lost := len(campaign.failed_cases):
        yield Caution(f"{lost} of the cases failed, or lack{'s' if lost == 1 else ''} a response.", "failed")


_RULES: tuple[Callable[[Campaign, Study], Iterator[Caution]], ...] = (
    _twin,
    _heaps,
    _filling,
    _open_region,
    _poor_surface,
    _modulus,
    _wide_margin,
    _thin_target,
    _beyond_ranges,
    _failed,
)
