"""Chapter of a campaign's page with the chosen values in the terms of other codes, to be entered there."""

from __future__ import annotations

import logging
from typing import Any

import pandas as pd

from dem_warp import Case
from experiments.export import EXPORTERS, case_terms, term_warnings
from experiments.io.errors import InputError
from experiments.report.kit.html import Chapter
from experiments.report.kit.table import Layout, Table, columns, make_table
from experiments.report.sections import chapter

_log = logging.getLogger(__name__)

NAME = "other_codes"


def other_codes_chapter(case: Case[Any]) -> Chapter:
    """Build the chapter of a case's values, a table for every code that they can go to.

    An exporter that fails is left out, with a warning.
    """
    tables = {}
    for name, exporter in EXPORTERS.items():
        try:
            tables[exporter.code] = _terms_table(name, case)
        except InputError as error:
            _log.warning("%s; it is not in the report", error)
    return chapter(NAME, tables)


def _terms_table(name: str, case: Case[Any]) -> Table:
    rows = [
        {"subject": subject, "name": term.name, "value": f"{term.value:.6g}"}
        | {"unit": "" if term.unit == "1" else term.unit, "formula": term.formula}
        for subject, term in case_terms(name, case)
    ]
    heads = columns(subject="of", name="name there", value="value", formula="formula")
    shown: Layout = [*heads[:3], "unit", heads[3]]
    lacking = ". ".join(text.rstrip(".") for text in term_warnings(name, case))
    note = f"Not the same there: {lacking}." if lacking else ""
    caption = f"Values in the terms of {EXPORTERS[name].code}."
    return make_table(f"code-{name}", pd.DataFrame(rows), shown, caption, note)
