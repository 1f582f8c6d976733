"""The responses beside the angle: in which scenes they are measured, and how a stage analyses each."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeVar

import pandas as pd

from experiments.calibrate.cases import scene_cases
from experiments.studyfile.campaign import TARGET_SCENE, Response

Found = TypeVar("Found")


def scenes_of(responses: Iterable[Response]) -> tuple[str, ...]:
    """Return the scenes that a campaign simulates: the target's, then the others in the order of use."""
    return tuple(dict.fromkeys([TARGET_SCENE, *(response.scene for response in responses)]))


def each_response(
    responses: Iterable[Response], cases: pd.DataFrame, analyse: Callable[[pd.DataFrame, str], Found]
) -> dict[str, Found]:
    """Analyse every response on the cases of its scene.

    Parameters
    ----------
    responses
        Responses beside the angle.
    cases
        Finished cases of a stage, of all scenes.
    analyse
        Takes the cases of one scene and the column of the observable.

    Returns
    -------
    dict
        What was found, by the name of the response.
    """
    return {
        response.name: analyse(scene_cases(cases, response.scene), response.observable)
        for response in responses
    }
