"""Two spheres that are driven through a contact, under every set of laws, against the theory of the set."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from dem_warp import PRESETS, ClumpShape, Interaction, Material
from dem_warp.laws.twisting import Twisting
from dem_warp.model import ContactCoefficients
from experiments.evidence.verification.check import Curve, Plot, Result, Row
from experiments.evidence.verification.problems.setups import PRECISIONS, Motion, WatchedSolver, bodies, world

RADII, OVERLAP = np.array([5e-3, 3e-3]), 1e-5
"""Radii of the lower and the upper sphere, and the overlap of most motions [m]."""
SUBSTANCE = Material(density=1000.0, shear_modulus=10e6, poisson_ratio=0.25)
RESTITUTION, FRICTION, ROLLING = 0.6, 0.4, 0.4
STEP, STEPS = 2e-6, 100
"""Time step [s] and steps of each stretch of a motion."""
FRAME = Rotation.from_rotvec([0.3, -0.7, 0.4]).as_matrix()
"""Axes of the motions, of which z is the line of centres: none of the world's."""

E_STAR, G_STAR = 10e6 / (1.0 - 0.25), 0.5 * 10e6 / (2.0 - 0.25)
"""G / (1 - nu) and G / (2 (2 - nu)) of two like bodies [Pa]."""
MASSES = SUBSTANCE.density * 4.0 / 3.0 * np.pi * RADII**3
RADIUS, MASS = (float(each.prod() / each.sum()) for each in (RADII, MASSES))
"""R* [m] and m* [kg]."""
ARM, FIXED = ROLLING * RADIUS, 8.0 * G_STAR * RADIUS * np.sqrt(0.02)
"""mu_r R* [m], and S_t at an overlap of 1 % of 2 R* [N/m]."""

ANGLE = OVERLAP / RADIUS
PARTS = {"press": OVERLAP, "slide": OVERLAP, "roll": ANGLE, "twist": ANGLE**0.5, "swing": 1.0, "spin": 1.0}
"""Parts of a motion, and the units of their ways in a stretch [m] or [rad]."""
MOTIONS: Mapping[str, tuple[int, int, list[dict[str, float]]]] = {
    "normal": (0, 2, [{"press": 1.0}, {"press": 0.5}, {"press": -1.0}, {"press": -0.6}]),
    "tangential": (0, 0, [{"press": 1.0}, {"slide": 1.0}, {"slide": -1.5}, {"press": -1.1, "slide": 0.5}]),
    "rolling": (1, 1, [{"press": 1.0}, {"roll": 1.5}, {"roll": -1.5}, {"roll": 1.5}]),
    "twisting": (1, 2, [{"press": 1.0}, {"twist": 1.0}, {"twist": -1.0}, {"twist": 1.0}]),
    "turned out of plane": (0, 0, [{"press": 1.0}, {"slide": 0.2}, {"swing": 0.01}, {}]),
    "turned in plane": (0, 1, [{"press": 1.0}, {"slide": 0.2}, {"spin": 0.5}, {}]),
}
"""Force (0) or torque (1) on the upper sphere and its axis, which a row shows; parts of each stretch."""
QUANTITIES, ROLLED = ("force over F", "torque over F R*"), ("rolling", "twisting")
"""Quantities of a row, and motions with rolling friction."""
TOLERANCES = {"double": 2e-11, "mixed": 5e-3}
"""Some ten roundings of a speed, 1e-16 and 6e-8 of it, over its change in a step, which is 1e-4 or more."""
TURNED = {"turned out of plane": 5e-7, "turned in plane": None}
"""Tolerances: half the turn times that of a step, 0.01 and 1e-4, as a history is projected; none."""
NOISY = (("edem-rvd", "double"), ("edem-rvd", "mixed"), ("deme", "mixed"))
"""Sets and precisions that answer the rounding of a twist with a full torque."""

