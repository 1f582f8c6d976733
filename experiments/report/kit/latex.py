"""Texts and tables for a paper in LaTeX (packages booktabs and the standard fonts)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType

import pandas as pd
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
        "≤": r"$\leq$",
        "≥": r"$\geq$",
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
    """Write a text so that LaTeX prints it unchanged."""
    return _SIGN.sub(lambda found: SIGNS[found[0]], text)


def latex_table(table: Table, label: str) -> str:
    """Write a table as a float with booktabs, with its note below it."""
    heads = [
        f"{column.head} [{column.unit}]" if column.unit else str(column.head) for column in table.columns
    ]
    rows = [[latex_text(Markup(cell.text).striptags()) for cell in row.cells] for row in table.rows]
    text: str = pd.DataFrame(rows, columns=list(map(latex_text, heads))).to_latex(
        index=False,
        escape=False,
        caption=latex_text(table.caption),
        label=f"tab:{label}",
        column_format="".join("l" if column.kind == "text" else "r" for column in table.columns),
    )
    note = f"\\par\\smallskip {latex_text(table.note)}\n" if table.note else ""
    return text.replace("\\end{table}", f"{note}\\end{{table}}").replace(
        "\\begin{table}", "\\begin{table}\n\\centering"
    )
