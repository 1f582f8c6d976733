"""Fresh cases that an analysis asks for, before its data are opened."""

from __future__ import annotations

from doe.discrepancy import Settings

_LIKELY_RIVALS = 2


def search_cases(settings: Settings, conditions: int) -> tuple[int, int]:
    """Cases that an analysis with a gap asks for: likely, and at the most.

    The base runs once around its optimum, its rivals in rounds that halve and in the finish, and so do
    pairs; at the end the base and the chosen model run side by side.
    """
    one_model = settings.refinement_points * settings.refinement_repeats * conditions
    rounds = [max(1, settings.shortlist >> number) for number in range(settings.refinement_rounds)]
    finish = settings.shortlist * settings.finish_points * settings.refinement_repeats * conditions
    most_rounds = (1 + 2 * sum(rounds)) * one_model + 2 * finish
    end = 2 * settings.direct_runs * conditions
    return (_LIKELY_RIVALS + 1) * one_model + end, most_rounds + end
