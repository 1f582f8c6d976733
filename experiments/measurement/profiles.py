"""Measured profiles as responses: heights over distance, with the covariance of their repeats."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from dem_warp import Drum
from dem_warp.scenes.drum_surface import STATIONS
from doe import ProfileSample
from doe.errors import RuleError
from experiments.errors import InputError
from experiments.rows import Row, read_rows
from experiments.studyfile import Study
from experiments.studyfile.campaign import TARGET_SCENE
from experiments.studyfile.units import Quantity

SURFACE = "surface"
"""Observable that profiles are of: that of a drum, at its stations."""

COLUMNS = ("replicate", "x", "z")
"""Columns of a file of profiles: a label of each, place from the axis and height above it, with units."""

LEAST_STATIONS = 3
"""Stations of a drum that all profiles must span."""


def with_profiles(study: Study) -> Study:
    """Put the independent directions of measured profiles in place of the responses that name files of them.

    Raises
    ------
    InputError
        When a file cannot be read or breaks a rule, or the test is no drum.
    """
    document = study.document
    tables = {"target": [document["target"]] if "target" in document else []}
    tables["response"] = list(document.get("response", []))
    if not any("profiles" in table for found in tables.values() for table in found):
        return study
    first, *others = [
        made
        for key, found in tables.items()
        for number, table in enumerate(found)
        for made in _made(study, table, f"{study.file}: {key}" + f"[{number + 1}]" * (key == "response"))
    ]
    left = {key: value for key, value in document.items() if key not in tables}
    return study.with_document(left | {"target": first} | ({"response": others} if others else {}))


def _made(study: Study, table: dict[str, Any], place: str) -> list[dict[str, Any]]:
    """Responses that a table stands for: itself, or the directions of its profiles."""
    if "profiles" not in table:
        return [table]
    if table.get("observable") != SURFACE:
        raise InputError(f'profiles are of the observable "{SURFACE}"', table.get("observable"), place)
    name = table.get("scene", TARGET_SCENE)
    scene = study.case({}, 0, name).scene
    if not isinstance(scene, Drum):
        raise InputError("profiles are those of a drum", scene.name, place)
    path = study.file.parent / table["profiles"]
    kept, heights = read_profiles(path, scene.diameter / 2)
    try:
        sample = ProfileSample.of(heights)
    except RuleError as error:
        raise InputError(f"profiles {error.rule}", error.value, str(path)) from None
    shared = {key: table[key] for key in ("scene", "note") if key in table}
    title = f"{SURFACE}_{name}".replace("-", "_") if name != TARGET_SCENE else SURFACE
    return [
        shared
        | {
            "observable": f"{title}_mode_{number}",
            "weights": {f"{SURFACE}_{kept[i] + 1}": float(w) for i, w in enumerate(mode.weights)},
            "mean": f"{mode.target.mean!r} m",
            "sd": f"{mode.target.sd!r} m",
            "n": mode.target.n,
        }
        for number, mode in enumerate(sample.modes, 1)
    ]


def read_profiles(path: Path, radius: float) -> tuple[list[int], np.ndarray]:
    """Read profiles of a drum of a radius [m], each with a label, as heights at its stations.

    Returns
    -------
    stations
        Numbers of the stations, from 0, that all profiles span.
    heights
        Heights above the axis there [m], shape (profiles, stations).

    Raises
    ------
    InputError
        When the file cannot be read, a point lies outside the drum, or the profiles span too few stations.
    """
    points: dict[str, dict[float, float]] = {}
    for row in read_rows(path, COLUMNS, COLUMNS):
        if not row["replicate"]:
            raise row.error("needs a label, one for each profile", "replicate")
        x, z = _length(row, "x"), _length(row, "z")
        if np.hypot(x, z) > radius:
            rule = f"must lie in the drum, within {1e3 * radius:g} mm of its axis"
            value = f"x {row['x']}, z {row['z']}"
            raise InputError(rule, value, f"{path}:{row.line}: x, z")
        profile = points.setdefault(row["replicate"], {})
        if x in profile:
            raise row.error("every place of a profile stands once", "x")
        profile[x] = z
    places = np.array(STATIONS) * radius
    ends = [(min(profile), max(profile)) for profile in points.values()] or [(0.0, 0.0)]
    low, high = max(end[0] for end in ends), min(end[1] for end in ends)
    kept = [number for number, place in enumerate(places) if low <= place <= high]
    if len(kept) < LEAST_STATIONS:
        told = f"{1e3 * low:.4g} to {1e3 * high:.4g} mm, {len(kept)} stations"
        raise InputError(f"all profiles must span {LEAST_STATIONS} stations of the drum", told, str(path))
    rows = [
        np.interp(places[kept], sorted(profile), [profile[x] for x in sorted(profile)])
        for profile in points.values()
    ]
    return kept, np.array(rows)


def _length(row: Row, column: str) -> float:
    try:
        return Quantity.parse(row[column]).to_base("length")
    except ValueError as error:
        raise row.error(str(error), column) from None