TEXT = """The pair tests of ON-DEM (COST action CA22132, working group 4:
https://github.com/ON-DEM/ON-DEM-WG4-testingInteractions, commit 9299158 of 22 October 2025) give two spheres
their motion, and compare forces and torques with theory. The motions are theirs, the numbers and laws ours:
their laws of rolling and twisting are still empty. Two unequal spheres are pressed; then one motion follows,
to and fro. *Normal*: load and unload. *Tangential*: both spin alike; stick, slip, reversal, slip as they
part. *Rolling*: the upper one rolls on the lower one. *Twisting*: it spins about the line of centres.
*Turned*: a stuck pair turns as one body, about the axis of the slide (out of plane) or the line of centres
(in plane). The theory is computed in NumPy from the same path; `docs/laws.md` has the sources in full. An
error is the largest of any component on both spheres in any step, over the largest force F, or F R*.

With a = sqrt(R* d), S_n = 2 E* a, S_t = 8 G* a. *Normal*: 2/3 S_n d less a dashpot D sqrt(S_n m*); `yade`
never attracts; `deme` has sqrt(2) a. *Tangential*: a spring S_t (`yade`: increments of force) and a dashpot
D sqrt(S_t m*) (`lammps`: the normal one; `deme`: sqrt(2) times), limited by mu F_n: the spring, then the sum
(`edem`, `relative`, `rocky`); the spring (`liggghts`, `yade`); the sum (`lammps`, `deme`). *Rolling*: mu_r
F_n l against each spin (`edem`); mu_r F_n R* against the mean spin, alike on both (`edem-rvd`), or against
the roll (`liggghts-cdt`); a force mu_r F_n against what the spins slide (`deme`); or springs with this limit:
2.25 S_n (mu_r R*)^2 (`edem-c`; `relative`: and 0.3 of critical damping), S_t R*^2 (`liggghts`), the same at a
fixed overlap (`yade`; `lammps`: and a dashpot), S_t R_r^2, 1/R_r = 1/l_1 + 1/l_2 (`rocky`). *Twisting*:
`edem` as any spin; the mechanism `twisting` has a spring a^2 S_t / 2 with the limit 2/3 a mu F_n; the other
sets have no term, and zero is expected.

Stated, as theory is missed: *turned in plane*, a force should turn with the pair, but keeps its direction in
space under every set. So it does in LIGGGHTS 3.8.0 and LAMMPS (29 Sep 2021), run for this; Yade 2023.02a
turns it. And a pure twist rolls by nothing but rounding, which `edem-rvd` answers with its full torque across
the line of centres; so does `deme` in production precision, where rounding passes its 1e-12 m/s."""


def _cut(force: np.ndarray, limit: float) -> np.ndarray:
    size = float(np.linalg.norm(force))
    return force * (limit / size) if size > limit else force


def _unit(vector: np.ndarray) -> np.ndarray:
    size = float(np.linalg.norm(vector))
    return vector / size if size > 1e-4 else 0.0 * vector  # less is rounding: 2e-5 rad/s in float32


