"""Pictures of drums with known surfaces, by two scripts that share no code with the reader.

One draws areas with NumPy, the other every grain as a disc with Pillow.
"""

from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw, ImageFilter

from dem_warp.scenes.drum_surface import DrumView, half_chord, level_of, surface_angles, surface_heights

FINE = 0.003
"""Half of the distance of the points that fill a bed whose truth the simulator's definitions give [radii]."""
MILLIMETRES = 42.0
"""Radius of the drum [mm]."""


@dataclass(frozen=True)
class DrawnDrum:
    """A picture of a drum, and its truth."""

    picture: np.ndarray
    kind: str
    circle: tuple[float, float, float]
    angle: float
    heights: np.ndarray
    filling: float


class Bed:
    """A bed whose surface is flat, S-shaped or curved, with waves; high on the left, in radii."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.shape = str(rng.choice(["flat", "S", "curved"]))
        self.tilt = np.radians(rng.uniform(15.0, 55.0))
        self.level = rng.uniform(-0.45, 0.1)
        self.bend = {"flat": 0.0, "S": rng.uniform(0.1, 0.3), "curved": rng.uniform(-0.25, 0.25)}[self.shape]
        self.waves = rng.uniform(0.0, 0.01, 4), rng.uniform(0.0, 6.3, 4), rng.uniform(5.0, 25.0, 4)

    def height(self, along: np.ndarray) -> np.ndarray:
        """Height of the surface in the frame in which its line is level."""
        size, phase, number = self.waves
        curve = self.bend * (along**2 if self.shape == "curved" else along * (along**2 - 0.6))
        return self.level + curve + (size * np.sin(np.multiply.outer(along, number) + phase)).sum(axis=-1)

    def below(self, x: np.ndarray, z: np.ndarray, lower: float = 0.0) -> np.ndarray:
        """Distance of points below the surface, along its frame's vertical."""
        cosine, sine = np.cos(self.tilt), np.sin(self.tilt)
        return self.height(x * cosine - z * sine) - lower - (x * sine + z * cosine)

    def truth(self) -> tuple[float, np.ndarray, float]:
        """Dynamic angle [degrees], heights at the stations and filling by the simulator's definitions."""
        grid = np.arange(-1.0 + FINE, 1.0, 2.0 * FINE)
        x, z = (value.ravel() for value in np.meshgrid(grid, grid))
        inside = np.hypot(x, z) < 1.0
        bed = inside & (self.below(x, z) > 0.0)
        points = np.column_stack([x, 0.0 * x, z])[bed]
        filling = float(bed.sum() / inside.sum())
        chord, view = half_chord(level_of(filling, 1.0), 1.0), DrumView(1.0, 1.0)
        angles = surface_angles(points, chord, FINE, view)
        heights = surface_heights(points, chord, FINE, view)
        if angles is None or heights is None:
            raise ValueError("the drawn bed must have a surface")
        return angles.dynamic_angle, heights, filling


def draw(seed: int) -> DrawnDrum:
    """Draw a drum: of even seeds as areas, of odd ones grain by grain."""
    rng = np.random.default_rng(seed)
    bed, size = Bed(rng), int(rng.integers(300, 900))
    radius = size * rng.uniform(0.36, 0.47)
    circle = (size / 2 + rng.uniform(-10, 10), size / 2 + rng.uniform(-10, 10), radius)
    angle, heights, filling = bed.truth()
    side = int(rng.choice([-1, 1]))
    kind, picture = (_grains if seed % 2 else _areas)(rng, bed, size, circle, side)
    if rng.random() < 0.15:
        kind, picture = f"{kind}, cut below", picture[: int(circle[1] + rng.uniform(0.75, 0.9) * radius)]
    return DrawnDrum(picture, f"{bed.shape}, {kind}", circle, angle, heights, filling)


