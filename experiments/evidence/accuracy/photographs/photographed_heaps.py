"""Heaps of grains to be photographed: spheres on a plate, in units of the heap's radius."""

from dataclasses import dataclass

import numpy as np

from imaging.geometry import FloatArray

SURFACE_LAYERS = 3.0
"""Grains strewn on each grain's area of the surface, so that they hide what is below."""
DEPTH = 1.2
"""The strewn grains reach this many diameters below the surface."""


@dataclass(frozen=True)
class GrainHeap:
    """A cone of grains with a rounded tip, its left flank steeper or flatter than its right."""

    angle: float
    """Mean of both flanks below the rounding [degrees]."""
    lean: float = 0.0
    """Left flank less right flank [degrees]."""
    rounding: float = 0.1
    """Share of the radius that the cap at the tip covers."""
    grain: float = 0.05
    """Diameter of a grain."""
    jitter: float = 0.15
    """Standard deviation of the grains' height over the cone, in diameters."""
    strays: int = 0
    """Number of grains that lie around the heap."""

    @property
    def height(self) -> float:
        """Height of the cap over the plate."""
        return float(np.tan(np.radians(self.angle)) * (1.0 - 0.5 * self.rounding))

    def surface(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Height of the smooth heap over points of the plate; below zero around it."""
        radius = np.hypot(x, y)
        cosine = np.divide(x, radius, out=np.zeros_like(radius), where=radius > 0)
        slope = np.tan(np.radians(self.angle - 0.5 * self.lean * cosine))
        cap = max(self.rounding, 1e-6)
        # A parabola that leaves the cone without a kink at the cap's rim.
        fall = np.where(radius < cap, 0.5 * (radius**2 / cap + cap), radius)
        return np.asarray(slope * (1.0 - fall))

    def spheres(self, seed: int) -> tuple[FloatArray, FloatArray]:
        """Centres (n, 3) and radii (n,) of the grains, which a seed draws."""
        rng = np.random.default_rng(seed)
        steep = 1.0 / np.cos(np.radians(self.angle))
        count = int(SURFACE_LAYERS * 4.0 * steep / self.grain**2)
        radius, turn = np.sqrt(rng.uniform(0.0, 1.1, count)), rng.uniform(0.0, 2.0 * np.pi, count)
        x, y = radius * np.cos(turn), radius * np.sin(turn)
        depth = rng.uniform(0.0, DEPTH * self.grain * steep, count)
        depth -= rng.normal(0.0, self.jitter * self.grain, count)
        z = self.surface(x, y) - 0.5 * self.grain * steep - depth
        distance = rng.uniform(1.02, 1.35, self.strays)
        turn = rng.uniform(0.0, 2.0 * np.pi, self.strays)
        x, y = np.r_[x, distance * np.cos(turn)], np.r_[y, distance * np.sin(turn)]
        z = np.r_[z, np.full(self.strays, 0.4 * self.grain)]
        # Grains lie on the plate, not in it.
        kept = z > 0.1 * self.grain
        z = np.maximum(z, 0.45 * self.grain)
        sizes = 0.5 * self.grain * np.clip(rng.normal(1.0, 0.08, len(z)), 0.7, 1.3)
        return np.column_stack([x, y, z])[kept], sizes[kept]
