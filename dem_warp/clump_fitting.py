"""Fill a grain's contour with inscribed spheres: chosen greedily, exchanged, and moved to cover more."""

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
import warp as wp
from numpy.typing import NDArray

from dem_warp.clumps import ClumpShape
from dem_warp.device import resolve_device
from dem_warp.kernels.mesh_depth import mesh_depth
from dem_warp.parameters import Parameter
from dem_warp.sphere_union import Array

if TYPE_CHECKING:
    from trimesh import Trimesh

Cover = NDArray[np.bool_]

_CANDIDATES = 1500  # approximate number of candidates for centres: the exchange takes some seconds
_CHUNK = 256  # candidates at once, to limit the memory
_MAX_SWEEPS = 100
_SURFACE_POINTS = 4000
_STEPS = np.array([step for step in product((-1.0, 0.0, 1.0), repeat=3) if any(step)])


@dataclass(frozen=True)
class ClumpFit:
    """A clump and the quality of its fit to a solid."""

    shape: ClumpShape
    """The clump."""
    solid_volume: float
    """Volume of the solid [m3]."""
    coverage: float
    """Part of the solid's volume inside the spheres, 0 to 1."""
    overshoot: float
    """Volume of the spheres outside the solid over the solid's volume."""
    inertia_error: float
    """Largest relative error of the sorted principal moments of inertia over the mass."""
    surface_distance: float
    """Root mean square distance of the solid's surface from that of the spheres [m]."""
    spheres: Array
    """Centre and radius of each sphere [m] in the solid's frame, shape (S, 4)."""

    @property
    def volume_error(self) -> float:
        return self.shape.volume / self.solid_volume - 1.0


def fit_clump(solid: "Trimesh", sphere_count: int, protrusion: float = 0.0, resolution: int = 40) -> ClumpFit:
    """Fill a closed surface [m] with spheres that cover much of its volume.

    Each sphere in turn covers the most of the remaining volume. Then spheres are exchanged and moved, with
    radii from the distance to the surface, as long as the covered volume grows. Nothing is random.

    Parameters
    ----------
    sphere_count
        Number of spheres; there are fewer if more would cover nothing new.
    protrusion
        Largest distance of a sphere's surface outside the solid [m]: sharp edges are covered better.
    resolution
        Samples along the longest side. Coverage and overshoot have errors of about 1 / resolution^1.5.
    """
    _check_request(solid, sphere_count, protrusion, resolution)
    surface = _Surface(solid)
    samples, depths, spacing = _sample_box(surface, resolution, protrusion / surface.extent)
    inside = depths > 0.0
    filling = _Filling(surface, samples[inside], protrusion / surface.extent)
    centers = filling.pick(_thinned(samples[inside], spacing), sphere_count)
    centers = filling.settle(centers, first_step=spacing, last_step=0.1 * spacing)
    centers = filling.prune(centers)
    radii = filling.radii(centers)
    covered: Cover = np.logical_or.reduce(_within(samples, centers, radii))
    spheres = np.column_stack([centers * surface.extent + surface.origin, radii * surface.extent])
    shape = ClumpShape.from_spheres(spheres[:, :3], spheres[:, 3])
    return ClumpFit(
        shape=shape,
        solid_volume=float(solid.volume),
        coverage=float(covered[inside].mean()),
        overshoot=float(covered[~inside].sum() / inside.sum()),
        inertia_error=_inertia_error(solid, shape),
        surface_distance=_surface_distance(solid, spheres),
        spheres=spheres,
    )


def _inertia_error(solid: "Trimesh", shape: ClumpShape) -> float:
    """Return the largest relative error of the sorted principal moments over the mass."""
    wanted = np.sort(np.linalg.eigvalsh(np.asarray(solid.moment_inertia))) / solid.volume
    return float(np.abs(np.sort(shape.inertia_over_mass) / wanted - 1.0).max())


def _surface_distance(solid: "Trimesh", spheres: Array) -> float:
    """Return the root mean square distance of fixed points of the solid's surface from the spheres'."""
    import trimesh

    points, _ = trimesh.sample.sample_surface(solid, _SURFACE_POINTS, seed=1)
    apart = np.linalg.norm(points[:, None] - spheres[None, :, :3], axis=2) - spheres[None, :, 3]
    return float(np.sqrt((np.min(apart, axis=1) ** 2).mean()))


class _Surface:
    """Signed distance to a closed surface, in units of its longest side from the corner of its box."""

    def __init__(self, solid: "Trimesh") -> None:
        self._device = resolve_device("cpu")
        self.origin = np.array(solid.bounds[0])
        self.extent = float(np.ptp(solid.bounds, axis=0).max())
        self.box = np.ptp(solid.bounds, axis=0) / self.extent
        points = (np.asarray(solid.vertices) - self.origin) / self.extent
        self._mesh = wp.Mesh(
            points=wp.array(points, dtype=wp.vec3, device=self._device),
            indices=wp.array(np.asarray(solid.faces).ravel(), dtype=wp.int32, device=self._device),
            support_winding_number=True,
        )

    def depth(self, points: Array) -> Array:
        """Return the distance of points (N, 3) to the surface, positive inside."""
        depths = wp.empty(len(points), dtype=wp.float32, device=self._device)
        queries: wp.array = wp.array(points, dtype=wp.vec3, device=self._device)
        wp.launch(mesh_depth, len(points), [self._mesh.id, queries], [depths], device=self._device)
        return depths.numpy().astype(np.float64)