class Spring(NamedTuple):
    """A spring, a dashpot and their limit, of forces or of torques."""

    stiffness: float
    dashpot: float
    limit: float
    slides: str = "alone"
    """The spring slides alone and the sum is cut once more; is the only one cut (free); or the sum slides."""
    keeps_force: bool = False

    def pull(self, memory: np.ndarray, speed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the force after a step at a speed, and what is remembered: a force, or a stretch."""
        stretch = (memory / -self.stiffness if self.keeps_force else memory) + speed * STEP
        force, drag = -self.stiffness * stretch, self.dashpot * speed
        if self.slides == "sum":
            force = _cut(force - drag, self.limit)
            stretch = (force + drag) / -self.stiffness
        elif np.linalg.norm(force) > self.limit:
            force = _cut(force, self.limit)
            stretch = force / -self.stiffness
        else:
            force = force - drag if self.slides == "free" else _cut(force - drag, self.limit)
        return force, -self.stiffness * stretch if self.keeps_force else stretch


def _own_spin(t: Any) -> np.ndarray:
    levers = np.linalg.norm(t.arms, axis=1, keepdims=True)
    return np.asarray(-ROLLING * t.push * levers * [_unit(spin) for spin in t.spins])


def _sliding_spins(t: Any) -> np.ndarray:
    low, up = np.cross(t.spins, t.arms)
    return np.cross(t.arms, np.outer([1.0, -1.0], ROLLING * abs(t.load) * _unit(up - low)))


def _type_c(t: Any, damping: float = 0.0) -> Spring:
    stiffness = 2.25 * t.stiffness * ARM**2
    inertia = 1.0 / (1.0 / (1.4 * MASSES * (t.arms**2).sum(axis=1))).sum()
    return Spring(stiffness, 2.0 * damping * np.sqrt(inertia * stiffness), ARM * t.push)


def _rocky(t: Any) -> Spring:
    lever = 1.0 / (1.0 / np.linalg.norm(t.arms, axis=1)).sum()
    return Spring(t.shear * lever**2, 0.0, ROLLING * lever * t.push, keeps_force=True)


_LOG = np.log(RESTITUTION)
_FIT = np.polyval([4.8218, -18.022, 27.467, -22.348, 11.087, -4.2783, 1.2728], RESTITUTION)
_POWERS = [-1489.915, 6276.757, -11342.18, 11494.29, -7206.864, 2928.711, -796.4559, 146.8049]
_SHARE = (1.0 + RESTITUTION) ** 2 * np.exp(np.polyval([*_POWERS, -16.41105, -6.918798, 0.0], RESTITUTION))
TSUJI = (2.0 * np.sqrt(5.0 / 6.0) * -_LOG / np.hypot(_LOG, np.pi), "Tsuji et al. (1992)")
LAMMPS = (np.sqrt(2.0 / 3.0) * _FIT, "LAMMPS, damping tsuji")
THORNTON = (2.0 * np.sqrt(1.0 / (1.0 - _SHARE) - 1.0), "Thornton et al. (2013), B6")
"""Constant D of the damping, and its source."""


class Theory(NamedTuple):
    """Terms of a set of laws; the defaults are those of EDEM's Hertz-Mindlin."""

    roll: Callable[[Any], Spring | np.ndarray]
    """Rolling resistance: a spring against the roll, or torques on both spheres [N m], (2, 3)."""
    source: str
    damping: tuple[float, str] = TSUJI
    damped: Callable[[Any], float] = lambda t: t.shear
    """Stiffness of the dashpot of the slide [N/m]."""
    slides: str = "alone"
    takes_size: bool = False
    """Friction goes with the size of the normal force, not with its push."""
    keeps_force: bool = False
    area: float = 1.0
    """Contact area over Hertz's."""
    attracts: bool = True
    twists: bool = False


THEORIES: Mapping[str, Theory] = {
    "edem": Theory(_own_spin, "Zhou et al. (1999)"),
    "edem-rvd": Theory(
        lambda t: np.tile(-ARM * t.push * _unit(t.flat @ t.spins.sum(axis=0)), (2, 1)),
        "Altair EDEM, RVD Rolling Friction Model",
    ),
    "edem-c": Theory(_type_c, "Ai et al. (2011), model C"),
    "relative": Theory(lambda t: _type_c(t, 0.3), "Ai et al. (2011), model C"),
    "liggghts": Theory(
        lambda t: Spring(t.shear * RADIUS**2, 0.0, ARM * abs(t.load), keeps_force=True),
        "LIGGGHTS, rolling_model_epsd2.h", slides="free", takes_size=True,
    ),
    "liggghts-cdt": Theory(
        lambda t: np.outer([1.0, -1.0], ARM * t.elastic * t.flat @ _unit(t.turn)),
        "LIGGGHTS, rolling_model_cdt.h", slides="free", takes_size=True,
    ),
    "lammps": Theory(
        lambda t: Spring(FIXED * RADIUS**2, np.sqrt(FIXED * MASS) * RADIUS**2, ARM * abs(t.load), "sum"),
        "Luding (2008); LAMMPS, rolling sds", LAMMPS, lambda t: t.stiffness, "sum", takes_size=True,
    ),
    "yade": Theory(
        lambda t: Spring(FIXED * RADIUS**2, 0.0, ARM * abs(t.load), keeps_force=True),
        "Yade, HertzMindlin.cpp", THORNTON, slides="free", keeps_force=True, attracts=False,
    ),
    "deme": Theory(
        _sliding_spins, "DEM-Engine, FullHertzianForceModel.cu",
        damped=lambda t: 2.0 * t.shear, slides="sum", takes_size=True, area=2.0,
    ),
    "rocky": Theory(_rocky, "Wensrich and Katterfeld (2012)"),
    "relative with twisting": Theory(lambda t: _type_c(t, 0.3), "Marshall (2009)", twists=True),
}  # fmt: skip
"""Theories of the sets by name, and of one with the mechanism `twisting`."""


def predicted(theory: Theory, is_rolled: bool, course: np.ndarray) -> np.ndarray:
    """Return forces [N] and torques [N m] on both spheres in each step, (steps, 2, 2, 3).

    `course` has places, velocities and spins of both, (steps, 3, 2, 3). What a contact remembers turns with
    the line of centres, and about it by the mean of the spins.
    """
    found, memory, before = np.zeros((len(course), 2, 2, 3)), np.zeros((3, 3)), np.zeros(3)
    opposite, damping = np.array([[-1.0], [1.0]]), theory.damping[0]
    for k, (places, speeds, spins) in enumerate(course):
        distance = float(np.linalg.norm(places[1] - places[0]))
        normal, overlap = (places[1] - places[0]) / distance, RADII.sum() - distance
        if overlap <= 0.0:
            memory, before = np.zeros((3, 3)), np.zeros(3)
            continue
        swing = np.cross(before, normal) + normal * (spins.mean(axis=0) @ normal) * STEP
        memory, before = Rotation.from_rotvec(swing).apply(memory), normal
        t = SimpleNamespace(spins=spins, turn=spins[1] - spins[0], flat=np.eye(3) - np.outer(normal, normal))
        t.arms = -opposite * normal * (RADII - 0.5 * overlap)[:, None]
        low, up = speeds + np.cross(spins, t.arms)
        radius = np.sqrt(theory.area * RADIUS * overlap)
        t.stiffness, t.shear = 2.0 * E_STAR * radius, 8.0 * G_STAR * radius
        t.elastic = 2.0 / 3.0 * t.stiffness * overlap
        t.load = t.elastic - damping * np.sqrt(t.stiffness * MASS) * float((up - low) @ normal)
        t.push = max(t.load, 0.0)
        t.load = t.load if theory.attracts else t.push
        dashpot = damping * np.sqrt(theory.damped(t) * MASS)
        limit = FRICTION * (abs(t.load) if theory.takes_size else t.push)
        slide = Spring(t.shear, dashpot, limit, theory.slides, theory.keeps_force)
        friction, memory[0] = slide.pull(memory[0], t.flat @ (up - low))
        force = opposite * (t.load * normal + friction)
        torque = np.cross(t.arms, force)
        resistance = theory.roll(t) if is_rolled else 0.0
        if isinstance(resistance, Spring):
            held, memory[1] = resistance.pull(memory[1], t.flat @ t.turn)
            resistance = opposite * held
        if theory.twists:
            half, most = 0.5 * radius**2, 2.0 / 3.0 * radius * FRICTION * t.push
            twist = Spring(half * t.shear, half * dashpot, most)
            held, memory[2] = twist.pull(memory[2], t.turn - t.flat @ t.turn)
            torque += opposite * held
        found[k] = force, torque + resistance
    return found


def given(rates: np.ndarray, places: np.ndarray) -> list[np.ndarray]:
    """Return velocities and spins of both spheres, (motions, 2, 3), at the speeds of all parts.

    The lower sphere moves only to slide, where both spin alike, and to turn as a pair.
    """
    press, slide, roll, twist, swing, spin = rates.T[..., None]
    across = places[:, 1] - places[:, 0]
    distance = np.linalg.norm(across, axis=1, keepdims=True)
    normal, lever = across / distance, RADII[1] - 0.5 * (RADII.sum() - distance)
    orbit = swing + roll * lever / distance  # the upper sphere rolls without sliding
    upper = orbit * np.cross(FRAME[1], across) - press * normal
    both = (swing - slide / distance) * FRAME[1] + spin * normal
    own = roll * FRAME[1] + twist * normal
    return [np.stack([0.0 * upper, upper], axis=1), np.stack([both, both + own], axis=1)]


def driven(name: str, device: str, precision: str = "double") -> tuple[np.ndarray, np.ndarray]:
    """Return the courses of all motions under a set of laws, and what acted, as of `predicted`."""
    laws = PRESETS[name.split(" ")[0]]
    mechanisms = (Twisting(twisting_radius=1.0),) if THEORIES[name].twists else ()
    grains = bodies([0.0 * FRAME[2], RADII.sum() * FRAME[2]], SUBSTANCE.density, sizes=RADII / RADII[0])
    worlds = []
    for motion in MOTIONS:
        surface = Interaction(RESTITUTION, FRICTION, ROLLING if motion in ROLLED else 0.0)
        law = ContactCoefficients.of_pair(SUBSTANCE, SUBSTANCE, surface, laws, mechanisms, RADIUS, MASS)
        setup = world(grains, ClumpShape.sphere(RADII[0]), law, STEP, extent=0.1)
        worlds.append(replace(setup, forms=laws.forms))
    solver = WatchedSolver(worlds, device, precision)
    ways = [[[part.get(p, 0.0) for p in PARTS] for part in parts] for _, _, parts in MOTIONS.values()]
    rates = np.repeat(np.array(ways) * list(PARTS.values()) / (STEP * STEPS), STEPS, axis=1).swapaxes(0, 1)
    courses, changes = list[np.ndarray](), list[np.ndarray]()

    def see(state: Any) -> None:
        now = Motion.of(state, len(MOTIONS), 2)
        if courses:
            changes.append(np.array([now.velocities, now.spins]) - courses[-1][1:])
        motion = given(rates[min(len(courses), len(rates) - 1)], now.positions)  # further steps end a cycle
        for array, each in zip((state.velocity, state.spin), motion, strict=True):
            kept = array.numpy()
            kept[:, :3] = each.reshape(-1, 3)
            array.assign(kept)
        now = Motion.of(state, len(MOTIONS), 2)
        courses.append(np.array([now.positions, now.velocities, now.spins]))

    see(solver.grains[0])
    solver.watch(len(rates), see)
    inertia = np.array([MASSES, 0.4 * MASSES * RADII**2])[:, None, :, None]
    acted = np.array(changes[: len(rates)]) * inertia / STEP
    return np.moveaxis(np.array(courses[: len(rates)]), 2, 0), np.moveaxis(acted, 2, 0)


def pair_rows(name: str, device: str, precision: str = "double") -> tuple[list[Row], dict[str, np.ndarray]]:
    """Return rows of the motions under a set of laws, and what the upper sphere felt in each.

    In production precision, rows are of the motions with rolling friction.
    """
    theory, rows, felt = THEORIES[name], [], {}
    sources = {
        "normal": f"Johnson (1985), 4.2; {theory.damping[1]}",
        "tangential": "Mindlin (1949); Cundall and Strack (1979)",
        "rolling": theory.source,
        "twisting": theory.source if name == "edem" or theory.twists else "no term: zero",
    }
    for motion, course, got in zip(MOTIONS, *driven(name, device, precision), strict=True):
        if motion not in ROLLED[theory.twists :] and (theory.twists or precision == "mixed"):
            continue  # as without the mechanism, or as in float64
        kind, axis, _ = MOTIONS[motion]
        want = predicted(theory, motion in ROLLED, course)
        scale = np.linalg.norm(want[:, 0], axis=-1).max() * np.array([1.0, RADIUS])[:, None, None]
        want, got = want @ FRAME.T / scale, got @ FRAME.T / scale
        felt[motion], gaps = got[:, kind, 1, axis], abs(got - want)
        at: Any = (abs(want[:, kind, 1, axis]).argmax(), kind, 1, axis)
        tolerance = TURNED.get(motion, TOLERANCES[precision])
        if motion == "twisting" and (name, precision) in NOISY:
            at, tolerance = np.unravel_index(gaps.argmax(), gaps.shape), None
        case = f"{name}, {motion}, {PRECISIONS[precision]}"
        labels = ("Driven pair", case, QUANTITIES[kind], sources.get(motion, "it turns with the pair"))
        values = round(float(want[at]), 9) + 0.0, float(got[at])
        rows.append(Row(*labels, *values, float(gaps.max()), tolerance, relative=False))
    return rows, felt


def pair_laws(device: str) -> Result:
    """Every set of laws in every motion."""
    pairs = {(name, kind): pair_rows(name, device, kind) for name in THEORIES for kind in PRECISIONS}
    plots, steps = [], np.arange(0, 4 * STEPS, 2)
    for motion in ("tangential", "rolling"):
        curves = tuple(Curve(name, steps, pairs[name, "double"][1][motion][steps]) for name in PRESETS)
        labels = (f"driven-{motion}", f"Driven pair, {motion}", "step", QUANTITIES[MOTIONS[motion][0]])
        plots.append(Plot(*labels, curves))
    rows = [row for found, _ in pairs.values() for row in found]
    return Result("Driven pairs", TEXT, tuple(rows), tuple(plots))
