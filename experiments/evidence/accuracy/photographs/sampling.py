"""Photographs with a heap, drawn at random: one seed, one picture with its truth."""

from dataclasses import dataclass, replace

import numpy as np

from experiments.evidence.accuracy.photographs.phone_camera import PhoneCamera
from experiments.evidence.accuracy.photographs.photographed_heaps import GrainHeap
from experiments.evidence.accuracy.photographs.rendering import Color, Lamp, Phone, Surroundings, Top, render
from imaging import ReposeAngle, find_outline, measure, silhouette
from imaging.geometry import FloatArray, Picture

LEAST_CONTRAST = 45.0
"""Distance of the grains' colour from the wall's and the table's [of 255] below which a person hesitates."""
SETTINGS = ("sheet", "table", "board")
"""An even sheet without an edge; a table from border to border; a board that ends in the picture."""


@dataclass(frozen=True)
class Photograph:
    """A drawn photograph."""

    picture: Picture
    truth: ReposeAngle
    """Angle of the same grains' exact outline, seen level and from afar."""
    setting: str
    """One of `SETTINGS`."""
    camera: PhoneCamera
    heap: GrainHeap
    shadow: float
    """Share of the light that the cast shadow lacks."""


def photograph(seed: int) -> Photograph:
    """Draw the photograph of a seed: always the same for the same seed."""
    return _shot(np.random.default_rng([21, seed]), seed)


def photograph_in_hard_light(seed: int) -> Photograph:
    """Draw a photograph whose heap casts a sharp shadow on the near wall and the plate, next to a flank."""
    return _shot(np.random.default_rng([22, seed]), seed, hard=True)


def photograph_of_a_low_heap(seed: int) -> Photograph:
    """Draw a photograph whose heap has 6 to 15 degrees."""
    return _shot(np.random.default_rng([23, seed]), seed, low=True)


def _shot(rng: np.random.Generator, seed: int, hard: bool = False, low: bool = False) -> Photograph:
    heap = _heap(rng)
    if low:
        heap = replace(heap, angle=float(rng.uniform(6.0, 15.0)))
    setting = str(rng.choice(SETTINGS, p=(0.35, 0.4, 0.25)))
    camera = _camera(rng, heap)
    around = _surroundings(rng, setting)
    if hard:
        behind = rng.uniform(1.1, 2.0)
        top = replace(around.top, far=min(around.top.far, behind))
        around = replace(around, wall_distance=behind, top=top)
        lamp = _hard_lamp(rng, heap, behind)
    else:
        lamp = _lamp(rng)
    phone = Phone(
        blur=rng.uniform(0.4, 1.4),
        noise=rng.uniform(0.5, 6.0),
        sharpening=float(rng.choice([0.0, 0.3, 0.8])),
        quality=int(rng.integers(60, 96)),
    )
    spheres = heap.spheres(seed)
    picture = render(spheres, heap.height, around, lamp, camera, phone, seed)
    return Photograph(picture, true_angle(*spheres), setting, camera, heap, lamp.shadow)


def true_angle(centers: FloatArray, radii: FloatArray) -> ReposeAngle:
    """Angle of the grains' exact outline, seen level and from afar."""
    exact = silhouette(centers, radii, pixels=800)
    return measure(find_outline(exact.image, exact.ground_row, place="exact outline"))


def _heap(rng: np.random.Generator) -> GrainHeap:
    powder = rng.uniform() < 0.2
    return GrainHeap(
        angle=float(rng.triangular(14.0, 30.0, 44.0)),
        lean=float(np.clip(rng.normal(0.0, 1.0), -2.5, 2.5)),
        rounding=rng.uniform(0.02, 0.25),
        grain=0.035 if powder else float(rng.uniform(0.035, 0.09)),
        jitter=0.0 if powder else float(rng.uniform(0.05, 0.2)),
        strays=int(rng.choice([0, 0, 3, 10])),
    )


def _camera(rng: np.random.Generator, heap: GrainHeap) -> PhoneCamera:
    columns = int(rng.choice([800, 1000, 1200, 1600], p=(0.3, 0.35, 0.25, 0.1)))
    upright = rng.uniform() < 0.15
    kind = rng.uniform()
    if kind < 0.6:
        elevation = abs(rng.normal(0.0, 1.5))
    else:
        elevation = rng.uniform(1.0, 6.0) if kind < 0.9 else rng.uniform(6.0, 14.0)
    return PhoneCamera(
        columns=columns,
        rows=round(columns * (1.2 if upright else 0.72)),
        distance=float(np.exp(rng.uniform(np.log(6.0), np.log(25.0)))),
        elevation=float(elevation),
        share=rng.uniform(0.4, 0.72),
        tilt=float(np.clip(rng.normal(0.0, 1.5), -6.0, 6.0)),
        middle=(rng.uniform(-0.06, 0.06), rng.uniform(0.0, 0.12)),
        height=rng.uniform(0.1, 0.9) * heap.height,
        bulge=rng.uniform(-0.03, 0.03),
    )


