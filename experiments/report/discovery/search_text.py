"""Methods paragraph and table of a search, to be pasted into a paper."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from doe.discrepancy import Discovery
from experiments.report.discovery.discovery_tables import parameters_table
from experiments.report.discovery.discovery_verdict import verdict_line
from experiments.report.discovery.terms import Terms
from experiments.report.kit.numbers import prose
from experiments.report.kit.sentences import say
from experiments.report.paper_text import Paste, pastes_of, simulated_sentences, software
from experiments.studyfile import Study


def search_pastes(found: Discovery, study: Study, terms: Terms, provenance: Mapping[str, Any]) -> list[Paste]:
    """Write paragraph and table in Markdown and in LaTeX; nothing without a fit."""
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
        say("methods.looked_for", software=software(provenance)),
        *simulated_sentences(study),
        say(
            "methods.fitted",
            means=means,
            observables=len(data.observables),
            conditions=len(data.conditions) - held_out,
            held_out=held_out or "no",
            were=" was" if held_out == 1 else "s were",
        ),
        say("methods.q"),
        say("methods.effects", count=len(effects)) if effects else "",
        say("methods.cases", count=found.effort.bank_cases + found.effort.fresh_cases),
        prose(verdict_line(found, terms)),
    ]
    return " ".join(sentence for sentence in sentences if sentence)
