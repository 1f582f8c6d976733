"""The same settled column in Yade, on one core.

The same clumps in the same poses have the same masses and inertias, which are given, and the contact law is
Yade's `MindlinPhys`, which has the same springs, dampings and friction from the same coefficients. Resistance
to rolling is left out: Yade's is a spring without damping, in which grains go on to swing, and without it a
step is shorter. Yade has no cylinder that is felt from inside; the tube is a prism of facets that touch it.
A skin is half of Yade's `verletDist`, which is that of one body.
"""

import json
import math
from pathlib import Path

import numpy as np

from dem_warp import Case, LiftedCylinder
from experiments.evidence.performance.columns import Moment
from experiments.evidence.performance.peers.peer import MARGIN, PeerRun, Plan, common_size, execute, judged
from experiments.evidence.performance.timing import Timing
from experiments.export import contacts_of, values
from experiments.export.lift import prism
from experiments.export.yade_exporter import YADE, contact_numbers

SIDES = 180
"""Sides of the prism; its edges stand out of the tube by 0.015 % of the radius."""

HASTE = 8
"""Yade's stretches are shorter by this, as its steps take longer."""

INPUT, SCRIPT, OUTPUT = "column.json", "column.py", "result.json"

_SCRIPT = '''\
"""Run by Yade's own interpreter; reads column.json and writes result.json."""

import json
import time

from yade import config, utils, wrapper
from yade.minieigenHP import Quaternion, Vector3

given = json.load(open("column.json"))
scene = wrapper.Omega()
scene.dt = given["time_step"]
grain, wall = (wrapper.FrictMat(young=m["young"], poisson=m["poisson"]) for m in given["materials"])
# a clump's mass and centre are those of its spheres; these densities make them the grain's
parts = [wrapper.FrictMat(density=density) for density in given["densities"]]
for material in (grain, wall, *parts):
    scene.materials.append(material)
scene.bodies.append(utils.wall(0, 2, sense=1, material=wall))
scene.bodies.append([utils.facet(corners, material=wall) for corners in given["facets"]])

clumps, spheres = [], []
for position, (x, y, z, w) in zip(given["positions"], given["orientations"]):
    turn = Quaternion(w, x, y, z).toRotationMatrix()
    members = [
        utils.sphere(Vector3(position) + turn * Vector3(center), radius, material=part)
        for center, radius, part in zip(given["centers"], given["radii"], parts)
    ]
    number, ids = scene.bodies.appendClumped(members)
    clump = scene.bodies[number].state
    axes = turn.transpose() * clump.ori.toRotationMatrix()
    inertia = given["inertia"]
    clump.inertia = Vector3([sum(axes[i, k] ** 2 * inertia[i] for i in range(3)) for k in range(3)])
    for i in ids:
        # what contacts know of the grain: their damping takes the mass from here
        scene.bodies[i].state.mass = given["mass"]
        scene.bodies[i].material = grain
    clumps.append(clump)
    spheres += ids


def by_pair(among, with_wall):
    return wrapper.MatchMaker(matches=((grain.id, grain.id, among), (grain.id, wall.id, with_wall)))


def places():
    return [[*scene.bodies[i].state.pos, scene.bodies[i].shape.radius] for i in spheres]


collider = wrapper.InsertionSortCollider(
    [wrapper.Bo1_Sphere_Aabb(), wrapper.Bo1_Facet_Aabb(), wrapper.Bo1_Wall_Aabb()],
    verletDist=given["skins"][0] / 2,
)
physics = wrapper.Ip2_FrictMat_FrictMat_MindlinPhys(
    **{name: by_pair(*(contact[name] for contact in given["contacts"])) for name in given["contacts"][0]}
)
scene.engines = [
    wrapper.ForceResetter(),
    collider,
    wrapper.InteractionLoop(
        [
            wrapper.Ig2_Sphere_Sphere_ScGeom(),
            wrapper.Ig2_Facet_Sphere_ScGeom(hertzian=True),
            wrapper.Ig2_Wall_Sphere_ScGeom(hertzian=True),
        ],
        [physics],
        [wrapper.Law2_ScGeom_MindlinPhys_Mindlin()],
    ),
    wrapper.NewtonIntegrator(damping=0, gravity=given["gravity"]),
]
result = {"version": config.version, "start": places(), "seconds": [], "rebuilds": []}
scene.run(given["run_in"], wait=True)
for skin in given["skins"]:
    collider.verletDist = skin / 2
    scene.run(2, wait=True)  # after the change, pairs are looked for
    before, seconds = collider.numAction, []
    for _ in range(given["stretches"]):
        started = time.perf_counter()
        scene.run(given["steps"], wait=True)
        seconds.append(time.perf_counter() - started)
    result["seconds"].append(seconds)
    result["rebuilds"].append(collider.numAction - before)
result["end"] = places()
result["kinetic_energy"] = sum(clump.mass * clump.vel.squaredNorm() / 2 for clump in clumps)
json.dump(result, open("result.json", "w"))
'''


