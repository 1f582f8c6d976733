"""The same settled column in LIGGGHTS, on one core.

The input has the same clumps in the same poses, the same moduli, friction, restitution and time step, and the
same contact law: `hertz` with `tangential history`, and `cdt`, the constant directional rolling resistance.
Bodies are those of `fix multisphere`; each grain is inserted by a command of its own, in a region of a few
nanometres, under a time step too short to move anything. Plate and tube are `primitive` walls, the tube
endless, so no grain may reach over its rim. Neither code knows the contacts' histories at the start; both run
in until the column is at rest.
"""

from pathlib import Path

import numpy as np

from dem_warp import Case, LiftedCylinder
from experiments.evidence.performance.columns import Moment
from experiments.evidence.performance.peers.lammps_files import INPUT, run_input, timed_runs
from experiments.evidence.performance.peers.peer import MARGIN, PeerRun, Plan, common_size
from experiments.export import contacts_of, values
from experiments.export import liggghts_text as text
from experiments.export.liggghts_exporter import LIGGGHTS

LAWS = "hertz tangential history rolling_friction cdt"
"""Contact model."""

INSERTION_STEP = 1e-12
"""Time step in which nothing moves [s]."""

SPOT = 1e-9
"""Half the side of the region that a grain is inserted in [m]."""

_SEEDS = (15485863, 15485867, 32452843)  # LIGGGHTS wants primes; nothing is left to chance here

_WALLS = """\
fix plate all wall/gran model {laws} primitive type 2 zplane 0.0
fix tube all wall/gran model {laws} &
    primitive type 2 zcylinder {radius} 0.0 0.0
fix bodies all multisphere
fix clump all particletemplate/multisphere {seeds[0]} atom_type 1 density constant {density} &
    nspheres {spheres} ntry 100000 spheres file clump.txt scale {size} type 1 &
    mass {mass} inertia_tensor {inertia[0]} 0 0 {inertia[1]} 0 {inertia[2]} use_density
fix clumps all particledistribution/discrete {seeds[1]} 1 clump 1.0
"""

_GRAIN = """\
region at{i} block {box} units box volume_limit 1e-40
fix put{i} all insert/pack seed {seed} distributiontemplate clumps insert_every once overlapcheck no &
    maxattempt 1 verbose no orientation constant {w} {x} {y} {z} &
    region at{i} particles_in_region 1 ntry_mc 1001 warn_region no check_dist_from_subdomain_border no
"""

_DUMP = """\
dump {name} all custom 1 {name}.txt id x y z radius
dump_modify {name} sort id format "%d %.12g %.12g %.12g %.12g"
run 0
undump {name}
"""


def simulate(program: str, folder: Path, case: Case[LiftedCylinder], moment: Moment, plan: Plan) -> PeerRun:
    """Run a settled column of grains of one shape and size; see `Peer.run`."""
    write_input(folder, case, moment, plan)
    # before the stretches: the insertion, its dump and the running in
    return run_input(program, folder, moment, plan, r"LIGGGHTS-\w+ [\d.]+", before=3)


def write_input(folder: Path, case: Case[LiftedCylinder], moment: Moment, plan: Plan) -> None:
    """Write `column.in` and `clump.txt`."""
    setup, shape = moment.setup, moment.setup.shapes[0]
    np.savetxt(folder / "clump.txt", np.column_stack([shape.centers, shape.radii]), fmt="%.15g")
    count = setup.grains.count
    parts = [_head(case, moment, plan.skins[0]), *(_grain(moment, i) for i in range(count)), "run 1\n"]
    parts += [f"unfix put{i}\n" for i in range(count)]
    parts += [
        _DUMP.format(name="start"),
        f"timestep {setup.time_step!r}\n",
        "compute energy all ke/multisphere\nthermo_style custom step c_energy\n",
        f"thermo {plan.steps}\nrun {plan.run_in}\n",
        timed_runs(plan),
        _DUMP.format(name="end"),
    ]
    (folder / INPUT).write_text("".join(parts), encoding="utf-8")


def _head(case: Case[LiftedCylinder], moment: Moment, skin: float) -> str:
    setup, shape, reach = moment.setup, moment.setup.shapes[0], case.scene.diameter / 2 + MARGIN
    among, with_wall = (
        values(LIGGGHTS.contact_terms(contact))
        for contact in contacts_of(case, float(shape.radii.max()), float(setup.masses[0]))
    )
    materials = [
        values(LIGGGHTS.material_terms(each)) for each in (case.grain_material, case.scene.wall_material)
    ]
    properties = text.properties(materials, lambda i, j: with_wall if i or j else among)
    sides = (-reach, reach, -reach, reach, -MARGIN, case.scene.height + MARGIN)
    walls = _WALLS.format(
        laws=LAWS,
        radius=case.scene.diameter / 2,
        seeds=_SEEDS,
        density=case.grain_material.density,
        spheres=shape.sphere_count,
        size=common_size(moment),
        mass=float(setup.masses[0]),
        inertia=setup.inertias[0].tolist(),
    )
    return (
        text.head(("grains", "walls"), sides, skin)
        + text.contacts(properties, LAWS, INSERTION_STEP)
        + text.weight(setup.gravity)
        + walls
    )


def _grain(moment: Moment, i: int) -> str:
    position, q = moment.setup.grains.positions[i], moment.setup.grains.orientations[i]
    x, y, z, w = (q / np.linalg.norm(q)).tolist()
    box = " ".join(f"{center - SPOT:.15g} {center + SPOT:.15g}" for center in position)
    return _GRAIN.format(i=i, box=box, seed=_SEEDS[2], w=w, x=x, y=y, z=z)
