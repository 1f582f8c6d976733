"""The study with the missing mechanism added: a study file that the next calibration starts from."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from doe import Sample
from doe.discrepancy import Candidate, Data, Discovery, Fit, Interval, Verdict
from experiments.io.files import write_text
from experiments.io.texts import safe_text
from experiments.io.toml_files import toml_text
from experiments.measurement.measured_target import Replicated, target_sections
from experiments.report.clump_files import gather_clumps
from experiments.report.discovery.discovery_verdict import tied
from experiments.report.discovery.terms import Terms
from experiments.studyfile import Study
from experiments.studyfile.mechanism_factor import MechanismFactor, with_mechanisms

HEAD = """\
# Written by dem-warp discover: {name}, with {title} added as a factor that ranges over its 90 % interval.
# All that was measured more than once is to be matched; held-out conditions only judge.
# Run it with  dem-warp calibrate {file}
# Study that it was found in: {study}

"""

DIGITS = 4
"""Significant digits of the ends of a range."""

LEAST_SEEN = 0.5
"""Share of a direction that a camera sees at the least where a study is to match it."""


def write_study_files(found: Discovery, study: Study, terms: Terms, folder: Path) -> list[Path]:
    """Write a study file for each model that the verdict leaves possible, with its clumps.

    A tie gives a file ``study-with-NAME.toml`` a mechanism, a pair one file, nothing named none.
    """
    written = []
    for candidate, heading in _standing(found):
        added = {terms.mechanisms[name]: size for name, size in candidate}
        document = extended_document(study, added, found.data, heading)
        gather_clumps(document, study.file.parent, folder)
        path = folder / f"study-with-{'-and-'.join(name for name, _ in candidate)}.toml"
        title = terms.titles(name for name, _ in candidate)
        head = HEAD.format(
            name=safe_text(study.name), title=safe_text(title), file=path.name, study=study.sha256
        )
        write_text(path, head + toml_text(document))
        written.append(path)
    return written


def extended_document(
    study: Study, added: Mapping[MechanismFactor, Interval], data: Data, heading: float | None = None
) -> dict[str, Any]:
    """Add mechanisms to a study's document, each as a factor that ranges over its interval.

    Every observable that was measured more than once under a condition is to be matched; what was measured
    under a held-out condition only judges. In the study a mechanism with a direction has the azimuth 0: what
    counts along it is taken to there from its `heading` [deg], where the camera saw half of it or more.
    """
    ranges = {mechanism.name: _range(mechanism, size) for mechanism, size in added.items()}
    extended = with_mechanisms(study, list(added), ranges)
    seen = {one.name: math.cos(math.radians((heading or 0.0) - one.camera)) for one in study.conditions}
    directed = [each.name for each in study.measurable if each.directed]
    target, responses = target_sections(study, _replicated(data, directed, seen))
    return (extended.with_responses(target, responses) if target else extended).document


def _standing(found: Discovery) -> list[tuple[list[tuple[str, Interval]], float | None]]:
    models: list[Candidate | Fit] = [found.chosen] if found.chosen else []
    if found.verdict is Verdict.TIE:
        models = [*tied(found)]
    return [(list(zip(model.mechanisms, model.sizes, strict=True)), model.heading) for model in models]


def _range(mechanism: MechanismFactor, size: Interval) -> tuple[float, float]:
    low, high = (float(f"{end:.{DIGITS}g}") for end in (size.low, size.high))
    low, high = max(low, mechanism.null), min(high, mechanism.maximum)
    return (low, high) if low < high else (mechanism.null, mechanism.maximum)


def _replicated(data: Data, directed: Sequence[str], seen: Mapping[str, float]) -> Iterator[Replicated]:
    """Every mean of more than one measurement, with the scatter that the analysis gave it.

    By condition, so much is seen of what has a direction; less than `LEAST_SEEN` of it is left out.
    """
    for row, condition in enumerate(data.conditions):
        for column, observable in enumerate(data.observables):
            read = (data.means, data.standard_errors, data.replicates)
            mean, se, count = (table[row, column] for table in read)
            share = seen.get(condition, 1.0) if observable in directed else 1.0
            if count >= 2 and np.isfinite(se) and se > 0.0 and abs(share) >= LEAST_SEEN:
                mean, se = mean / share, se / abs(share)
                mean, sd = (float(f"{value:.6g}") for value in (mean, se * np.sqrt(count)))
                yield Replicated(condition, observable, Sample(mean, sd, int(count)))
