"""A piston and a sheared lid against closed forms: spheres, a cubic array, a die, a slab, work."""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.stats import sem

from dem_warp import (
    Case,
    CaseResult,
    ClumpShape,
    Compression,
    GrainPopulation,
    Interaction,
    Shear,
    effective_moduli,
    rayleigh_time,
    simulate,
)
from dem_warp.batch import Batch
from dem_warp.model import Grains, WorldSetup
from dem_warp.scenes.press_curve import LOADED, UNLOADED
from dem_warp.scenes.shear import GRIP
from dem_warp.scenes.shear_points import LOADS
from dem_warp.solver import CHUNK, Solver
from dem_warp.walls import Disc, Motion, Plane, Vector
from experiments.evidence.verification.check import Result, Row, absolute_row, detection_row, relative_row
from experiments.evidence.verification.problems.energy import column
from experiments.evidence.verification.problems.energy_account import EnergyAccount
from experiments.evidence.verification.problems.janssen import GLASS
from experiments.evidence.verification.problems.setups import (
    CLUMP,
    GRAVITY,
    STEEL,
    WatchedSolver,
    bodies,
    contact,
    world,
)

RADIUS = 1.5e-3
PROBLEM = "A piston that goes down and back"
SIDE, LAYERS, STRAINS = 3, 4, (0.002, 0.005, 0.01, 0.02)
"""Spheres along both sides of the cubic array and above one another, and its strains."""

SLENDERNESS, FRICTION, WALL_FRICTION = (0.5, 1.0, 2.0), 0.5, 0.3
"""Depths of the beds in the die over its diameter, and frictions."""

DIE = Compression(20 * RADIUS, 0.01, STEEL, 1e4, speed=0.01)
LONELY = replace(DIE, diameter=8 * RADIUS, fill_depth=2 * RADIUS, stress=100.0, speed=1e-4, grain_count=1)

SETTLING, SPEED, STROKE = 0.12, 0.02, 5e-4
"""Time in which grains come to rest [s], then speed [m/s] and path [m] of the piston down, and up again."""

TEXT = f"""A sphere between base and piston yields at both by Hertz; the strains of the scene's own curve,
loading and unloading, follow. A cubic array of {SIDE} by {SIDE} by {LAYERS} spheres between plates of the
same modulus has the stress 2/3 E* strain^1.5; at a plate a sphere yields 2^(1/3) times less than at another.
Packings of weightless balls between periodic sides are made without friction and loaded with it. A tenth of
each load is taken off: stress over the strain that comes back goes as its cube root, and the power 2/3 of the
contacts of a ball (P. J. Digby, Journal of Applied Mechanics 48 (1981) 803-808). A tenth more of these adds
.03, the tolerance, fixed after a trial (.32). With its restitution of .1 a packing trembled (.29); .5 rests.
In a die with friction the load decays from the piston to the base. Janssen's law (H. A. Janssen, Zeitschrift
des Vereines Deutscher Ingenieure 39 (1895) 1045-1049), turned over, says that exp(-4 K m mu_w H / D) of it
arrives, where m is the part of the friction that acts upwards: grains that yield sideways, or roll, have the
rest. One K m must fit depths from {SLENDERNESS[0]:g} to {SLENDERNESS[-1]:g} diameters. Sixteen settled
clumps in a tube are pressed by {1e3 * STROKE:g} mm and let go: the work of the piston, from the sum of its
forces, is what the account in NumPy books as stored and lost."""


def pressed(device: str) -> Result:
    """Return the loads on a piston, on the base below it, and the piston's work."""
    rough = Interaction(0.3, FRICTION, 0.0), Interaction(0.3, WALL_FRICTION, 0.0)
    smooth = Interaction(0.3, 0.0, 0.0), Interaction(0.3, 0.0, 0.0)
    beds = [replace(DIE, fill_depth=ratio * DIE.diameter) for ratio in SLENDERNESS]
    grains = GrainPopulation(ClumpShape.sphere(RADIUS), GLASS)
    cases = [Case(LONELY, grains, *smooth, seed=1), *(Case(bed, grains, *rough, seed=1) for bed in beds)]
    lonely, *filled = simulate(cases, device=device)
    rows = (
        *_sphere_rows(lonely),
        *_array_rows(device),
        _packing_row(device),
        *_die_rows(filled),
        *_work_rows(device),
    )
    return Result("Compression", TEXT, rows)