def _areas(
    rng: np.random.Generator, bed: Bed, size: int, circle: tuple[float, float, float], side: int
) -> tuple[str, np.ndarray]:
    """Colour areas: bed, free part, rim and surroundings, the surface sharp or averaged over time."""
    rows, columns = (np.mgrid[0 : 3 * size, 0 : 3 * size] + 0.5) / 3 - 0.5
    x, z = side * (columns - circle[0]) / circle[2], (circle[1] - rows) / circle[2]
    away, soft = np.hypot(x, z), rng.choice([0.0, 0.01, 0.03])
    share = np.clip(0.5 + bed.below(x, z) / max(6.0 * soft, 1e-3), 0.0, 1.0)
    dark, light = rng.uniform(20, 90), rng.uniform(150, 230)
    grain, free = (dark, light) if rng.random() < 0.5 else (light, dark)
    grainy = Image.fromarray(rng.normal(size=(size, size)).astype(np.float32))
    speckle = np.asarray(grainy.resize(rows.shape))
    drum = free + share * (grain * (1.0 + rng.uniform(0.0, 0.2) * speckle) - free)
    width, rim = rng.uniform(0.0, 0.06), rng.uniform(0, 255)
    outside = rng.uniform(0, 60) if rng.random() < 0.5 else rng.uniform(190, 255)
    picture = np.where(away < 1.0, drum, np.where(away < 1.0 + width, rim, outside))
    for turn in rng.uniform(0.0, 2.0 * np.pi, int(rng.integers(0, 5))):  # screws
        screw = np.hypot(x - (1.03 + width) * np.cos(turn), z - (1.03 + width) * np.sin(turn)) < 0.025
        picture = np.where(screw, 255.0 - outside, picture)
    picture = picture * (1.0 + rng.uniform(0.0, 0.2) * (columns / size - 0.5))
    small = picture.reshape(size, 3, size, 3).mean(axis=(1, 3)) + rng.normal(0, 4, (size, size))
    image = Image.fromarray(np.clip(small, 0, 255).astype(np.uint8)).convert("RGB")
    if rng.random() < 0.3:
        ImageDraw.Draw(image).text((8, 8), "30 rpm  t = 12.4 s", fill=(255, 160, 0), font_size=size // 24)
    return "averaged" if soft else "one look", np.asarray(image)


def _grains(
    rng: np.random.Generator, bed: Bed, size: int, circle: tuple[float, float, float], side: int
) -> tuple[str, np.ndarray]:
    """Draw the grains as discs, three times as large, with gaps of light at the shell and a few flying."""
    fine, grain = 3 * size, rng.uniform(0.008, 0.02)
    column, row, radius = (3 * (circle[0] + 0.5) - 0.5, 3 * (circle[1] + 0.5) - 0.5, 3 * circle[2])
    back = tuple(int(value) for value in rng.uniform(160, 240, 3))
    around = tuple(int(value) for value in rng.uniform(0, 255, 3))
    image = Image.new("RGB", (fine, fine), around)
    pen = ImageDraw.Draw(image)

    def disc(x: float, z: float, reach: float, color: tuple[int, ...]) -> None:
        across, down, half = column + side * x * radius, row - z * radius, reach * radius
        pen.ellipse((across - half, down - half, across + half, down + half), fill=color)

    disc(0.0, 0.0, 1.0 + rng.uniform(0.01, 0.05), tuple(int(value) for value in rng.uniform(40, 255, 3)))
    disc(0.0, 0.0, 1.0, back)
    places = rng.uniform(-1.0, 1.0, (int(16.0 / grain**2), 2))
    places = places[np.hypot(*places.T) < 1.0 - grain]
    below = bed.below(places[:, 0], places[:, 1])
    flying = places[(below < -0.1) & (rng.random(len(places)) < 4e-4)]
    # grains up to the surface: their tops are at it
    bedded = places[below > grain / np.cos(np.arctan(0.2))]
    color = rng.uniform(10, 120, 3)
    for x, z in np.vstack([bedded, flying]):
        disc(x, z, grain, tuple(int(value) for value in color * rng.uniform(0.75, 1.25)))
    small = image.resize((size, size), Image.Resampling.BOX).filter(ImageFilter.GaussianBlur(0.6))
    return "grains", np.asarray(small)