def _surroundings(rng: np.random.Generator, setting: str) -> Surroundings:
    for _ in range(1000):
        wall, table = _plain(rng), _plain(rng)
        grain = _grain(rng)
        if setting == "sheet":
            table = wall
        around = Surroundings(
            wall=wall,
            table=table,
            front=_scaled(table, rng.uniform(0.5, 0.95)),
            grain=grain,
            spread=rng.uniform(0.05, 0.22),
            texture=float(rng.choice([0.0, 0.01, 0.03])),
        )
        if min(_distance(grain, wall), _distance(grain, table)) < LEAST_CONTRAST:
            continue
        if setting == "sheet":
            return replace(around, top=Top(near=30.0, far=4.0, thickness=1.0), front=wall)
        if _distance(wall, table) < 15.0:
            continue
        if setting == "table":
            return replace(around, top=Top(near=rng.uniform(1.3, 4.0), far=rng.uniform(1.2, 3.0)))
        return replace(around, top=Top(*rng.uniform([1.2, 1.1, 1.1, 0.06], [1.7, 1.5, 1.5, 0.25])))
    raise RuntimeError("colours of enough contrast are common")


def _lamp(rng: np.random.Generator) -> Lamp:
    height, turn = np.radians(rng.uniform(30.0, 80.0)), rng.uniform(0.0, 2.0 * np.pi)
    across, away = np.cos(height) * np.cos(turn), np.cos(height) * np.sin(turn)
    return Lamp(
        direction=(float(across), float(away), float(np.sin(height))),
        shadow=float(rng.choice([0.0, 0.15, 0.3, 0.5])),
        softness=rng.uniform(0.03, 0.3),
        shade=rng.uniform(0.1, 0.5),
        uneven=float(rng.normal(0.0, 0.15)),
    )


def _hard_lamp(rng: np.random.Generator, heap: GrainHeap, behind: float) -> Lamp:
    """One or two flashes or bare bulbs, each throwing the tip's shadow on the wall next to the heap."""
    tip = np.array([0.0, 0.0, heap.height])
    side = float(rng.choice([-1.0, 1.0]))
    places = []
    for turned in (side, -side)[: 1 + int(rng.uniform() < 0.25)]:
        aside, level = turned * rng.uniform(0.1, 0.8), rng.uniform(0.4, 1.2)
        back = tip - np.array([aside, behind, level * heap.height])
        place = tip + np.exp(rng.uniform(np.log(3.0), np.log(20.0))) * back / np.linalg.norm(back)
        places.append((float(place[0]), float(place[1]), max(float(place[2]), 0.1)))
    lacks = rng.uniform(0.2, 0.7)
    blue, green, red = lacks * (rng.uniform(0.0, 0.08) * rng.uniform(-1.0, 1.0, 3))
    across, away, up = np.array(places[0]) / np.linalg.norm(places[0])
    return Lamp(
        direction=(float(across), float(away), float(up)),
        shadow=float(lacks),
        softness=rng.uniform(0.0, 0.02),
        shade=rng.uniform(0.1, 0.5),
        uneven=float(rng.normal(0.0, 0.15)),
        near=tuple(places),
        cast=(float(blue), float(green), float(red)),
    )


def _plain(rng: np.random.Generator) -> Color:
    """Colour of a wall, a sheet or a table: mostly pale, sometimes dark or coloured."""
    kind = rng.uniform()
    if kind < 0.6:
        level = rng.uniform(150.0, 245.0)
    else:
        level = rng.uniform(20.0, 110.0) if kind < 0.85 else rng.uniform(80.0, 190.0)
    saturation = 0.06 if kind < 0.85 else 0.35
    return _tinted(rng, level, saturation)


def _grain(rng: np.random.Generator) -> Color:
    """Colour of grains: straw, brown, grey, white, black, or bright plastic."""
    bases = [(95, 150, 190), (60, 95, 140), (130, 135, 140), (225, 230, 232), (45, 45, 48), (60, 110, 225)]
    base = bases[int(rng.integers(len(bases)))]
    shift = rng.normal(0.0, 12.0, 3)
    return _clipped(np.array(base) + shift)


def _tinted(rng: np.random.Generator, level: float, saturation: float) -> Color:
    return _clipped(level * (1.0 + saturation * rng.uniform(-1.0, 1.0, 3)))


def _clipped(color: FloatArray) -> Color:
    blue, green, red = np.clip(color, 5.0, 250.0)
    return float(blue), float(green), float(red)


def _scaled(color: Color, factor: float) -> Color:
    return _clipped(np.array(color) * factor)


def _distance(one: Color, other: Color) -> float:
    return float(np.linalg.norm(np.subtract(one, other)))
