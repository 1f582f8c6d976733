"""Cautions: what a reader must know of a campaign before its values are used."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from dem_warp import PlacedScene
from experiments.calibrate.campaign import Campaign
from experiments.calibrate.direct_checks import disagreement_text
from experiments.measurement.filling import filling_missed, filling_reached, filling_text
from experiments.report.kit.numbers import capital, enumeration, fixed
from experiments.report.kit.sentences import say
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
    return [*_small(grains, study), *_unlikely(study), *_softened(study)]


def _twin(campaign: Campaign, study: Study) -> Iterator[Caution]:
    if campaign.target is not None and campaign.target.truth is not None:
        yield Caution(say("caution.twin"), "target")


def _heaps(campaign: Campaign, study: Study) -> Iterator[Caution]:
    cases = campaign.cases
    if "grain_count" in cases:
        yield from _small(cases.loc[cases["scene"] == TARGET_SCENE, "grain_count"].median(), study)
    yield from _unlikely(study)


def _filling(campaign: Campaign, study: Study) -> Iterator[Caution]:
    varied = [parameter for factor in study.factor_sections for parameter in factor.parameter]
    if "fill_height" not in campaign.cases or any(parameter.endswith(FILLED_BY) for parameter in varied):
        return
    for name, rows in campaign.cases.groupby("scene"):
        scene = study.case({}, 0, str(name)).scene
        reached = filling_reached(scene, {"fill_height": float(rows["fill_height"].median())})
        if reached is not None and filling_missed(scene, reached):
            yield Caution(say("caution.filling", filling=filling_text(scene, reached)), "summary")


def _small(grains: float | None, study: Study) -> Iterator[Caution]:
    if grains and grains < FEW_GRAINS and not issubclass(study.scene.kind, PlacedScene):
        yield Caution(say("caution.small", few=FEW_GRAINS), "summary")


def _unlikely(study: Study) -> Iterator[Caution]:
    for doubt in study.doubts():
        yield Caution(f"{capital(doubt).rstrip('.')}.", "summary")


def _softened(study: Study) -> Iterator[Caution]:
    if study.numerics.modulus_scale != 1.0:
        yield Caution(say("caution.softened"), "provenance")


def _open_region(campaign: Campaign, study: Study) -> Iterator[Caution]:
    optimum = campaign.optimum
    if optimum is None:
        return
    if not optimum.region.mask.any():
        yield Caution(say("caution.nothing_agrees"), "optimum")
    elif optimum.unidentified:
        names = enumeration(f"{study.labels[name]} ({name})" for name in optimum.unidentified)
        what = "These responses leave" if optimum.joint else "The target alone leaves"
        cure = say("caution.several_leave_open" if optimum.joint else "caution.one_leaves_open")
        share = fixed(100.0 * optimum.region.fraction, 0)
        yield Caution(say("caution.wide_region", share=share, what=what, names=names, cure=cure), "optimum")


def _disagreement(campaign: Campaign, study: Study) -> Iterator[Caution]:
    for check in campaign.optimum.direct if campaign.optimum else ():
        if check.apart:
            yield Caution(say("caution.disagreement", text=capital(disagreement_text(check))), "optimum")


def _poor_surface(campaign: Campaign, study: Study) -> Iterator[Caution]:
    if campaign.surface is None:
        return
    for name, found in campaign.surface.responses.items():
        fit = found.reduced
        predicted, adjusted = fit.r2_predicted, fit.r2_adjusted
        if predicted < POOR_PREDICTION or adjusted - predicted > PREDICTION_GAP:
            numbers = {"predicted": fixed(predicted, 2), "adjusted": fixed(adjusted, 2)}
            yield Caution(say("caution.poor_prediction", name=name, **numbers), "surface")
        if found.full.anova["p"]["lack of fit"] < study.campaign.surface.lack_of_fit_alpha:
            yield Caution(say("caution.lack_of_fit", name=name), "surface")


def _beyond_ranges(campaign: Campaign, study: Study) -> Iterator[Caution]:
    if campaign.optimum is None:
        return
    for factor in study.factors:
        value = campaign.optimum.point.get(factor.name, factor.center)
        if not factor.low <= value <= factor.high:
            label = study.labels[factor.name]
            yield Caution(say("caution.beyond", label=label, name=factor.name), "factors")


def _thin_target(campaign: Campaign, study: Study) -> Iterator[Caution]:
    for name, sample in (campaign.target.responses if campaign.target else {}).items():
        if sample.n < FEW_MEASUREMENTS:
            yield Caution(say("caution.thin_target", name=name, few=FEW_MEASUREMENTS), "target")
    for direct in campaign.direct:
        if direct.measured.df < FEW_MEASUREMENTS - 1:
            yield Caution(say("caution.thin_target", name=direct.title, few=FEW_MEASUREMENTS), "target")


def _wide_margin(campaign: Campaign, study: Study) -> Iterator[Caution]:
    if campaign.verification is None or campaign.target is None:
        return
    for name, test in campaign.verification.responses.items():
        aim = abs(campaign.target.responses[name].mean)
        if test.equivalent and (test.margin or 0.0) > WIDE_MARGIN * aim:
            share = fixed(100.0 * WIDE_MARGIN, 0)
            yield Caution(say("caution.wide_margin", name=name, share=share), "verification")


def _failed(campaign: Campaign, study: Study) -> Iterator[Caution]:
    if lost := len(campaign.failed_cases):
        yield Caution(say("caution.failed", lost=lost, s="s" if lost == 1 else ""), "failed")


_RULES: tuple[Callable[[Campaign, Study], Iterator[Caution]], ...] = (
    _twin,
    _heaps,
    _filling,
    _open_region,
    _disagreement,
    _poor_surface,
    lambda campaign, study: _softened(study),
    _wide_margin,
    _thin_target,
    _beyond_ranges,
    _failed,
)