class _Filling:
    """The samples of a solid and the spheres that cover them."""

    def __init__(self, surface: _Surface, samples: Array, protrusion: float) -> None:
        self._surface = surface
        self._samples = samples
        self._protrusion = protrusion

    def radii(self, centers: Array) -> Array:
        """Return the largest radii within the protrusion; 0 for a centre outside the solid."""
        depths = self._surface.depth(centers)
        return np.where(depths > 0.0, depths + self._protrusion, 0.0)

    def cover(self, centers: Array) -> Cover:
        """Mark the samples that each sphere covers, shape (S, N)."""
        return _within(self._samples, centers, self.radii(centers))

    def pick(self, candidates: Array, sphere_count: int) -> Array:
        """Choose centres greedily, each for the most uncovered samples, then exchange them one by one."""
        chunks = np.split(candidates, range(_CHUNK, len(candidates), _CHUNK))
        covers = np.concatenate([self.cover(chunk) for chunk in chunks])
        chosen: list[int] = []
        for _ in range(sphere_count):
            chosen.append(_best_cover(covers, chosen)[0])
        for _ in range(_MAX_SWEEPS):
            before = list(chosen)
            for index, old in enumerate(chosen):
                others = chosen[:index] + chosen[index + 1 :]
                new, gain = _best_cover(covers, others)
                if gain > _own_gain(covers[old], covers[others]):
                    chosen[index] = new
            if chosen == before:
                break
        return candidates[chosen]

    def settle(self, centers: Array, first_step: float, last_step: float) -> Array:
        """Move centres to neighbouring points while that covers more, with ever smaller steps."""
        centers, covers = centers.copy(), self.cover(centers)
        step = first_step
        for _ in range(_MAX_SWEEPS):
            moved = False
            for index in range(len(centers)):
                others = np.delete(covers, index, axis=0)
                trials = centers[index] + step * _STEPS
                trial_covers = self.cover(trials)
                gains = [_own_gain(cover, others) for cover in trial_covers]
                best = int(np.argmax(gains))
                if gains[best] > _own_gain(covers[index], others):
                    centers[index], covers[index], moved = trials[best], trial_covers[best], True
            step = step if moved else 0.5 * step
            if step < last_step:
                break
        return centers

    def prune(self, centers: Array) -> Array:
        """Remove the spheres that cover nothing alone, the smallest first."""
        for center in centers[np.argsort(self.radii(centers), kind="stable")]:
            rest = centers[(centers != center).any(axis=1)]
            if len(rest) and _own_gain(self.cover(center[None])[0], self.cover(rest)) == 0:
                centers = rest
        return centers


def _best_cover(covers: Cover, chosen: list[int]) -> tuple[int, int]:
    """Return the candidate that covers most samples besides those chosen, and their number."""
    open_samples = ~covers[chosen].any(axis=0)
    gains = np.count_nonzero(covers[:, open_samples], axis=1)
    best = int(gains.argmax())
    return best, int(gains[best])


def _own_gain(cover: Cover, others: Cover) -> int:
    """Return the number of samples that one sphere covers alone."""
    return int(np.count_nonzero(cover & ~others.any(axis=0)))


def _within(samples: Array, centers: Array, radii: Array) -> Cover:
    """Mark the samples inside each sphere, shape (S, N)."""
    squared = (samples**2).sum(axis=1) - 2.0 * centers @ samples.T + (centers**2).sum(axis=1)[:, None]
    return squared < (radii**2)[:, None]


def _sample_box(surface: _Surface, resolution: int, margin: float) -> tuple[Array, Array, float]:
    """Return the cell centres of a grid over the solid's box and a margin, their depths, and the spacing."""
    spacing = 1.0 / resolution
    counts = np.ceil((surface.box + 2.0 * margin) / spacing).astype(int)
    lowest = np.floor(-margin / spacing)
    axes = [(np.arange(count + 1) + lowest + 0.5) * spacing for count in counts]
    samples = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return samples, surface.depth(samples), spacing


def _thinned(samples: Array, spacing: float) -> Array:
    """Return every n-th sample along each axis: about `_CANDIDATES`."""
    stride = max(1, round((len(samples) / _CANDIDATES) ** (1.0 / 3.0)))
    cells = np.rint(samples / spacing - 0.5).astype(int)
    return samples[(cells % stride == stride // 2).all(axis=1)]


def _check_request(solid: "Trimesh", sphere_count: int, protrusion: float, resolution: int) -> None:
    if not solid.is_watertight or solid.volume <= 0.0:
        rule = "must be a closed surface with faces turned outward"
        raise ValueError(f"solid: {rule}, got volume {solid.volume:.3g} m3")
    Parameter("1", at_least=1).check("sphere_count", sphere_count)
    Parameter("1", at_least=8).check("resolution", resolution)
    Parameter("m", at_least=0.0).check("protrusion", protrusion)
