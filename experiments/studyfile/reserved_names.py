"""Names that no factor may have: columns of the tables of factors."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Sequence

from doe.design.factors import RESERVED_NAMES
from experiments.io.errors import Problem, StudyError
from experiments.studyfile.observables import observables_of
from experiments.studyfile.places import Places
from experiments.studyfile.scene_sections import SceneSection

LABELS = ("stage", "scene", "run", "replicate", "seed", "step", "piece", "direction", "response", "published")
"""Columns that say which case, step or response a row is of."""

RESULTS = ("status", "reason", "angle", "angle_se", "case_key", "rebuilds")
"""Columns that every table of cases gets, with the observables of its scene."""

STATISTICS = ("predicted", "mean", "sd", "n", "error", "error_percent", "span")
"""Columns of paths and directions."""

DUMMY = "dummy"
"""Idle columns of screening designs, numbered."""

_DERIVED = re.compile(r"(_coded|(?<!\d)\d+)$|_\d+$")
"""Ending of a column that is made from another: of a factor's coded values, or a number."""

RESERVED = frozenset({*LABELS, *RESULTS, *STATISTICS, *RESERVED_NAMES})
"""Names that are taken whatever the study measures."""


def check_factor_names(
    names: Sequence[str],
    places: Places,
    scenes: Iterable[SceneSection] = (),
    responses: Collection[str] = (),
) -> None:
    """Refuse factors that are named like a column of the tables, also of these scenes and responses."""
    measured = {name for scene in scenes for name in observables_of(scene.observables, scene.leaves_a_heap)}
    taken = RESERVED | measured | set(responses)
    problems = list(_problems(names, taken, places))
    if problems:
        raise StudyError.of(problems)


def _problems(names: Sequence[str], taken: Collection[str], places: Places) -> Iterator[Problem]:
    for index, name in enumerate(names):
        base = _DERIVED.sub("", name)
        derived = base != name and (
            base in taken or base == DUMMY or (name == f"{base}_coded" and base in names)
        )
        if name in taken or derived:
            place, problem = places.of(("factor", index, "name")), "is a column of the results' tables"
            yield Problem(place, problem, repr(name), "Choose another name, e.g. E or friction.")
