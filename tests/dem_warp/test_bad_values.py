"""Bad values: each is refused before anything runs, with its place, the rule, and the value."""

from dataclasses import replace
from math import inf, nan
from pathlib import Path

import numpy as np
import pytest
import worlds
from worlds import BALL, BOOT, GRAIN, PYRAMID, SMALL_TUBE, STEEL, ball_case, grains, pair, small_case, solve

import dem_warp
from dem_warp import Case, DrawDown, Drum, GrainPopulation, Interaction, Material, ShapeMixture, SizeClasses
from dem_warp.checkpoint import Checkpoints
from dem_warp.clump_fitting import fit_clump
from dem_warp.clumps import ClumpShape
from dem_warp.laws.capillary import CapillaryBridge
from dem_warp.laws.conventions import RELATIVE, ContactLaws, laws_named
from dem_warp.laws.elastic_plastic_rolling import ElasticPlasticRolling
from dem_warp.laws.hysteretic_spring import HystereticSpring
from dem_warp.laws.jkr import JKR
from dem_warp.laws.linear_cohesion import LinearCohesion
from dem_warp.laws.micro_slip import MicroSlip
from dem_warp.laws.wall_adhesion import WallAdhesion
from dem_warp.materials import DAMPINGS
from dem_warp.solids import parse_solid
from dem_warp.walls import Cone, Cylinder, Disc, Mesh, Motion, Plane

ORIGIN, UP = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
ONE, EVEN = (1.0,), (0.5, 0.5)
CASE, SPHERE = small_case(), parse_solid("sphere:4")
DRUM = Drum(0.05, 0.018, STEEL, 1.0)
BOXES = DrawDown(0.08, 0.0165, 0.03, 0.028, 0.045, STEEL)
PAIR = grains([ORIGIN, (0.1, 0.0, 0.0)])
WORLD = worlds.world(PAIR, pair(), 1e-5)
WITH_A_MESH = replace(WORLD, walls=((Mesh([ORIGIN, UP, (1.0, 0.0, 0.0)], [[0, 1, 2]]), 1), (Plane(), 1)))
ONE_SPHERE, CORNERS = np.zeros((1, 3)), np.vstack([np.zeros(3), np.eye(3)])


def with_parts(*names: str) -> Case:
    parts = tuple(dem_warp.WallPart(name, STEEL, Interaction(0.5, 0.5, 0.0)) for name in names)
    return replace(ball_case(DRUM, 0.5), wall_parts=parts)


