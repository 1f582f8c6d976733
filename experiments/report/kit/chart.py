"""Charts of a page: one look, and a plain form for plotly.js."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import plotly.graph_objects as go

from doe.plots.palette import GREEN, GRID, INK, MUTED

LANDSCAPE = "YlGnBu_r"
"""Colour scale of a response: even steps of lightness, also in grey print."""


@dataclass(frozen=True)
class Chart:
    """One chart of the page."""

    name: str
    """Its anchor in the page."""
    caption: str
    figure: go.Figure
    height: str = ""
    """"tall" or "low" where it takes more or less height than the usual."""
    columns: int = 0
    """Columns with a number each, which need more width than a phone has: it then scrolls in its box."""

    @property
    def json(self) -> str:
        """The figure for plotly.js, safe inside a script element."""
        return str(self.figure.to_json()).replace("</", "<\\/")


def new_figure(x: str = "", y: str = "", legend: bool = True) -> go.Figure:
    """Start an empty figure with axis titles."""
    lines = {"showline": True, "linecolor": MUTED, "gridcolor": GRID, "zeroline": False}
    axis = lines | {"ticks": "outside", "tickcolor": MUTED, "automargin": True}
    above = {"orientation": "h", "x": 0.0, "y": 1.0, "xanchor": "left", "yanchor": "bottom"}
    family = "system-ui, Segoe UI, Roboto, Helvetica, Arial, sans-serif"
    return go.Figure(
        # at once: update_layout takes fifteen times as long
        layout={
            "template": "none",
            "font": {"family": family, "size": 13, "color": INK},
            "paper_bgcolor": "rgba(0,0,0,0)",  # that of the page, light or dark
            "plot_bgcolor": "rgba(0,0,0,0)",
            "margin": {"l": 56, "r": 18, "t": 36 if legend else 14, "b": 48},
            "showlegend": legend,
            "legend": above | {"itemsizing": "constant"},
            "dragmode": False,  # a finger that scrolls the page must not zoom the chart
            "xaxis": axis | {"title": {"text": x, "standoff": 8}},
            "yaxis": axis | {"title": {"text": y, "standoff": 8}},
        }
    )


def add_points(
    figure: go.Figure,
    x: Any,
    y: Any,
    name: str,
    color: str,
    symbol: str = "circle",
    size: int = 9,
    **more: Any,
) -> None:
    """Draw points as one entry of the legend; `more` goes to plotly's scatter."""
    edge = {"width": 2, "color": color} if symbol.endswith("open") else {"width": 1, "color": "#ffffff"}
    marker = {"color": color, "symbol": symbol, "size": size, "line": edge}
    figure.add_scatter(x=x, y=y, name=name, marker=marker, **{"mode": "markers", **more})


def add_line(
    figure: go.Figure, x: Any, y: Any, name: str, color: str, dash: str = "solid", **more: Any
) -> None:
    """Draw a line as one entry of the legend; `more` goes to plotly's scatter."""
    figure.add_scatter(
        x=x, y=y, name=name, mode="lines", line={"color": color, "dash": dash, "width": 2}, **more
    )


def add_bars(figure: go.Figure, x: Any, y: Any, name: str, color: str, hover: str, **more: Any) -> None:
    """Draw bars as one entry of the legend; `more` goes to plotly's bar."""
    figure.add_bar(
        x=x, y=y, name=name, marker={"color": color}, hovertemplate=f"{hover}<extra></extra>", **more
    )


def add_target(figure: go.Figure, mean: float, reach: float) -> None:
    """Draw the target across a figure whose y axis is the angle: its mean, and a band of +- `reach`."""
    figure.add_hrect(
        y0=mean - reach, y1=mean + reach, fillcolor=GREEN, opacity=0.13, line_width=0, layer="below"
    )
    figure.add_hline(y=mean, line={"color": GREEN, "width": 2})
