"""Profiles as a few responses: the directions in which the factors move them most, over their own scatter.

A profile comes as many numbers that scatter together: its measured modes, or in a twin study its heights.
Each of these as a response would be tested at a level of its own, most of them on noise. The screening tells
how the factors move them, and the canonical directions (`doe.ProfileSample.canonical`), no more than factors
that can be kept, hold what generalised least squares takes from the profile.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np
import pandas as pd

from doe import Design, Mode, ProfileSample, Sample
from doe.errors import RuleError
from experiments.calibrate.cases import measured, too_many_failed
from experiments.calibrate.screening_stage import analyse_screening
from experiments.studyfile import Study
from experiments.studyfile.campaign import Response, Target


def with_directions(
    study: Study, design: Design, screening: pd.DataFrame, hidden: Sequence[pd.DataFrame]
) -> tuple[Study, dict[str, Sample]]:
    """Put directions in place of the parts of every profile that takes part in the fit.

    Parameters
    ----------
    design, screening
        The screening design, and its cases.
    hidden
        Cases of a twin study's target; else empty.

    Returns
    -------
    study
        The same study with fewer responses; as it was where it has no profile.
    samples
        Of a twin study, what the directions' targets are, by name.
    """
    target, parts = study.target, defaultdict(list)
    for response in target.fitted:
        if response.part_of:
            parts[response.part_of].append(response)
    if not parts:
        return study, {}
    placed: dict[str, list[Response]] = {}
    samples: dict[str, Sample] = {}
    for name, responses in parts.items():
        modes = _directions(study, design, screening, hidden, responses)
        placed[name] = [_response(name, number, mode, responses) for number, mode in enumerate(modes, 1)]
        if target.twin is not None:
            samples |= {
                response.name: mode.target for response, mode in zip(placed[name], modes, strict=True)
            }
    chosen: list[Response] = []
    for response in target.responses:
        if response.held_out or not response.part_of:
            chosen.append(response)
        else:
            chosen += placed.pop(response.part_of, [])
    return study.with_target(Target(tuple(chosen), target.twin)), samples


def _directions(
    study: Study,
    design: Design,
    screening: pd.DataFrame,
    hidden: Sequence[pd.DataFrame],
    responses: Sequence[Response],
) -> tuple[Mode, ...]:
    """Directions of a profile, their weights over its responses."""
    screened = analyse_screening(design, screening, responses).responses
    slopes = [found.screen.coded_coefficients.iloc[1:].to_numpy() for found in screened.values()]
    settings = study.campaign.selection
    count = len(settings.keep) if settings.keep else settings.at_most
    stage = "target" if hidden else "screening"
    try:
        return _sample(responses, hidden).canonical(np.array(slopes), count)
    except RuleError as error:
        cases = hidden[0] if hidden else screening
        raise too_many_failed(cases, stage, f"cannot be analysed ({error})", responses[0]) from error


def _sample(responses: Sequence[Response], hidden: Sequence[pd.DataFrame]) -> ProfileSample:
    """Profiles over the responses that they are made of: measured ones, or those of hidden settings."""
    if not hidden:
        found = [response.measured for response in responses if response.measured is not None]
        mean, spread = np.array([each.mean for each in found]), np.array([each.sd for each in found])
        profiles = np.array([response.measurements for response in responses]).T
        return ProfileSample(mean, np.diag(spread**2), found[0].n, 0.0, profiles)
    used = measured(hidden[0], responses[0])
    return ProfileSample.of(used[[response.observable for response in responses]].to_numpy())


def _response(name: str, number: int, mode: Mode, parts: Sequence[Response]) -> Response:
    """Response of a direction, its weights over the heights of the profile."""
    weights: dict[str, float] = defaultdict(float)
    for share, part in zip(mode.weights, parts, strict=True):
        for height, weight in part.weights or ((part.observable, 1.0),):
            weights[height] += float(share) * weight
    title, first = f"{name}_direction_{number}", parts[0]
    sample = None if first.measured is None else mode.target
    return Response(title, title, first.unit, first.scene, sample, False, tuple(weights.items()), name)
