"""Clumps that meet in LIGGGHTS, with the template that is exported, against the same pairs here."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from dem_warp import EDEM, PRESETS, ClumpShape, ContactLaws, Interaction, Material
from dem_warp.model import ContactCoefficients, Grains
from dem_warp.solver import CHUNK, Solver
from experiments.evidence.verification.check import Result, Row, detection_row
from experiments.evidence.verification.problems.contact_dumps import run_path
from experiments.evidence.verification.problems.setups import bodies, world
from experiments.export import Contact, values
from experiments.export import liggghts_text as text
from experiments.export.lift import Template
from experiments.export.liggghts_exporter import CONVENTIONS, LIGGGHTS
from experiments.grains.spheres import read_clump

TEXT = """\
48 clumps of three spheres meet in pairs, turned, spinning and off their centres, in LIGGGHTS (`liggghts`,
Debian) with the template and the coefficients that `dem-warp export` gives it, and here under the laws of the
same name. An error is the largest difference of the velocities, or spins, after 30 ms, over the largest
change of one. LIGGGHTS puts them in at random within 10 nm. Under EDEM's laws the difference is seen."""

CLUMP = Path(__file__).parents[3] / "studies" / "trial" / "clump.txt"
GRAIN = Material(density=1300.0, shear_modulus=2.0e6, poisson_ratio=0.3)
LAWS = PRESETS["liggghts"]
FRICTIONS = (0.0, 0.3, 1.0)
PAIRS, APART = 24, 0.02
"""Pairs, and the distance from one to the next [m]."""

STEP, CHUNKS = 5.0e-7, 234
"""Time step [s], and chunks of steps: 30 ms."""

TOLERANCE = 1e-4
"""Errors come from places that are 10 nm off, 1e-5 of a radius, which a blow enlarges."""

SEEN = 1e-2
"""Least error under laws that limit friction otherwise."""

WITHIN = 1e-8
"""Half the side of the region that LIGGGHTS puts a grain in [m]."""

Motion = tuple[np.ndarray, np.ndarray]
"""Velocities and spins of clumps, (grains, 3) each."""

_RUN = """\
fix bodies all multisphere
{template}
fix kinds all particledistribution/discrete 15485867 1 grain1 1.0
{grains}
thermo {steps}
run 1
dump states all custom {steps} path.dump id x y z vx vy vz omegax omegay omegaz
dump_modify states sort id format "%d{numbers}"
run {rest}
"""

_GRAIN = """\
region r{number} block {block} volume_limit 1e-26 units box
fix i{number} all insert/pack seed 32452843 distributiontemplate kinds maxattempt 200 insert_every once &
    overlapcheck yes vel constant {velocity} omega constant {spin} orientation constant {turn} &
    all_in no region r{number} particles_in_region 1"""


def meeting_clumps(seed: int = 5) -> Grains:
    """Draw pairs of clumps that fly at each other along y."""
    rng, count = np.random.default_rng(seed), 2 * PAIRS
    side = np.tile([-1.0, 1.0], PAIRS)
    along = APART * (np.repeat(np.arange(PAIRS), 2) - 0.5 * (PAIRS - 1))
    off = rng.uniform(-5e-4, 5e-4, (count, 2))
    places = np.column_stack([along + off[:, 0], 4e-3 * side, off[:, 1]])
    speeds = rng.uniform((-0.1, 0.1, -0.1), (0.1, 0.3, 0.1), (count, 3))
    turns = Rotation.random(count, random_state=seed).as_quat()
    speeds *= np.column_stack([np.ones(count), -side, np.ones(count)])
    spins = rng.uniform(-40.0, 40.0, (count, 3))
    return bodies(places, GRAIN.density, velocities=speeds, spins=spins, orientations=turns)


def liggghts_clumps(device: str) -> Result:
    """Compare pairs without friction, with some and with much."""
    shape, meeting = read_clump(CLUMP).shape, meeting_clumps()
    rows: list[Row] = []
    for friction in FRICTIONS:
        case = f"friction {friction:g}"
        with tempfile.TemporaryDirectory() as folder:
            theirs = _in_liggghts(meeting, shape, _contact(friction, shape, LAWS), Path(folder))
        ours = _here(meeting, shape, friction, LAWS, device)
        for what, error in _differences(meeting, ours, theirs).items():
            rows.append(Row("liggghts", case, what, "LIGGGHTS", 0.0, error, error, TOLERANCE, relative=False))
    other = _here(meeting, shape, FRICTIONS[-1], EDEM, device)
    for what, error in _differences(meeting, other, theirs).items():
        rows.append(detection_row("edem", case, what, SEEN, error))
    return Result("Clumps in LIGGGHTS", TEXT, tuple(rows))


