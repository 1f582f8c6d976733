"""Figures of Markdown pages (matplotlib): one look, and the same bytes for the same data."""

from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from doe.plots.palette import GRID
from experiments.io.files import replacing


def new_axes(width: float = 7.2, height: float = 4.2, grid: str | None = "both") -> tuple[Figure, Axes]:
    """Start a figure of one pair of axes [inches].

    A grid of "both", "x" or "y" draws lines behind the data; None neither lines nor a frame.
    """
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.subplots()
    if grid is None:
        axes.spines[:].set_visible(False)
        return figure, axes
    axes.grid(axis=grid, color=GRID)  # type: ignore[arg-type]
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    return figure, axes


def save_figure(figure: Figure, path: Path, dpi: int = 110) -> None:
    """Write a figure as PNG, whole or not at all, without the name of the program that drew it."""
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=dpi, metadata={"Software": None})
