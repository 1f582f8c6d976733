"""Draw the compatible region of a material: ``python docs/region_picture.py material.toml region.png``.

Nothing is simulated: a material card holds the runs of its response surface.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pandas as pd

from doe import Sample
from doe.plots import contour_plot
from experiments.io.toml_files import read_toml
from experiments.studyfile.card_surface import card_surfaces

WORDS = {"static_friction": "friction", "rolling_friction": "rolling friction", "restitution": "restitution"}


def in_words(parameter: str) -> str:
    """Name a parameter as an axis: ``rolling friction, grain-grain``."""
    *_, pair, name = parameter.split(".")
    return f"{WORDS.get(name, name)}, {pair}"


def main(card_file: Path, picture: Path) -> None:
    """Fit the card's surface again, and draw where it agrees with the measured angle."""
    _, card = read_toml(card_file)
    name, surface = next(iter(card_surfaces(card, card_file).items()))
    goal = card["fitted"]["response"][name]
    mean, sd = (float(str(goal[key]).split()[0]) for key in ("mean", "sd"))
    measured = Sample(mean, sd, int(goal["n"]))
    chosen = pd.Series({name: factor["chosen"] for name, factor in card["factor"].items()})
    figure = contour_plot(
        surface,
        measured.mean,
        chosen,
        surface.compatible_region(measured),
        response_label="repose angle [degrees]",
    )
    x, y = (card["factor"][name]["parameter"] for name in surface.design.names[:2])
    figure.axes[0].set(xlabel=in_words(x), ylabel=in_words(y))
    figure.savefig(picture, dpi=130)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
