"""Colours of pages in light and in dark: names for the style sheet, and those of charts in the dark."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from doe.plots import palette

LIGHT: Mapping[str, str] = MappingProxyType(
    {
        "paper": "#ffffff",
        "ink": palette.INK,
        "muted": palette.MUTED,
        "line": "#d5dae1",
        "grid": palette.GRID,
        "wash": "#f5f7f9",
        "mark": "#e3eff7",
        "held": "#e3e6ea",
        "blue": palette.BLUE,
        "green": palette.GREEN,
        "vermilion": palette.VERMILION,
        "amber": "#8a5200",
        "red": "#b3261e",
    }
)
"""Colours by their name in the style sheet; texts have a contrast of 4.5 at least on paper, wash and mark."""

DARK: Mapping[str, str] = MappingProxyType(
    {
        "paper": "#14181f",
        "ink": "#e6e9ee",
        "muted": "#a3adba",
        "line": "#39424f",
        "grid": "#2a323d",
        "wash": "#1c222b",
        "mark": "#1d3448",
        "held": "#323b47",
        "blue": "#6cb6f0",
        "green": "#3fc79c",
        "vermilion": "#ff8a4c",
        "amber": "#e2a84b",
        "red": "#ff8a80",
    }
)
"""The same in the dark."""

DIVERGING = ("#b35806", "#fdb863", "#f7f7f7", "#92c5de", "#2166ac")
"""Orange below, blue above: even steps of lightness, distinguished by colour-blind readers."""

_DARK_DIVERGING = ("#f5a04a", "#9c5a17", "#262c35", "#2c6a94", "#6fb7f0")

_OF_CHARTS = {palette.ORANGE: "#f0b429", palette.SKY: "#8fd0f5", palette.PURPLE: "#e08fc0"}

DARK_CHARTS: Mapping[str, str] = MappingProxyType(
    {
        **{light.lower(): DARK[name] for name, light in LIGHT.items()},
        **{light.lower(): dark for light, dark in _OF_CHARTS.items()},
        "#9aa3af": "#6b7686",
        "#dfe3e8": "#39424f",
        **dict(zip(DIVERGING, _DARK_DIVERGING, strict=True)),
    }
)
"""Colour of a chart in the dark, by its colour in the light (``#rrggbb``, small letters)."""
