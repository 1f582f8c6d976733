"""The curve of a press, stress against strain while a piston goes down and back, and what it gives."""

import numpy as np

from dem_warp.scenes.scene import Observable

SEATING = 0.01
"""Stress over the largest one at which the piston has taken its seat, and has come off again."""

LOADED, UNLOADED = (0.05, 0.1, 0.2, 0.5, 1.0), (0.5, 0.2, 0.1, 0.05)
"""Stresses over the largest one at which the strain is read while the piston goes down, and up."""

PRESS_OBSERVABLES = {
    "filled_mass": Observable("kg", "mass of the grains in the die"),
    "tapped_density": Observable(
        "kg/m^3",
        "mass of the grains over the die's volume up to their surface after the taps; absent without taps",
    ),
    "hausner_ratio": Observable("1", "tapped over poured density; absent without taps"),
    "pressed_density": Observable(
        "kg/m^3", "mass of the grains over the volume below the piston, at the largest stress"
    ),
    "modulus": Observable(
        "Pa",
        "slope of the stress over the strain between half of the largest stress and all of it; the strain is "
        "counted from the height at 1 % of the largest stress, the stress is the load on the piston over its "
        "area",
    ),
    "unloading_modulus": Observable("Pa", "the same slope while the piston goes back"),
    "rebound": Observable(
        "1", "part of the largest strain that comes back until 1 % of the largest stress is left"
    ),
    "base_share": Observable(
        "1", "load on the base over that on the piston at the turn, without the weight before the piston came"
    ),
} | {
    f"strain_{number}": Observable("1", f"strain at {100 * part:g} % of the largest stress, {way}")
    for number, (part, way) in enumerate(
        [(part, "loading") for part in LOADED] + [(part, "unloading") for part in UNLOADED], 1
    )
}
"""Observables of a compression."""

Curve = list[list[float]]
"""Points of a curve: stress [Pa], and height of the piston in any unit."""


def strains_of(curve: Curve, stress: float, turn: int | None = None, seat: float | None = None) -> np.ndarray:
    """Return the strains at the parts LOADED and UNLOADED of a stress [Pa].

    `turn` is the point where the piston turned back, by default that of the largest stress; `seat` is the
    height where it took its seat, by default that of the curve.
    """
    turn = int(np.argmax([point[0] for point in curve])) if turn is None else turn
    loading, unloading = curve[: turn + 1], curve[turn:]
    seat = crossing(SEATING * stress, loading, 1) if seat is None else seat
    heights = [crossing(part * stress, loading, 1) for part in LOADED[:-1]] + [curve[turn][1]]
    heights += [crossing(part * stress, unloading, -1) for part in UNLOADED]
    return 1 - np.array(heights) / seat


def crossing(stress: float, curve: Curve, way: int) -> float:
    """Return the height where a curve first crosses a stress [Pa], upwards (1) or downwards (-1)."""
    stresses, heights = np.array(curve).T
    beyond = np.append(way * stresses >= way * stress, True)
    last = min(int(np.argmax(beyond)), len(stresses) - 1)
    pair = [max(last - 1, 0), last][::way]
    return float(np.interp(stress, stresses[pair], heights[pair]))
