"""Chapter of a campaign's page with the chosen values in the terms of other codes, to be entered there."""

from __future__ import annotations

from typing import Any

import pandas as pd

from dem_warp import Case
from experiments.calibrate.results import OptimumResult
from experiments.export import EXPORTERS, case_terms, term_warnings
from experiments.report.kit.html import Chapter
from experiments.report.kit.table import Layout, Table, columns, make_table
from experiments.report.sections import chapter
from experiments.studyfile import Study

NAME = "other_codes"


def other_codes_chapter(study: Study, optimum: OptimumResult) -> Chapter:
    """Build the chapter of the values at the chosen point, for every code that they can be exported to."""
    case = study.case(optimum.settings, 1)
    tables = {"terms": _terms_table(case)}
    if warnings := [(EXPORTERS[name].code, text) for name in EXPORTERS for text in term_warnings(name, case)]:
        frame = pd.DataFrame(warnings, columns=["code", "lacking"])
        heads: Layout = ["code", *columns(lacking="what it has not got, and what stands for it")]
        tables["lacking"] = make_table("codes-lack", frame, heads, "Not the same there.")
    return chapter(NAME, tables)


def _terms_table(case: Case[Any]) -> Table:
    rows = [
        {"code": EXPORTERS[name].code, "subject": subject, "name": term.name, "value": f"{term.value:.6g}"}
        | {"unit": "" if term.unit == "1" else term.unit, "formula": term.formula}
        for name in EXPORTERS
        for subject, term in case_terms(name, case)
    ]
    heads = columns(subject="of", name="name there", value="value", formula="formula")
    shown: Layout = ["code", *heads[:3], "unit", heads[3]]
    return make_table("codes", pd.DataFrame(rows), shown, "Values in the terms of other codes.")
