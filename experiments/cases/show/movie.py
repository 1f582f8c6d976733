"""Film of a simulated case, to look at: its grains, its walls and the time."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dem_warp import Film
from experiments.cases.show.frames import wall_triangles
from experiments.io.errors import InputError
from experiments.io.files import replacing
from imaging.drawing.film import Scenery, save_film

NO_MOVIE = "none"
MOVIES = ("gif", "mp4", NO_MOVIE)
"""Kinds of films, the default first."""

MARGIN = 1.1
"""Room around what is shown."""

STRAYS = 0.02
"""Part of the last frame's spheres that may be outside the picture."""

PICTURE_TIME = 0.08
"""Time that each frame is shown [s]; its own time is written in the picture."""


def require_movie(kind: str | None, frames: int | None) -> None:
    """Raise InputError for an unknown kind of film, and for a film without frames."""
    if kind is None:
        return
    if frames is None:
        raise InputError("--movie", "a film is made of frames", kind, "Add --frames N.")
    if kind not in MOVIES:
        raise InputError("--movie", f"must be one of {', '.join(MOVIES)}", kind)


def write_movie(film: Film, path: Path) -> None:
    """Write the frames of a case as a film, GIF or MP4 by its ending."""
    scenery = _scenery(film)
    pictures = []
    for frame in film.frames:
        centers, radii, rows = film.spheres(frame)
        # an endless plate is the ground that the scenery draws
        ends = [number for number, wall in enumerate(film.walls) if np.isfinite(wall.reach)]
        walls = [wall_triangles(film, frame, number, 0.0) for number in ends]
        text = f"{frame.time:.2f} s, {frame.phase}"
        pictures.append(scenery.draw(centers, radii, frame.grains[rows], walls, text))
    with replacing(path) as temporary:
        save_film(temporary, pictures, PICTURE_TIME)


def _scenery(film: Film) -> Scenery:
    """Return the part of space that holds the walls at the start and the grains at the end."""
    first, last = film.frames[0], film.frames[-1]
    centers, radii, _ = film.spheres(last)
    corners = [
        wall_triangles(film, first, number, 0.0).reshape(-1, 3)
        for number, wall in enumerate(film.walls)
        if np.isfinite(wall.reach)
    ]
    walls = np.concatenate([np.zeros((1, 3)), *corners])
    reach = np.hypot(centers[:, 0], centers[:, 1]) + radii
    wide = float(np.quantile(reach, 1.0 - STRAYS)) if len(reach) else 0.0
    high = float((centers[:, 2] + radii).max(initial=0.0))
    return Scenery(
        half_width=MARGIN * max(wide, float(np.abs(walls[:, 0]).max())),
        height=MARGIN * max(high, float(walls[:, 2].max())),
    )