CASES = [
    (lambda: dem_warp.Numerics(precision="half"), "precision: must be one of mixed, double, got 'half'"),
    (lambda: replace(CASE, seed=-1), "Case.seed: must be an integer from 0 .* got -1"),
    (lambda: dem_warp.simulate([CASE], device="gpu"), "device: must be one of .*cpu.*, got 'gpu'"),
    (lambda: dem_warp.simulate_frames(CASE, 1, "cpu"), "simulate_frames.count: must be 2 or more, got 1"),
    (lambda: Checkpoints(Path("none"), -1.0), r"Checkpoints.every: must be 0 or more \[s\], got -1"),
    (
        lambda: dem_warp.LiftedCylinder(-0.03, 0.1, STEEL),
        "LiftedCylinder.diameter: must be positive.* got -0.03",
    ),
    (lambda: replace(SMALL_TUBE, plate_diameter=0.01), "plate_diameter: must be at least the tube's .* 0.01"),
    (lambda: replace(BOXES, slot=0.08), r"DrawDown.slot: must be below the width 0.08 \[m\], got 0.08"),
    (lambda: replace(DRUM, filling=0.9), "Drum.filling: must be at most 0.8, got 0.9"),
    (lambda: replace(DRUM, inclination=1.5), "bed at the lower end must be below the hatch at 0.045"),
    (lambda: replace(DRUM, camera_distance=0.3), "camera_distance: must be left out .* depth, got 0.3"),
    # w^2 r = g at 3.153 revolutions a second.
    (lambda: replace(DRUM, rotation_rate=3.2), "rotation_rate: must be below 3.153 .1/s., .* got 3.2"),
    (lambda: with_parts("lid"), "part of the walls: must be one of shell, ends, front, back, got 'lid'"),
    (lambda: with_parts("ends", "ends"), "Case.wall_parts: must name each part once"),
]
POPULATIONS = [
    (lambda: GrainPopulation(PYRAMID, GRAIN, size_mean=0.0), "size_mean: must be positive, got 0.0"),
    (lambda: GrainPopulation(PYRAMID, GRAIN, size_sd=0.4), "size_sd: .* below size_mean / 3, got 0.4"),
    (
        lambda: GrainPopulation(PYRAMID, GRAIN, 1.0, 0.05, SizeClasses((0.9, 1.2), EVEN)),
        "size_mean: must be that of the classes, .* got 1.0",
    ),
    (lambda: ShapeMixture((), ()), "ShapeMixture.shapes: must hold at least one shape, got none"),
    (lambda: ShapeMixture((BALL, BOOT), ONE), "fractions: must be one for each of 2 shapes, got 1"),
    (lambda: ShapeMixture((BALL, BOOT), (1.2, -0.2)), r"\[1\]: must be finite and 0 or more, got -0.2"),
    (lambda: ShapeMixture((BALL, BOOT), (0.5, 0.4)), r"must add up to 1, got \(0.5, 0.4\), together 0.9"),
    (lambda: SizeClasses((), ()), "SizeClasses.fractions: must be one for each of 0 sizes, got 0"),
    (lambda: SizeClasses(ONE, EVEN), "SizeClasses.fractions: must be one for each of 1 sizes, got 2"),
    (lambda: SizeClasses((1.0, 0.9), EVEN), r"must be positive, finite and increasing, got \(1.0, 0.9\)"),
    (
        lambda: SizeClasses((0.9, 1.1), (0.5, 0.4)),
        r"SizeClasses.fractions: must add up to 1, got \(0.5, 0.4\)",
    ),
    (lambda: SizeClasses((0.9, 1.1), (1.0, 0.0)), "SizeClasses.fractions: must be positive"),
]
SHAPES = [
    (lambda: ClumpShape.from_spheres(np.zeros((2, 3)), ONE), r"got \(2, 3\) and \(1,\)"),
    (lambda: ClumpShape.from_spheres(np.zeros((0, 3)), []), "S >= 1"),
    (lambda: ClumpShape.from_spheres(np.zeros((2, 3)), [1.0, 0.0]), r"\[1\]: must be positive and finite"),
    (lambda: ClumpShape.from_spheres([(0.0, 0.0, inf)], ONE), r"centers\[0\]: must be finite"),
    (lambda: ClumpShape.from_spheres(ONE_SPHERE, ONE, resolution=0), "resolution: must be 1 or more, got 0"),
    (lambda: ClumpShape(ONE_SPHERE, ONE, -1.0, np.ones(3)), "volume: must be positive and finite"),
    (lambda: ClumpShape(ONE_SPHERE, ONE, 1.0, np.zeros(3)), "inertia_over_mass: must be three positive"),
    (lambda: BALL.elongated(0.1), "elongation: must be 0 for a shape of one sphere, got 0.1"),
    (lambda: BALL.elongated(-0.1), "elongation: must be finite and 0 or more, got -0.1"),
    (lambda: parse_solid("cube:3"), "must be one of sphere:DIAMETER, ellipsoid:LENGTHxWIDTHxTHICKNESS"),
    (lambda: parse_solid("cylinder:6"), "must be cylinder:LENGTHxDIAMETER in mm: got 1 dimensions"),
    (lambda: parse_solid("ellipsoid:6x3xthin"), "LENGTHxWIDTHxTHICKNESS in mm: could not convert"),
    (lambda: parse_solid("capsule:2x2"), "length: must be above the diameter"),
    (lambda: fit_clump(SPHERE, 0), "sphere_count: must be at least 1, got 0"),
    (lambda: fit_clump(SPHERE, 1, protrusion=-1e-4), "protrusion: must be finite and 0 or more"),
    (lambda: fit_clump(SPHERE, 1, resolution=4), "resolution: must be at least 8, got 4"),
]
LAWS = [
    (lambda: Material(0.0, 1e6, 0.3), "density: must be positive and finite"),
    (lambda: Material(698.0, -1.0, 0.3), "shear_modulus: must be positive and finite"),
    (lambda: Material(698.0, 1e6, 0.51), "Material.poisson_ratio: must be at most 0.5, got 0.51"),
    (lambda: Interaction(0.0, 0.5, 0.05), "Interaction.restitution: must be positive and finite, got 0.0"),
    (lambda: Interaction(1.01, 0.5, 0.05), "Interaction.restitution: must be at most 1, got 1.01"),
    (lambda: Interaction(0.5, 0.5, inf), "rolling_friction: must be finite and 0 or more, got inf"),
    *((lambda law=law: DAMPINGS[law](1.5), r"restitution: must be at most 1, got 1\.5") for law in DAMPINGS),
    (lambda: ContactLaws(rolling="none"), "ContactLaws.rolling: must be one of own_spin, .* got 'none'"),
    (lambda: ContactLaws(rolling_stiffness=0.0), "rolling_stiffness: must be positive .* got 0.0"),
    (lambda: ContactLaws(damping_rate=1.0), "damping_rate: must be given with .* got 1.0 with 'tsuji'"),
    (
        lambda: ContactLaws(normal_damping="mass_velocity", damping_rate=1.0),
        r"tangential_damping \(with normal_damping mass_velocity\): must be one of normal, none",
    ),
    (lambda: laws_named("ligghts"), "laws: must be one of edem, .* got 'ligghts'"),
    (
        lambda: replace(CASE, laws=RELATIVE, mechanisms=(ElasticPlasticRolling(),)),
        "ContactLaws.rolling: must be 'own_spin' with the mechanism elastic_plastic_rolling, got",
    ),
    (
        lambda: replace(CASE, laws=laws_named("lammps"), mechanisms=(MicroSlip(),)),
        "ContactLaws.sliding: must be 'spring' with the mechanism micro_slip, got 'sum'",
    ),
    (lambda: LinearCohesion(cohesion_energy_density=-1.0), "cohesion_energy_density: .* got -1.0"),
    (lambda: LinearCohesion(cohesion_energy_density=nan), "must be finite"),
    (lambda: LinearCohesion(between="friends"), "LinearCohesion.between: must be one of .* got 'friends'"),
    (lambda: WallAdhesion(between="all"), "WallAdhesion.between: must be one of walls, got 'all'"),
    (lambda: CapillaryBridge(surface_tension=0.07), "CapillaryBridge.bridge_volume: .* got 0.0"),
    (lambda: CapillaryBridge(contact_angle=1.6), "CapillaryBridge.contact_angle: .* got 1.6"),
    (lambda: MicroSlip(micro_slip=0.5), "MicroSlip.micro_slip: must be .* got 0.5"),
    (lambda: pair(mechanisms=(LinearCohesion(), LinearCohesion())), "mechanisms: must be different"),
    (
        lambda: pair(mechanisms=(HystereticSpring(plasticity=0.1), JKR(work_of_adhesion=0.1))),
        "jkr excludes hysteretic_spring",
    ),
]
WORLDS = [
    (lambda: Plane(normal=ORIGIN), r"normal: must be .* non-zero length, got \(0.0, 0.0, 0.0\)"),
    (lambda: Cylinder(ORIGIN, -0.01, 0.1), "radius: must be positive .* got -0.01"),
    (lambda: Cylinder(ORIGIN, 0.01, 0.1, ORIGIN), "direction: must be a finite vector"),
    (lambda: Cylinder((0.0, inf, 0.0), 0.01, 0.1), "Cylinder.point: must be three finite numbers"),
    (lambda: Disc(ORIGIN, UP, 0.01, 0.01), r"inner_radius: .* 0.01 \[m\], got 0.01"),
    (lambda: Cone(ORIGIN, 0.0, 0.0, 0.1), "Cone.radius, upper_radius: must not both be 0"),
    (lambda: Cone(ORIGIN, 0.1, 0.2, 0.0), "Cone.length: must be positive .* got 0.0"),
    (lambda: Motion(velocity=(0.0, nan, 0.0)), "Motion.velocity: must be three finite numbers"),
    (lambda: Motion(frequency=-1.0), "Motion.frequency: must be finite and 0 or more .Hz., got -1.0"),
    (lambda: Motion(amplitude=UP), "Motion.frequency: must be positive with amplitude"),
    (lambda: Mesh(np.zeros((3, 2)), [[0, 1, 2]]), r"vertices: must be finite, shape \(n, 3\) .* \(3, 2\)"),
    (lambda: Mesh(CORNERS, [[0, 1]]), r"must be integers, shape \(m, 3\), got int64 of shape \(1, 2\)"),
    (lambda: Mesh(CORNERS, [[0, 1, 2], [0, 1, 4]]), r"from 0 to 3, got others in triangles \[1\]"),
    (lambda: Mesh(CORNERS, [[0, 1, 2], [0, 0, 3]]), r"must have an area, got triangles \[1\] without"),
    (lambda: replace(PAIR, sizes=np.ones(3)), r"Grains.sizes: must have shape \(2,\), got \(3,\)"),
    (
        lambda: replace(PAIR, positions=np.array([ORIGIN, (inf, 0.0, 0.0)])),
        r"Grains.positions: must be finite, got others for grains \[1\]",
    ),
    (lambda: replace(PAIR, densities=np.arange(2.0)), r"must be positive, got others for grains \[0\]"),
    (lambda: replace(WORLD, time_step=0.0), "time_step: must be positive and finite .s., got 0.0"),
    (lambda: replace(WORLD, skin=nan), "skin: must be positive and finite .m., got nan"),
    (lambda: replace(WORLD, speed_limit=-1.0), "speed_limit: must be positive and finite .m/s., got -1.0"),
    (lambda: replace(WORLD, weighed=(2,)), r"weighed: must be different numbers of walls, 0 to 1, got \(2"),
    (lambda: replace(WORLD, weighed=(1, 1)), "weighed: must be different numbers of walls, 0 to 1"),
    (lambda: replace(WORLD, domain=(ORIGIN, (1.0, -1.0, 1.0))), "domain: lower corner must be below"),
    (lambda: replace(WORLD, walls=((Plane(), 2), (Plane(), 1))), "WorldSetup.walls: .*2"),
    (lambda: solve(WORLD, replace(WORLD, walls=WORLD.walls[:1])), "must have the same number of walls"),
    (lambda: solve(WORLD, WITH_A_MESH), "must have the same use of meshes"),
    (
        lambda: solve(WORLD, replace(WORLD, contacts=(pair(mechanisms=(LinearCohesion(),)),) * 2)),
        "all in a batch must have the same mechanisms",
    ),
]


@pytest.mark.parametrize(("build", "message"), [*CASES, *POPULATIONS, *SHAPES, *LAWS, *WORLDS])
def test_a_bad_value_is_refused_with_its_rule(build, message):
    with pytest.raises(ValueError, match=message):
        build()
