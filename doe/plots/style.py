"""Frames and keys of all figures."""

from collections.abc import Sequence

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

WIDTH = 6.3
"""Text width of an A4 page [inches]."""


def canvas(axes: Axes | None, height: float) -> tuple[Figure, Axes]:
    """Return the figure and axes to draw on: the given ones, or new ones of the page's width."""
    if axes is not None:
        figure = axes.get_figure(root=True)
        if figure is None:
            raise ValueError("axes must belong to a figure, got axes without one")
        return figure, axes
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    return figure, figure.subplots()


def key(figure: Figure, axes: Axes, given: bool, handles: Sequence[Artist], columns: int) -> None:
    """Draw a key: above the axes of a figure of its own, inside given axes."""
    if given:
        axes.legend(handles=handles, frameon=False, fontsize="small")
    else:
        figure.legend(handles=handles, frameon=False, loc="outside upper center", ncols=columns)


def plain(axes: Axes) -> None:
    """Remove the frame's upper and right line."""
    axes.spines[["top", "right"]].set_visible(False)
