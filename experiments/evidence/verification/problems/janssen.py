"""Spheres in a tube that is drawn slowly upwards: what floor and wall carry, against Janssen."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from dem_warp import ClumpShape, Material, rayleigh_time
from dem_warp.model import WorldSetup
from dem_warp.solver import CHUNK, Solver
from dem_warp.walls import Cylinder, Motion, Plane
from experiments.evidence.verification.check import (
    Curve,
    Plot,
    Result,
    Row,
    absolute_row,
    detection_row,
    relative_row,
)
from experiments.evidence.verification.problems.setups import GRAVITY, STEEL, bodies, contact, downhill, world

GLASS = Material(density=2500.0, shear_modulus=1e6, poisson_ratio=0.25)
"""Material as heavy as glass, so soft that a second takes 17,000 steps; overlaps stay below a hundredth."""

SPHERE = ClumpShape.sphere(1.5e-3)
FRICTION, WALL_FRICTION = 0.5, 0.2
TUBES = (8, 12)
"""Inner diameters, in mean sphere diameters."""

SLENDERNESS = 2.5
"""Height of the column over its diameter, were its solid fraction 0.6."""

SEEDS = 2
SETTLING = 0.35
"""Time in which the spheres fall and come to rest [s]."""

SPEED = 10e-3
"""Speed of the tube [m/s]."""

PULL = 0.6
"""Time for which it is drawn [s]; loads are means over the second half of it."""

TUBE = 1
SLICES = 12

TEXT = f"""Spheres of 3 mm, sizes within 10 %, fall into a tube with a floor. Then the tube is drawn upwards
at {1e3 * SPEED:g} mm/s while the floor stays, so that all contacts on the wall come to slide in one
direction. That is what Janssen assumes (H. A. Janssen, Zeitschrift des Vereines Deutscher Ingenieure 39
(1895) 1045-1049); his law holds for a wall that moves as well (Y. Bertho, F. Giorgiutti-Dauphine and J.-P.
Hulin, Physical Review Letters 90 (2003) 144301). The tubes are {TUBES[0]} and {TUBES[1]} sphere diameters
wide, {SEEDS} columns each.

Loads on the floor, and horizontal ones on the wall, follow from the overlaps by Hertz. The wall carries
what the floor does not; that, over the friction coefficient times the horizontal load on the wall, is how
far friction is mobilised: 1 where every contact slides downwards. The tube comes to that within one sphere
diameter (second plot); loads are means over the second half of its path.

