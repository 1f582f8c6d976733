"""The same settled column in LAMMPS, on one core.

The same clumps in the same poses are bodies of `fix rigid/small`, whose masses and inertias are given. The
contact law is put together from `pair_style granular`: Hertz, Mindlin's spring with history, Tsuji's damping.
Its coefficients are those of the case in LAMMPS' terms, so that both springs, both dampings and the friction
are the same. The resistance to rolling is another one: LAMMPS has `sds` alone, a spring of its own with a
slider, whose limit is the case's. The tube is an endless cylinder; LAMMPS takes its curvature into the radius
of the contacts, half of it being counted.
"""

import math
import re
from pathlib import Path

import numpy as np
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from dem_warp import Case, LiftedCylinder
from dem_warp.model import ContactCoefficients
from dem_warp.scenes.lifted_cylinder import PLATE, TUBE
from experiments.benchmarks.columns import Moment
from experiments.benchmarks.peers.lammps_files import (
    END,
    INPUT,
    START,
    read_energy,
    read_spheres,
    read_timings,
    run_input,
    timed_runs,
)
from experiments.benchmarks.peers.peer import (
    MARGIN,
    PeerRun,
    Plan,
    grain_of_sphere,
    judged,
    spheres_in_place,
)

TSUJI = (4.8218, -18.022, 27.467, -22.348, 11.087, -4.2783, 1.2728)
"""Polynomial of the restitution that LAMMPS makes the coefficient of Tsuji's damping from."""

ROLLING_OVERLAP = 0.01
"""The spring that resists rolling is as stiff as a tangential one at this overlap, in radii."""

_INPUT = """\
units si
atom_style sphere
atom_modify map array
boundary f f f
newton off
comm_modify vel yes cutoff {reach}
fix clump all property/atom mol ghost yes
read_data column.data fix clump NULL Clumps
neighbor {skin} bin
neigh_modify delay 0 every 1 check yes exclude molecule/intra all
pair_style granular
pair_coeff * * {among}
group nothing empty
# acts on the bodies alone: spheres of a body overlap, and together are heavier than it is
fix weight nothing gravity {gravity} vector 0 0 -1
fix bodies all rigid/small molecule infile bodies.txt gravity weight
fix plate all wall/gran granular {on_plate} zplane 0 NULL
fix tube all wall/gran granular {in_tube} zcylinder {radius}
timestep {time_step!r}
compute energy all ke/rigid bodies
thermo_style custom step c_energy
thermo {steps}
run 0
{start}
run {run_in}
{runs}{end}
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
    log = run_input(program, folder)
    start, end = read_spheres(folder / START), read_spheres(folder / END)
    version = re.findall(r"^LAMMPS \((.*)\)$", log, re.MULTILINE)[0]
    # before the stretches: the state for the first dump, and the running in
    timings = read_timings(log, plan, len(end), before=2)
    return judged(moment, f"LAMMPS {version}", timings, read_energy(log), start, end)


def write_input(folder: Path, case: Case[LiftedCylinder], moment: Moment, plan: Plan) -> None:
    """Write `column.in`, the spheres to `column.data` and the bodies to `bodies.txt`."""
    setup = moment.setup
    kinds = [pair for _, pair in setup.walls]
    radius = float(setup.shapes[0].radii.max() * setup.grains.sizes.max())
    among, on_plate, in_tube = (
        contact_terms(setup.contacts[kind], reduced, reduced_mass)
        for kind, reduced, reduced_mass in (
            (0, radius / 2, setup.masses[0] / 2),
            (kinds[PLATE], radius, setup.masses[0]),
            (kinds[TUBE], radius, setup.masses[0]),
        )
    )
    text = _INPUT.format(
        reach=2.0 * setup.shapes[0].bounding_radius * setup.grains.sizes.max(),
        skin=plan.skins[0],
        among=among,
        on_plate=on_plate,
        in_tube=in_tube,
        gravity=-setup.gravity[2],
        radius=case.scene.diameter / 2,
        time_step=setup.time_step,
        steps=plan.steps,
        start=_DUMP.format(START),
        run_in=plan.run_in,
        runs=timed_runs(plan),
        end=_DUMP.format(END),
    )
    (folder / INPUT).write_text(text, encoding="utf-8")
    (folder / "column.data").write_text(_data(case, moment), encoding="utf-8")
    (folder / "bodies.txt").write_text(_bodies(moment), encoding="utf-8")


def contact_terms(contact: ContactCoefficients, radius: float, mass: float) -> str:
    """LAMMPS' words for a contact.

    Parameters
    ----------
    contact : ContactCoefficients
    radius, mass : float
        Reduced ones, for the spring and the critical damping of rolling alone [m], [kg].
    """
    # LAMMPS' E* is E / 2 (1 - v^2), and of walls E / 2 (1 - v) in some versions: without v both are E / 2
    modulus, spring = 2.0 * contact.modulus, 8.0 * contact.shear_modulus
    rolling = spring * radius * math.sqrt(2.0 * ROLLING_OVERLAP)
    # the tangential damping is given as a multiple of the normal one
    share = 2.0 * math.sqrt(contact.shear_modulus / contact.modulus) * contact.tangential_damping
    return (
        f"hertz/material {modulus!r} {tsuji_restitution(contact.damping)!r} 0 "
        f"tangential mindlin {spring!r} {share!r} {contact.static_friction!r} "
        f"rolling sds {rolling!r} {math.sqrt(rolling * mass)!r} {contact.rolling_friction!r} damping tsuji"
    )


def tsuji_restitution(damping: float) -> float:
    """The restitution from which LAMMPS comes to a given damping.

    LAMMPS damps with a sqrt(m* 4/3 E* sqrt(R* d)), a being a polynomial of it; dem-warp with a
    coefficient times sqrt(m* 2 E* sqrt(R* d)).

    Raises
    ------
    ValueError
        If the polynomial does not reach so far.
    """
    return float(brentq(lambda e: np.polyval(TSUJI, e) - math.sqrt(1.5) * damping, 0.0, 1.0))


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
    for i, (mass, position, inertia) in enumerate(
        zip(setup.masses, setup.grains.positions, inertias, strict=True), 1
    ):
        moments = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        numbers = " ".join(f"{value:.15g}" for value in (mass, *position, *moments))
        rows.append(f"{i} {numbers} 0 0 0 0 0 0 0 0 0")
    return "\n".join(rows) + "\n"
