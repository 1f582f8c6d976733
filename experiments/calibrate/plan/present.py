"""Knowledge before the next test: surfaces, measured responses, settings drawn where they agree."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from doe import Design, DesignError, Factor, FactorSurface, Goal, Sample, StatedValue, fit_surface, joint_fit
from doe.response.quadratic import FittedSurface
from experiments.calibrate.cases import failure_summary, measured
from experiments.calibrate.values import p_text
from experiments.io.errors import StudyError
from experiments.io.units import Quantity
from experiments.studyfile.campaign import Direct, Response, SurfaceSettings
from experiments.studyfile.candidate_section import Error
from experiments.studyfile.card_surface import card_surfaces

TRUTHS, SEED = 200, 57
"""Settings that are drawn from the region, and the seed of that."""

LEAST_BOX = 0.25
"""Least half-range of the design of a plan, as a share of what was explored: slopes need room."""

SCENE_MODEL, EXACT = Error(0.02), Error(0.0)
"""Assumed error of the model in a scene; that of a direct reading is in its surface."""

Key = tuple[str, str]
"""Scene and observable of a response; of a direct reading ``""`` and its factor."""


@dataclass(frozen=True, eq=False)
class Known:
    """A measured response, and the error of its model besides that of the surface."""

    surface: FittedSurface
    measured: Sample
    model: Error = SCENE_MODEL


@dataclass(frozen=True, eq=False)
class Present:
    """Measured responses, and settings that agree with all of them, in the coding of what was explored."""

    factors: tuple[Factor, ...]
    extent: float
    """Coded half width of the box explored."""
    known: Mapping[Key, Known]
    truths: NDArray[np.float64]
    """Settings drawn, coded, shape (truths, factors)."""
    share: float
    """Share of what was explored that agrees; 0: nothing does, and the settings are from all of it."""

    @classmethod
    def of(cls, factors: tuple[Factor, ...], known: Mapping[Key, Known]) -> Present:
        """Draw settings from where all that is known agrees; from the box where nothing is known."""
        rng = np.random.default_rng(SEED)
        if not known:
            return cls(factors, 1.0, known, rng.uniform(-1.0, 1.0, (TRUTHS, len(factors))), 1.0)
        joint = joint_fit({" ".join(key): Goal(one.surface, one.measured) for key, one in known.items()})
        region = joint.region()
        cells = joint.cells[region.mask if region.mask.any() else joint.explored]
        drawn = cells[rng.integers(len(cells), size=TRUTHS)]
        drawn = drawn + joint.extent / joint.resolution * rng.uniform(-1.0, 1.0, drawn.shape)
        return cls(factors, joint.extent, known, drawn, region.fraction)

    @property
    def half_ranges(self) -> NDArray[np.float64]:
        """Natural units in a coded unit of each factor."""
        return np.array([factor.half_range for factor in self.factors])

    @property
    def natural(self) -> NDArray[np.float64]:
        """The settings drawn, in natural units."""
        return np.array([factor.center for factor in self.factors]) + self.truths * self.half_ranges

    def box(self, limits: Mapping[str, tuple[float, float]]) -> tuple[Factor, ...]:
        """Return the factors of a design over the region, inside the hard limits."""
        low, high = self.truths.min(axis=0), self.truths.max(axis=0)
        half = np.maximum((high - low) / 2.0, LEAST_BOX * self.extent)
        ends = zip(self.factors, (low + high) / 2.0 - half, (low + high) / 2.0 + half, strict=True)
        inside = {f: np.clip(f.to_natural(np.array(two)), *limits[f.name]) for f, *two in ends}
        return tuple(Factor(f.name, float(first), float(last), f.unit) for f, (first, last) in inside.items())


def known_here(
    surfaces: Mapping[Key, FittedSurface],
    responses: Sequence[Response],
    read: Sequence[Direct],
    design: Design,
) -> dict[Key, Known]:
    """Return what a study has measured, as far as there are surfaces over a design."""
    samples = {(one.scene, one.observable): one.measured for one in responses}
    known = {
        key: Known(surfaces[key], sample) for key, sample in samples.items() if sample and key in surfaces
    }
    return known | {
        ("", one.factor): Known(FactorSurface(design, one.factor, one.model_sd), one.measured, EXACT)
        for one in read
        if one.factor in design.names
    }


def present_of(card: Mapping[str, Any], place: Path) -> Present:
    """Return what a finished campaign knows, by its card; StudyError where it holds no surface."""
    surfaces, fitted = card_surfaces(card, place), card.get("fitted", {})
    if fitted and not surfaces:
        problem = "holds no surface: its campaign's design had a cheaper scale, or a bridge corrected it"
        raise StudyError(str(place), problem, hint="The report of the campaign has the next test.")
    try:
        design = next(iter(surfaces.values())).design
        responses = [
            Response(name, facts["observable"], scene=facts["scene"], measured=_sample(facts))
            for name, facts in fitted["response"].items()
        ]
        own = {(one.scene, one.observable): surfaces[one.name] for one in responses if one.name in surfaces}
        read = [
            Direct(
                name, facts["factor"], _sample(facts), Quantity.parse(facts["model_sd"]).number, facts["by"]
            )
            for name, facts in fitted.get("direct", {}).items()
        ]
        return Present.of(design.factors, known_here(own, responses, read, design))
    except (DesignError, KeyError, StopIteration, ValueError) as error:
        problem = f"is not the card of a finished campaign ({type(error).__name__}: {error})"
        raise StudyError(str(place), problem) from None


def _sample(facts: Mapping[str, Any]) -> Sample:
    mean, sd = (Quantity.parse(facts[name]).number for name in ("mean", "sd"))
    return Sample(mean, sd, facts["n"]) if facts["n"] > 1 else StatedValue(mean, sd)


def fit_responses(
    design: Design, cases: pd.DataFrame, responses: Sequence[Response], settings: SurfaceSettings
) -> tuple[dict[Key, FittedSurface], dict[str, str]]:
    """Fit every response over the cases of one design; the level of lack of fit is shared among them.

    Returns
    -------
    surfaces
        Reduced surfaces.
    unjudged
        Reasons by the names of responses that have no surface that holds.
    """
    surfaces: dict[Key, FittedSurface] = {}
    unjudged = {}
    for response in responses:
        used = measured(cases, response)
        try:
            full = fit_surface(
                design.select(used["run"].tolist()), used[response.observable].to_numpy(np.float64)
            )
        except DesignError as error:
            why = failure_summary(cases, response) or "no case failed"
            unjudged[response.name] = f"{why}; its surface cannot be fitted: {error}"
            continue
        p = float(full.anova["p"]["lack of fit"])
        if p < settings.lack_of_fit_alpha / len(responses):
            unjudged[response.name] = (
                f"a quadratic does not fit it over the region (lack of fit, {p_text(p)})"
            )
        else:
            surfaces[response.scene, response.observable] = full.reduce(settings.reduce_alpha)
    return surfaces, unjudged