def simulate(program: str, folder: Path, case: Case[LiftedCylinder], moment: Moment, plan: Plan) -> PeerRun:
    """Run a settled column of grains of one shape and size; see `Peer.run`."""
    write_input(folder, case, moment, plan)
    status = execute([program, "-n", "-x", "-j1", SCRIPT], folder)
    if status:
        raise RuntimeError(f"{program} failed in {folder}: {status}; screen.log says why")
    result = json.loads((folder / OUTPUT).read_text(encoding="utf-8"))
    steps, spheres, timings = _steps(plan), len(result["end"]), {}
    for skin, seconds, rebuilds in zip(plan.skins, result["seconds"], result["rebuilds"], strict=True):
        timings[skin] = Timing(steps, tuple(seconds), spheres, rebuilds / (steps * plan.stretches))
    start, end = np.array(result["start"]), np.array(result["end"])
    return judged(moment, f"Yade {result['version']}", timings, result["kinetic_energy"], start, end)


def write_input(folder: Path, case: Case[LiftedCylinder], moment: Moment, plan: Plan) -> None:
    """Write `column.py`, the script, and `column.json`, which it reads."""
    setup = moment.setup
    grains, shape, scene = setup.grains, setup.shapes[0], case.scene
    size = common_size(moment)
    centers, radii = shape.centers * size, shape.radii * size
    contacts = contacts_of(case, float(radii.max()), float(setup.masses[0]))
    turns = grains.orientations / np.linalg.norm(grains.orientations, axis=1)[:, None]
    given = {
        "time_step": setup.time_step,
        "gravity": setup.gravity,
        "materials": [values(YADE.material_terms(one)) for one in (case.grain_material, scene.wall_material)],
        "contacts": [contact_numbers(contact) for contact in contacts],
        "facets": prism(scene.diameter / 2, scene.height + MARGIN, SIDES).tolist(),
        "centers": centers.tolist(),
        "radii": radii.tolist(),
        "densities": part_densities(centers, radii, float(setup.masses[0])).tolist(),
        "mass": float(setup.masses[0]),
        "inertia": setup.inertias[0].tolist(),
        "positions": grains.positions.tolist(),
        "orientations": turns.tolist(),
        "skins": plan.skins,
        "run_in": plan.run_in,
        "steps": _steps(plan),
        "stretches": plan.stretches,
    }
    (folder / INPUT).write_text(json.dumps(given), encoding="utf-8")
    (folder / SCRIPT).write_text(_SCRIPT, encoding="utf-8")


def _steps(plan: Plan) -> int:
    return math.ceil(plan.steps / HASTE)


def part_densities(centers: np.ndarray, radii: np.ndarray, mass: float) -> np.ndarray:
    """Densities of overlapping spheres whose masses add up to the grain's [kg], about its centre [kg/m3].

    Of all that do, those nearest to equal densities, by the masses. Centres are from that of mass [m].
    """
    volumes = 4.0 / 3.0 * np.pi * radii**3
    equal = volumes * (mass / volumes.sum())
    length = radii.max()
    balance = np.vstack([np.ones(len(radii)), centers.T / length])
    wanted = np.array([mass, 0.0, 0.0, 0.0]) - balance @ equal
    return (equal + np.linalg.lstsq(balance, wanted)[0]) / volumes
