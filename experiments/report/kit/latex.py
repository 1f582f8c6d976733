"""Texts and tables for a paper in LaTeX (packages booktabs and the standard fonts)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType

from markupsafe import Markup

from experiments.report.kit.table import Table

SIGNS: Mapping[str, str] = MappingProxyType(
    {
        "\\": r"\textbackslash{}",
        **{sign: f"\\{sign}" for sign in "&%$#_{}"},
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "<": "$<$",
        ">": "$>$",
        "°": r"$^\circ$",
        "±": r"$\pm$",
        "−": "$-$",
        "×": r"$\times$",
        "·": r"$\cdot$",
        "²": "$^2$",
        "³": "$^3$",
        "–": "--",
        "“": "``",
        "”": "''",
        "\u00a0": "~",
        "\u202f": r"\,",
    }
)
"""Signs, as LaTeX writes them."""

_SIGN = re.compile("|".join(re.escape(sign) for sign in SIGNS))


def latex_text(text: str) -> str:
    """Write a text so that LaTeX prints it as it stands."""
    return _SIGN.sub(lambda found: SIGNS[found[0]], text)


def latex_table(table: Table, label: str) -> str:
    """Write a table as a float with booktabs; its note stands below it."""
    heads = [
        f"{column.head} [{column.unit}]" if column.unit else str(column.head) for column in table.columns
    ]
    rows = [[Markup(cell.text).striptags() for cell in row.cells] for row in table.rows]
    aligned = "".join("l" if column.kind == "text" else "r" for column in table.columns)
    lines = [
        r"\begin{table}",
        r"  \centering",
        rf"  \caption{{{latex_text(table.caption)}}}",
        rf"  \label{{tab:{label}}}",
        rf"  \begin{{tabular}}{{{aligned}}}",
        r"    \toprule",
        _line(heads),
        r"    \midrule",
        *(_line(row) for row in rows),
        r"    \bottomrule",
        r"  \end{tabular}",
        *([rf"  \par\smallskip {latex_text(table.note)}"] if table.note else []),
        r"\end{table}",
    ]
    return "\n".join(lines) + "\n"


def _line(cells: list[str]) -> str:
    return f"    {' & '.join(map(latex_text, cells))} \\\\"
