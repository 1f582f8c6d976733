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
from experiments.export.liggghts import LAWS, contact_terms, material_terms

SPOT = 1e-9
"""Half the side of the region that a grain is inserted in [m]."""

_SEEDS = (15485863, 15485867, 32452843)  # LIGGGHTS wants primes; nothing is left to chance here

_HEAD = """\
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
units si
soft_particles yes
hard_particles yes
region box block {low} {high} {low} {high} -{margin} {top} units box
create_box 2 box
neighbor {skin} bin
neigh_modify delay 0 every 1 check yes
{properties}
pair_style gran model {laws}
pair_coeff * *
fix plate all wall/gran model {laws} primitive type 2 zplane 0.0
fix tube all wall/gran model {laws} &
    primitive type 2 zcylinder {radius} 0.0 0.0
fix weight all gravity {gravity} vector 0.0 0.0 -1.0
fix bodies all multisphere
fix clump all particletemplate/multisphere {seeds[0]} atom_type 1 density constant {density} &
    nspheres {spheres} ntry 100000 spheres file clump.txt scale {size} type 1 &
    mass {mass} inertia_tensor {inertia[0]} 0 0 {inertia[1]} 0 {inertia[2]} use_density
fix clumps all particledistribution/discrete {seeds[1]} 1 clump 1.0
timestep 1e-12
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
    """Write `column.in` and `clump.txt`.

    Raises
    ------
    ValueError
        If the grains differ in size.
    """
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
    setup, grain, wall = moment.setup, case.grain_material, case.scene.wall_material
    shape, reach = setup.shapes[0], case.scene.diameter / 2 + MARGIN
    among, with_wall = (
        values(contact_terms(contact))
        for contact in contacts_of(case, float(shape.radii.max()), float(setup.masses[0]))
    )
    materials = [values(material_terms(material)) for material in (grain, wall)]
    by_type = {name: " ".join(repr(terms[name]) for terms in materials) for name in materials[0]}
    by_pair = {name: f"{value} {' '.join(3 * [str(with_wall[name])])}" for name, value in among.items()}
    return _HEAD.format(
        low=-reach,
        high=reach,
        margin=MARGIN,
        top=case.scene.height + MARGIN,
        skin=skin,
        laws=LAWS,
        properties="\n".join(
            f"fix {name} all property/global {name} {kind} {text}"
            for kind, terms in (("peratomtype", by_type), ("peratomtypepair 2", by_pair))
            for name, text in terms.items()
        ),
        radius=case.scene.diameter / 2,
        gravity=-setup.gravity[2],
        seeds=_SEEDS,
        density=grain.density,
        spheres=shape.sphere_count,
        size=common_size(moment),
        mass=float(setup.masses[0]),
        inertia=setup.inertias[0].tolist(),
    )


def _grain(moment: Moment, i: int) -> str:
    position, q = moment.setup.grains.positions[i], moment.setup.grains.orientations[i]
    x, y, z, w = (q / np.linalg.norm(q)).tolist()
    box = " ".join(f"{center - SPOT:.15g} {center + SPOT:.15g}" for center in position)
    return _GRAIN.format(i=i, box=box, seed=_SEEDS[2], w=w, x=x, y=y, z=z)