def _sphere_rows(result: CaseResult) -> list[Row]:
    """Rows of one sphere, whose weight the base alone carries."""
    modulus, _ = effective_moduli(GLASS, STEEL)
    radius = RADIUS * float(result.sizes[0])
    weight = GLASS.density * 4 / 3 * math.pi * radius**3 * GRAVITY

    def height(part: float) -> float:
        loads = part * LONELY.stress * LONELY.area + np.array([0.0, weight])
        return 2 * radius - float(((loads / (4 / 3 * modulus * math.sqrt(radius))) ** (2 / 3)).sum())

    strains = np.array([1 - height(part) / height(0.01) for part in (*LOADED, *UNLOADED)])
    got = [result.observables.get(f"strain_{n + 1}", math.nan) for n in range(len(strains))]
    labels = (PROBLEM, "one sphere", "strain over the largest, nine loads", "Hertz at both contacts")
    share = (PROBLEM, "one sphere", "load on the base over the piston's", "balance")
    return [
        absolute_row(labels, strains / strains.max(), np.array(got) / strains.max(), 0.01),
        absolute_row(share, 1.0, result.observables.get("base_share", math.nan), 1e-3),
    ]


def _plated(spheres: Grains, top: float, **changes: Any) -> WorldSetup:
    """Return a world of spheres between two plates without friction, of which the upper one is weighed."""
    plates = Plane(), Plane((0.0, 0.0, top), (0.0, 0.0, -1.0))
    step, shape = 0.25 * rayleigh_time(RADIUS, GLASS), ClumpShape.sphere(RADIUS)
    made = world(spheres, shape, contact(GLASS, GLASS, 0.1), step, walls=plates)
    return replace(made, weighed=(1,), **changes)


