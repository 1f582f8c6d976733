"""Colours of pages: every text is read on every ground, in light and in dark."""

import numpy as np
import pytest

from doe.plots import palette
from experiments.report.kit.theme import DARK, DARK_CHARTS, LIGHT


def luminance(color: str) -> float:
    """Relative luminance as WCAG 2.2 defines it."""
    parts = np.array([int(color[place : place + 2], 16) / 255.0 for place in (1, 3, 5)])
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def contrast(one: str, other: str) -> float:
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("theme", [LIGHT, DARK], ids=["light", "dark"])
@pytest.mark.parametrize("text", ["ink", "muted", "blue", "green", "amber", "red"])
def test_every_text_is_read_on_paper_and_wash(theme: dict[str, str], text: str) -> None:
    # WCAG 2.2, 1.4.3: 4.5 for texts.
    assert min(contrast(theme[text], theme[ground]) for ground in ("paper", "wash")) >= 4.5


def test_every_colour_of_a_chart_has_one_that_is_seen_in_the_dark() -> None:
    curves = (palette.BLUE, palette.VERMILION, palette.ORANGE, palette.SKY, palette.GREEN, palette.PURPLE)
    for color in (*curves, palette.INK, palette.MUTED):
        # WCAG 2.2, 1.4.11: 3 for what a figure is made of.
        assert contrast(DARK_CHARTS[color.lower()], DARK["paper"]) >= 3.0