def _differences(meeting: Grains, ours: Motion, theirs: Motion) -> dict[str, float]:
    """Largest differences of velocities and of spins over their largest changes."""
    changes = {}
    for what, own, other, start in zip(
        ("velocity", "spin"), ours, theirs, (meeting.velocities, meeting.spins), strict=True
    ):
        change = np.linalg.norm(own - start, axis=1).max()
        changes[f"{what}, difference over change"] = float(np.linalg.norm(own - other, axis=1).max() / change)
    return changes


def _contact(friction: float, shape: ClumpShape, laws: ContactLaws) -> Contact:
    """Contact of two grains, as exporters translate it."""
    surface = Interaction(0.4, friction, 0.0)
    radius, mass = 0.5 * float(shape.radii.max()), 0.5 * GRAIN.density * shape.volume
    law = ContactCoefficients.of_pair(GRAIN, GRAIN, surface, laws, (), radius, mass)
    return Contact(GRAIN, GRAIN, surface, law, radius, mass, laws.normal_damping)


def _here(meeting: Grains, shape: ClumpShape, friction: float, laws: ContactLaws, device: str) -> Motion:
    """Velocities and spins after the meeting under some laws."""
    made = world(meeting, shape, _contact(friction, shape, laws).coefficients, STEP, extent=0.3)
    solver = Solver([replace(made, forms=laws.forms)], device, "double")
    solver.advance(CHUNKS)
    end = solver.poses(0)
    return np.array(end["velocities"]), np.array(end["spins"])


def _in_liggghts(meeting: Grains, shape: ClumpShape, contact: Contact, folder: Path) -> Motion:
    """Velocities and spins after the meeting in LIGGGHTS, whose clumps have those of their spheres."""
    count, steps = shape.sphere_count, CHUNKS * CHUNK
    half, terms = APART * (0.5 * PAIRS + 1.0), values(LIGGGHTS.contact_terms(contact))
    properties = text.properties([values(LIGGGHTS.material_terms(GRAIN))], lambda i, j: terms)
    model = text.model_words(CONVENTIONS.words(LAWS))
    commands = text.head(("grains",), (-half, half, -0.03, 0.03, -0.03, 0.03), 0.001, sort="sort 0 0")
    commands += text.contacts(properties, model, STEP)
    commands += _RUN.format(
        template=text.grain_template(1, Template(shape, 1.0, 1.0, GRAIN.density), 15485863),
        grains="\n".join(_grains(meeting)),
        steps=steps,
        rest=steps - 1,
        numbers=9 * " %.15g",
    )
    last = run_path("liggghts", "liggghts", commands, folder, count * len(meeting.positions))
    spheres = (each[-1].reshape(-1, count, 3) for each in (last.positions, last.velocities, last.spins))
    places, velocities, spins = spheres
    # a sphere moves as its clump turns: v + w x r; of the mean of the spheres, r is known by the shape
    turned = np.cross(spins[:, 0], places.mean(axis=1) - _centres(places, shape))
    return velocities.mean(axis=1) - turned, spins[:, 0]


def _centres(places: np.ndarray, shape: ClumpShape) -> np.ndarray:
    """Centres of mass of clumps from those of their spheres, (grains, 3)."""
    centres = []
    for found in places:
        turn, _ = Rotation.align_vectors(
            found - found.mean(axis=0), shape.centers - shape.centers.mean(axis=0)
        )
        centres.append(found.mean(axis=0) - turn.apply(shape.centers.mean(axis=0)))
    return np.array(centres)


def _grains(meeting: Grains) -> list[str]:
    """Commands that put the grains in."""
    blocks = np.stack([meeting.positions - WITHIN, meeting.positions + WITHIN], axis=-1).reshape(-1, 6)
    turns = np.roll(meeting.orientations, 1, axis=1)  # w x y z
    columns = zip(blocks, meeting.velocities, meeting.spins, turns, strict=True)
    return [
        _GRAIN.format(number=n, block=_told(b), velocity=_told(v), spin=_told(w), turn=_told(q))
        for n, (b, v, w, q) in enumerate(columns)
    ]


def _told(numbers: np.ndarray) -> str:
    return " ".join(map(repr, numbers.tolist()))