Janssen has one constant, K: horizontal stress at the wall over mean vertical stress. It follows from the
load on the floor, F = W (1 - exp(-x)) / x with x = 4 K H tan(phi_w) / D, tan(phi_w) being the friction that
is mobilised. It must be the same in both tubes, agree with what the stresses themselves say in the middle
half of the column, and lie between Rankine's limits, (1 - sin phi) / (1 + sin phi) and its reciprocal,
tan(phi) = {FRICTION} being the friction of sphere on sphere."""


@dataclass(frozen=True)
class Loads:
    """Loads on the boundaries of a column."""

    diameter: float
    height: float
    weight: float
    """Height and weight of the column [m], [N]; the height is twice that of its centre of mass."""
    path: np.ndarray
    """Path of the tube so far [m], shape (samples,)."""
    floor: np.ndarray
    wall: np.ndarray
    """Vertical load on the floor and horizontal load on the wall [N], shape (samples,)."""
    depth: np.ndarray
    vertical: np.ndarray
    horizontal: np.ndarray
    """Depth below the top [m], and there the mean vertical stress, and the horizontal one at the wall
    [Pa]; by slices, means over the second half of the path."""

    @property
    def mobilised(self) -> np.ndarray:
        """Friction on the wall over the largest there can be, along the path."""
        return (self.weight - self.floor) / (WALL_FRICTION * self.wall)

    @property
    def share(self) -> float:
        """Part of the weight that the floor carries."""
        return float(_late(self.floor).mean()) / self.weight

    @property
    def wall_friction(self) -> float:
        """Mobilised friction on the wall: vertical over horizontal load."""
        return self.weight * (1.0 - self.share) / float(_late(self.wall).mean())

    @property
    def janssen(self) -> float:
        """K from the load on the floor."""
        return float(brentq(lambda k: self.carried(k) - self.share, 1e-6, 1e3))

    @property
    def measured(self) -> float:
        """K from the stresses in the middle half of the column."""
        middle = np.abs(self.depth / self.height - 0.5) < 0.25
        return float(self.horizontal[middle].sum() / self.vertical[middle].sum())

    def carried(self, k: float, depth: np.ndarray | None = None) -> np.ndarray:
        """Part of the weight above some depths [m], by default all of it, that passes down, after Janssen."""
        x = 4.0 * k * self.wall_friction * (self.height if depth is None else depth) / self.diameter
        return -np.expm1(-x) / x


def _late(samples: np.ndarray) -> np.ndarray:
    return samples[len(samples) // 2 :]


def column(ratio: float, seed: int) -> WorldSetup:
    """Spheres in a loose lattice above the floor of a tube, `ratio` sphere diameters wide."""
    rng = np.random.default_rng(seed)
    radius = SPHERE.bounding_radius
    diameter = 2.0 * ratio * radius
    volume = 0.6 * np.pi / 4.0 * SLENDERNESS * diameter**3
    places = _lattice(diameter / 2.0, int(volume / SPHERE.volume))
    grains = bodies(
        places,
        GLASS.density,
        velocities=rng.normal(size=places.shape) * 0.2,
        sizes=rng.uniform(0.9, 1.1, len(places)),
    )
    top, step = float(places[:, 2].max()) + diameter, 0.25 * rayleigh_time(0.9 * radius, GLASS)
    # The tube begins below the floor, so that it has no lower rim while it is drawn.
    walls = Plane(), Cylinder((0.0, 0.0, -diameter), diameter / 2.0, top + diameter)
    spheres, wall = contact(GLASS, GLASS, 0.5, FRICTION), contact(GLASS, STEEL, 0.5, WALL_FRICTION)
    made = world(grains, SPHERE, spheres, step, walls=walls, gravity=downhill(0.0))
    domain = (-diameter, -diameter, -diameter), (diameter, diameter, top)
    return replace(made, contacts=(spheres, wall), domain=domain)


def _lattice(radius: float, count: int) -> np.ndarray:
    """Places of a loose square lattice in a tube, layer by layer from the floor, (count, 3) [m]."""
    pitch, free = 2.4 * SPHERE.bounding_radius, radius - 1.2 * SPHERE.bounding_radius
    half = int(free / pitch) + 1
    line = pitch * (np.arange(-half, half) + 0.5)
    x, y = (a.ravel() for a in np.meshgrid(line, line))
    layer = np.column_stack([x, y])[np.hypot(x, y) < free]
    number = np.arange(count)
    return np.column_stack([layer[number % len(layer)], pitch * (0.5 + number // len(layer))])


def draw(setups: Sequence[WorldSetup], device: str) -> list[Loads]:
    """Return the loads of columns that settle, and whose tubes are then drawn upwards."""
    solver = Solver(setups, device)
    worlds, chunk = range(len(setups)), CHUNK * setups[0].time_step
    solver.advance(round(SETTLING / chunk))
    for w in worlds:
        solver.move_wall(w, TUBE, Motion(velocity=(0.0, 0.0, SPEED)))
    samples = round(PULL / chunk)
    positions = [np.empty((samples, setup.grains.count, 3)) for setup in setups]
    for sample in range(samples):
        solver.advance()
        for w, view in zip(worlds, solver.view(worlds), strict=True):
            positions[w][sample] = view.positions[: setups[w].grains.count]
    path = SPEED * chunk * np.arange(1, samples + 1)
    return [_loads(*world, path) for world in zip(setups, positions, strict=True)]


def _loads(setup: WorldSetup, positions: np.ndarray, path: np.ndarray) -> Loads:
    """Return the loads of a column whose spheres were at positions [m], (samples, n, 3)."""
    radius, weights = setup.walls[TUBE][0].radius, GRAVITY * setup.masses
    heights, from_axis = positions[..., 2], np.hypot(positions[..., 0], positions[..., 1])
    floor = _hertz(setup, heights).sum(axis=1)
    pressed = _hertz(setup, radius - from_axis)
    late, late_pressed = _late(heights), _late(pressed)
    height = 2.0 * float(np.average(late.mean(axis=0), weights=weights))
    edges = np.linspace(0.0, height, SLICES + 1)
    middles = 0.5 * (edges[1:] + edges[:-1])
    friction = (weights.sum() - _late(floor).mean()) / late_pressed.sum(axis=1).mean()
    above = late > middles[:, None, None]
    vertical = (above * (weights - friction * late_pressed)).sum(axis=(1, 2)) / len(late)
    horizontal = np.histogram(late, edges, weights=late_pressed)[0] / len(late)
    return Loads(
        diameter=2.0 * radius,
        height=height,
        weight=float(weights.sum()),
        path=path,
        floor=floor,
        wall=pressed.sum(axis=1),
        depth=height - middles,
        vertical=vertical / (np.pi * radius**2),
        horizontal=horizontal / (2.0 * np.pi * radius * np.diff(edges)),
    )


def _hertz(setup: WorldSetup, distances: np.ndarray) -> np.ndarray:
    """Elastic force [N] of spheres on a wall, from the distances of their centres [m]."""
    radii = setup.bounding_radii
    overlap = np.maximum(radii - distances, 0.0)
    return 4.0 / 3.0 * setup.contacts[1].modulus * np.sqrt(radii) * overlap**1.5


def _name(ratio: int) -> str:
    return f"tube of {ratio} sphere diameters"


def _tube_rows(problem: str, ratio: int, columns: Sequence[Loads], common: float) -> list[Row]:
    """Rows of the columns in one tube; `common` is the K of all tubes."""
    sine = np.sin(np.arctan(FRICTION))
    active = (1.0 - sine) / (1.0 + sine)
    means = {
        name: float(np.mean([getattr(one, name) for one in columns]))
        for name in ("share", "wall_friction", "janssen", "measured")
    }
    name = _name(ratio)
    mobilised = (problem, name, "friction on the wall over the largest there can be", "every contact slides")
    floor = (problem, name, f"part of the weight on the floor, K = {common:.2f}", "Janssen (1895)")
    stresses = (problem, name, "K from the stresses", "K from the load on the floor")
    return [
        absolute_row(mobilised, 1.0, means["wall_friction"] / WALL_FRICTION, 0.05),
        relative_row(floor, np.mean([one.carried(common) for one in columns]), means["share"], 0.15),
        relative_row(stresses, means["janssen"], means["measured"], 0.15),
        detection_row(problem, name, "K over Rankine's lower limit", 1.0, means["janssen"] / active),
        detection_row(problem, name, "Rankine's upper limit over K", 1.0, 1.0 / means["janssen"] / active),
    ]


def _stress_plot(loads: Mapping[int, Sequence[Loads]], common: float) -> Plot:
    curves = []
    for colour, (ratio, columns) in enumerate(loads.items()):
        first = columns[0]
        unit = first.weight / (np.pi / 4.0 * first.diameter**2 * first.height) * first.diameter
        depths = np.linspace(1e-3, 1.0, 100) * first.height
        law = depths / first.diameter * first.carried(common, depths)
        name = _name(ratio)
        curves += [
            Curve(f"Janssen, {name}", depths / first.diameter, law, "line", colour),
            *(
                Curve(f"{name}, column {k}", one.depth / one.diameter, one.vertical / unit, "points", colour)
                for k, one in enumerate(columns, 1)
            ),
        ]
    title = f"Mean vertical stress, one K = {common:.2f} for both tubes"
    return Plot("janssen-stress", title, "depth / D", "stress / (bulk density g D)", tuple(curves))


def _mobilisation_plot(loads: Mapping[int, Sequence[Loads]]) -> Plot:
    curves = [
        Curve(f"{_name(ratio)}, column {k}", 1e3 * one.path, one.mobilised, "line", colour)
        for colour, (ratio, columns) in enumerate(loads.items())
        for k, one in enumerate(columns, 1)
    ]
    title = "Friction on the wall over the largest there can be"
    return Plot("janssen-mobilisation", title, "path of the tube [mm]", "mobilised friction", tuple(curves))


def janssen(device: str) -> Result:
    """Return the loads on the floor and the wall of a tube that is drawn upwards."""
    problem = "Spheres in a tube that is drawn upwards"
    setups = [column(ratio, seed) for ratio in TUBES for seed in range(SEEDS)]
    drawn = draw(setups, device)
    loads = {ratio: drawn[k * SEEDS : (k + 1) * SEEDS] for k, ratio in enumerate(TUBES)}
    k = {ratio: float(np.mean([one.janssen for one in columns])) for ratio, columns in loads.items()}
    common = float(np.mean(list(k.values())))
    rows = [row for ratio, columns in loads.items() for row in _tube_rows(problem, ratio, columns, common)]
    labels = (problem, "both tubes", "K from the load on the floor, wide tube", "the same in the narrow tube")
    rows.append(relative_row(labels, k[TUBES[0]], k[TUBES[1]], 0.15))
    return Result("Janssen", TEXT, tuple(rows), (_stress_plot(loads, common), _mobilisation_plot(loads)))
