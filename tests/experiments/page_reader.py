"""A page taken apart, for the tests of reports."""

import json
from html.parser import HTMLParser

import numpy as np

VOID = {"meta", "link", "img", "br"}
"""Elements that have no end tag."""


class Page(HTMLParser):
    """A page taken apart: ids, links, tables by id, charts by name, and whether its tags match."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.links: list[str] = []
        self.tables: dict[str, list[list[tuple[str, float | None]]]] = {}
        self.heads: dict[str, list[str]] = {}
        self.charts: dict[str, dict] = {}
        self.text = ""
        self.mismatches: list[str] = []
        self._open: list[str] = []
        self._script: dict[str, str | None] | None = None
        self._table = ""
        self._cell: list[str] | None = None
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        named = dict(attributes)
        if tag not in VOID:
            self._open.append(tag)
        self.ids += [named["id"]] if named.get("id") else []
        self.links += [str(named[key]) for key in ("href", "src") if key in named]
        if tag == "script":
            self._script = named
        elif tag == "table":
            self._table = str(named.get("id", ""))
            self.tables[self._table], self.heads[self._table] = [], []
        elif tag == "tr":
            self.tables[self._table].append([])
        elif tag in ("td", "th"):
            self._cell = []
            value = named.get("data-value")
            self._value = float(value) if value is not None else None

    def handle_endtag(self, tag: str) -> None:
        if not self._open or self._open.pop() != tag:
            self.mismatches.append(tag)
        if tag == "script":
            self._script = None
        elif tag in ("td", "th") and self._cell is not None:
            text = "".join(self._cell)
            if tag == "td":
                self.tables[self._table][-1].append((text, self._value))
            else:
                self.heads[self._table].append(text)
            self._cell = None

    def handle_data(self, data: str) -> None:
        if self._script is not None:
            if "data-plot" in self._script:
                self.charts[str(self._script["data-plot"])] = json.loads(data)
            return
        if self._cell is not None:
            self._cell.append(data)
        if "style" not in self._open:
            self.text += data

    def rows(self, name: str) -> list[list[tuple[str, float | None]]]:
        """Rows of a table's body."""
        return [row for row in self.tables[f"table-{name}"] if row]

    def values(self, name: str) -> np.ndarray:
        """Numbers of a table, row by row; a row's text cells are left out, missing numbers are NaN."""
        numeric = [
            [value for text, value in row if value is not None or text == "–"] for row in self.rows(name)
        ]
        return np.array(numeric, dtype=np.float64)