def _array_rows(device: str) -> list[Row]:
    """Rows of a cubic array whose plates come nearer by four strains; between spheres, and half at plates."""
    size = 2 * RADIUS
    places = np.indices((SIDE, SIDE, LAYERS)).reshape(3, -1).T * size + [-size, -size, RADIUS]
    setup = _plated(bodies(places, GLASS.density), LAYERS * size)
    law, step = setup.contacts[0], setup.time_step
    solver, gaps = Solver([setup] * len(STRAINS), device, "double"), LAYERS - 1 + 2 * 0.5 ** (1 / 3)
    for number, strain in enumerate(STRAINS):
        down = Motion(velocity=(0.0, 0.0, -strain * size * gaps / 0.1), duration=0.1)
        solver.move_wall(number, 1, down)
    chunks = round(0.2 / (CHUNK * step))
    solver.advance(chunks)
    before = solver.impulses()
    solver.advance(chunks // 4)
    forces = (solver.impulses() - before)[:, 0, 2] / (chunks // 4 * CHUNK * step)
    stresses = 2 / 3 * law.modulus * np.power(STRAINS, 1.5)
    labels = (PROBLEM, f"cubic array, strains to {STRAINS[-1]:.0%}", "stress [Pa]", "2/3 E* strain^1.5")
    return [relative_row(labels, stresses, forces / (SIDE * size) ** 2, 1e-3)]


def _packing_row(device: str) -> Row:
    """Row of the modulus of packings, which a free lid presses first without friction, and then with it."""
    rng, pitch, worlds, smooth = np.random.default_rng(1), 3.4e-3, range(24), contact(GLASS, GLASS, 0.5)
    pressures = np.geomspace(25.0, 250.0, 7)
    places = pitch * (np.indices((7, 7, 10)).reshape(3, -1).T - [3.0, 3.0, -0.5])
    packings = [(rng.normal(places, 2e-5), rng.uniform(0.9, 1.1, 490), 10 * pitch) for _ in worlds]
    for friction, stresses, chunks in ((0.0, pressures[:1], 180), (FRICTION, pressures, 24)):
        laws = contact(GLASS, GLASS, 0.5, friction), smooth
        more: Any = {"contacts": laws, "free_wall": 1, "period": 7 * pitch, "air_drag": 100.0}
        setups = [_plated(bodies(each, GLASS.density, sizes=s), top, **more) for each, s, top in packings]
        solver, heights = Solver(setups, device, "double"), []
        for stress in np.outer(stresses, (1.0, 0.9)).ravel():
            lid = Motion(mass=3.5e-3, force=-stress * (7 * pitch) ** 2)
            solver.move_walls([(number, 1, lid) for number in worlds])
            solver.advance(chunks)
            heights.append([solver.wall_pose(number, 1)[0][2] for number in worlds])
        ends = zip(solver.view(worlds), packings, heights[-1], strict=True)
        packings = [(view.positions, sizes, top) for view, (_, sizes, _), top in ends]
    low, high = np.array(heights[::2]), np.array(heights[1::2])
    powers = np.polyfit(np.log(pressures), np.log(pressures[:, None] * low / (high - low)), 1)[0]
    case = f"{len(worlds)} packings, stresses of 1e-5 to 1e-4 of the balls' modulus"
    quantity = f"power of the modulus in the stress, +- {sem(powers):.4f}"
    return absolute_row((PROBLEM, case, quantity, "Hertz and Digby"), 1 / 3, powers.mean(), 0.03)


def _die_rows(results: list[CaseResult]) -> list[Row]:
    """Rows of the load that arrives at the base of beds of several depths."""
    shares = np.array([result.observables.get("base_share", math.nan) for result in results])
    depths = np.array([result.observables.get("fill_height", math.nan) for result in results])
    exponents = 4 * WALL_FRICTION * depths / DIE.diameter
    k = float(-np.log(shares) @ exponents / (exponents @ exponents))
    case = f"die with friction, depths of {SLENDERNESS[0]:g} to {SLENDERNESS[-1]:g} diameters"
    labels = (PROBLEM, case, f"load on the base over the piston's, K m = {k:.2f}", "Janssen, turned over")
    return [
        relative_row(labels, np.exp(-k * exponents), shares, 0.1),
        detection_row(PROBLEM, case, "part of the load that the deepest die takes", 0.2, 1 - shares[-1]),
    ]


def _plated_clumps(device: str, free_wall: int | None = None) -> tuple[WatchedSolver, Callable[..., Any]]:
    """Return clumps below a plate, and what moves it: the account's energy then [J], its impulse [N s]."""
    settled = column(ClumpShape.read(CLUMP), 16, 0.0075, 0.125)
    nowhere = Plane((0.0, 0.0, 0.1), (0.0, 0.0, -1.0))
    setup = replace(settled, walls=(*settled.walls, (nowhere, 1)), weighed=(2,), free_wall=free_wall)
    solver, account = WatchedSolver([setup], device, "double"), EnergyAccount(setup)
    account.see(solver.grains[0])

    def run(time: float, velocity: Vector = (0.0, 0.0, 0.0), **more: Any) -> tuple[float, np.ndarray]:
        solver.move_wall(0, 2, Motion(velocity, **more))
        before = solver.impulses()[0, 0]

        def see(state: Any) -> None:
            rising = solver.neighbours.lift.numpy()[0, 1] if free_wall else 0.0
            account.wall_velocities[2] = np.add(velocity, [0.0, 0.0, rising])
            account.see(state)

        solver.watch(round(time / setup.time_step), see)
        return float(account.parts[-1].sum()), solver.impulses()[0, 0] - before

    run(SETTLING)
    top = float(solver.view([0])[0].highest + setup.bounding_radii.max())
    run((0.1 - top) / 1.0, (0.0, 0.0, -1.0))
    return solver, run


def _work_rows(device: str) -> list[Row]:
    """Rows of the work of a piston on clumps in a tube, down and up again."""
    _, run = _plated_clumps(device)
    start, _ = run(SETTLING / 10)
    pushed, down = run(STROKE / SPEED, (0.0, 0.0, -SPEED))
    left, up = run(STROKE / SPEED, (0.0, 0.0, SPEED))
    work, returned = down[2] * SPEED, -up[2] * SPEED
    pressed = (PROBLEM, "16 clumps, down", "energy stored and lost [uJ]", "work of the piston")
    released = (
        PROBLEM,
        "16 clumps, and up again",
        "energy stored, lost and returned [uJ]",
        "work of the piston",
    )
    return [
        relative_row(pressed, 1e6 * work, 1e6 * (pushed - start), 0.01),
        relative_row(released, 1e6 * work, 1e6 * (left - start - returned), 0.01),
        detection_row(PROBLEM, "16 clumps", "work over what is returned", 1.05, -work / returned),
    ]


LID, STRESS, MASS, FORCE = "A lid that carries its load", 2e3, 2e-3, -0.2
SHEARED = f"""Balls between rough plates are sheared at four loads after pre-shears of {STRESS:g} Pa; without
friction they resist by 5.76 degrees (P. Peyneau and J. Roux, Physical Review E 78 (2008) 011307). A slab, one
flat clump, slides on a base. Clumps in a tube are sheared by a free lid: the work of its motion and its load,
less its kinetic energy, is what the account books."""


def sheared(device: str) -> Result:
    """Return the loads of a lid, the friction of spheres and of a slab, and the lid's work."""
    cell, grains = Shear(0.036, 0.03, STEEL, STRESS, SPEED), GrainPopulation(ClumpShape.sphere(RADIUS), GLASS)
    frictions = Interaction(0.3, FRICTION, 0.0), Interaction(0.3, 0.0, 0.0)
    batch = Batch([Case(cell, grains, each, each, seed=1) for each in frictions], device)
    ended: dict[int, CaseResult] = {}
    while batch.running:
        ended |= dict(batch.advance())
    normal = [point[0] for point in batch.controllers[0].state.points]
    angle, loads = ended[1].observables.get("steady_angle", math.nan), STRESS * np.array(LOADS)
    rows = (
        relative_row((LID, "spheres", "normal stress at four loads [Pa]", "load"), loads, normal, 0.01),
        _circle_row(ended[0].observables),
        absolute_row((LID, "spheres without friction", "angle of flow", "literature"), 5.76, angle, 1.5),
    )
    return Result("Shear", SHEARED, (*rows, _slab_row(device), _lid_row(device)))


def _circle_row(seen: Mapping[str, float]) -> Row:
    """Row of Mohr's circle through the steady point, which ends at the consolidation stress."""
    slope, cohesion = math.tan(math.radians(seen["friction_angle"])), seen["cohesion"]
    shear, major = seen[f"shear_stress_{len(LOADS) + 1}"], seen["consolidation_stress"]
    normal = shear / math.tan(math.radians(seen["steady_angle"]))
    shear = min(shear, cohesion + slope * normal)
    middle = (major**2 - normal**2 - shear**2) / (2 * (major - normal))
    reach = (cohesion + slope * middle) / math.hypot(1.0, slope)
    labels = (LID, "spheres", "distance of the yield locus over the circle's radius", "they touch")
    return relative_row(labels, 1.0, reach / (major - middle), 1e-6)


def _slab_row(device: str) -> Row:
    """Row of a clump of 25 spheres between a smooth base and a rough lid, under two loads."""
    places = 2 * RADIUS * np.indices((5, 5, 1)).reshape(3, -1).T
    law, grip = (contact(GLASS, GLASS, 0.3, *each) for each in ((WALL_FRICTION,), GRIP))
    slab = ClumpShape.from_spheres(places, np.full(25, RADIUS))
    setup = world(bodies([0.0, 0.0, RADIUS], GLASS.density), slab, law, 1e-5, extent=0.2)
    walls = (Plane(), 1), (Disc((0.0, 0.0, 2.01 * RADIUS), (0.0, 0.0, 1.0), 0.1), 2)
    setup = replace(setup, contacts=(law, law, grip), walls=walls, weighed=(0, 1), free_wall=1)
    solver, ratios = Solver([setup], device, "double"), []
    for load in (2.0, 0.5):
        solver.move_wall(0, 1, Motion((SPEED, 0.0, 0.0), mass=MASS, force=-load))
        solver.advance(100)
        before = solver.impulses()[0, 0]
        solver.advance(40)
        ratios.append(-np.divide(*(solver.impulses()[0, 0] - before)[[0, 2]]))
    return relative_row((LID, "slab, two loads", "shear over load", "friction"), WALL_FRICTION, ratios, 1e-3)


def _lid_row(device: str) -> Row:
    """Row of the work of a free lid on clumps in a tube."""
    solver, run = _plated_clumps(device, free_wall=2)
    start, _ = run(SETTLING / 10)
    end, pushed = run(SETTLING / 4, (SPEED, 0.0, 0.0), mass=MASS, force=FORCE)
    rise, speed = solver.neighbours.lift.numpy()[0, :2]
    work = -pushed[0] * SPEED + FORCE * rise - MASS * speed**2 / 2
    return relative_row((LID, "16 clumps", "booked [uJ]", "work"), 1e6 * work, 1e6 * (end - start), 0.01)
