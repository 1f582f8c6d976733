"""The same settled column in LAMMPS, on one core.

The same clumps in the same poses are bodies of `fix rigid/small`, whose masses and inertias are given. The
contact law is put together from `pair_style granular`: Hertz, Mindlin's spring with history, Tsuji's damping.
Its coefficients are those that the case is exported with, so that both springs, both dampings and the
friction are the same. The resistance to rolling is another one: LAMMPS has `sds` alone,
a spring of its own with a slider, whose limit is the case's. The tube is an endless cylinder; LAMMPS takes
its curvature into the radius of the contacts, half of it being counted.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from dem_warp import Case, LiftedCylinder
from experiments.evidence.performance.columns import Moment
from experiments.evidence.performance.peers.lammps_files import END, INPUT, START, run_input, timed_runs
from experiments.evidence.performance.peers.peer import (
    MARGIN,
    PeerRun,
    Plan,
    grain_of_sphere,
    spheres_in_place,
)
from experiments.export import contacts_of
from experiments.export import lammps_text as text
from experiments.export.lammps_exporter import granular_words

_WALLS = """\
fix plate all wall/gran granular {words} zplane 0 NULL
fix tube all wall/gran granular {words} zcylinder {radius}
compute energy all ke/rigid bodies
thermo_style custom step c_energy
thermo {steps}
run 0
"""

_DUMP = "write_dump all custom {} id x y z radius modify sort id format float %.12g"

_DATA = """\
A settled column

{count} atoms
1 atom types
{low} {high} xlo xhi
{low} {high} ylo yhi
-{margin} {top} zlo zhi

Atoms # sphere

{spheres}

Clumps

{clumps}
"""


def simulate(program: str, folder: Path, case: Case[LiftedCylinder], moment: Moment, plan: Plan) -> PeerRun:
    """Run a settled column of grains of one shape; see `Peer.run`."""
    write_input(folder, case, moment, plan)
    # before the stretches: the state for the first dump, and the running in
    done = run_input(program, folder, moment, plan, r"^LAMMPS \((.*)\)$", before=2)
    return replace(done, version=f"LAMMPS {done.version}")


def write_input(folder: Path, case: Case[LiftedCylinder], moment: Moment, plan: Plan) -> None:
    """Write `column.in`, the spheres to `column.data` and the bodies to `bodies.txt`."""
    setup = moment.setup
    radius = float(setup.shapes[0].radii.max() * setup.grains.sizes.max())
    words = {"tangential_history": "mindlin", "attraction": "", "normal_damping": "damping tsuji"}
    among, with_wall = (
        granular_words(contact, words) for contact in contacts_of(case, radius, setup.masses[0])
    )
    reach = 2.0 * setup.shapes[0].bounding_radius * setup.grains.sizes.max()
    parts = [
        text.head("array", reach),
        text.BODY_NUMBERS + "read_data column.data fix clump NULL Clumps\n",
        text.neighbors(plan.skins[0]),
        text.contacts({"* *": among}, setup.time_step),
        text.rigid_bodies(setup.gravity, "infile bodies.txt"),
        _WALLS.format(words=with_wall, radius=case.scene.diameter / 2, steps=plan.steps),
        f"{_DUMP.format(START)}\nrun {plan.run_in}\n{timed_runs(plan)}{_DUMP.format(END)}\n",
    ]
    (folder / INPUT).write_text("".join(parts), encoding="utf-8")
    (folder / "column.data").write_text(_data(case, moment), encoding="utf-8")
    (folder / "bodies.txt").write_text(_bodies(moment), encoding="utf-8")


def _data(case: Case[LiftedCylinder], moment: Moment) -> str:
    rows, reach = spheres_in_place(moment), case.scene.diameter / 2 + MARGIN
    # a sphere's density is not used
    spheres = [f"{i} 1 {2 * r:.15g} 1 {x:.15g} {y:.15g} {z:.15g}" for i, (x, y, z, r) in enumerate(rows, 1)]
    return _DATA.format(
        count=len(rows),
        low=-reach,
        high=reach,
        margin=MARGIN,
        top=case.scene.height + MARGIN,
        spheres="\n".join(spheres),
        clumps="\n".join(f"{i} {grain + 1}" for i, grain in enumerate(grain_of_sphere(moment), 1)),
    )


def _bodies(moment: Moment) -> str:
    """Masses, centres and inertias of the grains, all at rest."""
    setup = moment.setup
    turns = Rotation.from_quat(setup.grains.orientations).as_matrix()
    inertias = np.einsum("nij,nj,nkj->nik", turns, setup.inertias, turns)
    rows = [str(setup.grains.count)]
    bodies = zip(setup.masses, setup.grains.positions, inertias, strict=True)
    for i, (mass, position, inertia) in enumerate(bodies, 1):
        moments = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        numbers = " ".join(f"{value:.15g}" for value in (mass, *position, *moments))
        rows.append(f"{i} {numbers} 0 0 0 0 0 0 0 0 0")
    return "\n".join(rows) + "\n"
