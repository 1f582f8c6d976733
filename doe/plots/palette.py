"""Colours of every figure, chart and page: Okabe and Ito's, which colour-blind readers can distinguish."""

BLUE, VERMILION, ORANGE, SKY = "#0072B2", "#D55E00", "#E69F00", "#56B4E9"
GREEN, PURPLE = "#00795a", "#b0578d"
"""Darker than the original pair, for thin lines."""

INK, MUTED, GRID = "#1c2430", "#5d6673", "#eceff3"
"""Text, quiet text, and the lines behind curves."""

SERIES = (
    BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, MUTED, INK, "#8c6d31", "#a05195", "#999999",
)  # fmt: skip
"""Colours of curves in their order."""
