"""Methods paragraph and table of a search, to be pasted into a paper."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from doe.discrepancy import Discovery
from experiments.report.discovery.tables import parameters_table
from experiments.report.discovery.terms import Terms
from experiments.report.discovery.verdict import verdict_line
from experiments.report.kit.numbers import prose
from experiments.report.paper_text import Paste, pastes_of, simulated_sentences, software
from experiments.studyfile import Study


def search_pastes(found: Discovery, study: Study, terms: Terms, provenance: Mapping[str, Any]) -> list[Paste]:
    """Write paragraph and table in Markdown and in LaTeX; none where nothing could be fitted."""
    if found.base is None:
        return []
    paragraph = search_paragraph(found, study, terms, provenance)
    return pastes_of(paragraph, parameters_table(found, terms), "fitted-factors")


def search_paragraph(found: Discovery, study: Study, terms: Terms, provenance: Mapping[str, Any]) -> str:
    """Say how a missing effect was looked for, and what was found."""
    data = found.data
    held_out = sum(data.held_out)
    means = int(np.isfinite(data.means[~np.array(data.held_out)]).sum())
    effects = {name for candidate in found.candidates for name in candidate.mechanisms}
    sentences = [
        f"Effects that the model lacks were looked for with {software(provenance)}.",
        *simulated_sentences(study),
        f"The model was fitted to {means} means of {len(data.observables)} observables under "
        f"{len(data.conditions) - held_out} conditions; {held_out or 'no'} further "
        f"condition{' was' if held_out == 1 else 's were'} held out.",
        "The misfit Q is the sum of the squared residuals, each over its standard error; its limits come "
        "from a parametric bootstrap.",
        f"{len(effects)} effects were fitted in turn together with the factors." if effects else "",
        f"{found.effort.bank_cases + found.effort.fresh_cases} cases were simulated.",
        prose(verdict_line(found, terms)),
    ]
    return " ".join(sentence for sentence in sentences if sentence)
