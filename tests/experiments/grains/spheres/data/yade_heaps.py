"""Heaps of Yade on a plate at z = 0 in its text, clump and VTK formats: ``yade -n -x yade_heaps.py``."""

import math
import random

from yade import export

random.seed(1)


def collapse(clumped):
    """Let a column of spheres, or of the pellets of pellet.multisphere, collapse on a plate of facets."""
    O.reset()
    O.materials.append(FrictMat(young=5e6, poisson=0.3, frictionAngle=math.atan(0.6), density=1000))
    plate = [(-0.05, -0.05, 0), (0.05, -0.05, 0), (0.05, 0.05, 0), (-0.05, 0.05, 0)]
    O.bodies.append([facet([plate[0], plate[1], plate[2]]), facet([plate[0], plate[2], plate[3]])])
    pitch = 0.0068 if clumped else 0.0045
    for layer in range(16 if clumped else 20):
        for i in range(-2, 3):
            for j in range(-2, 3):
                jitter = [random.uniform(-2e-4, 2e-4) for _ in range(2)]
                if math.hypot(i, j) > 2.1:
                    continue
                x, y, z = 0.004 * i + jitter[0], 0.004 * j + jitter[1], 0.004 + pitch * layer
                if clumped:
                    parts = [(-0.0015, 0.0012), (0.0, 0.0015), (0.0015, 0.0012)]
                    O.bodies.appendClumped([sphere((x, y, z + dz), r) for dz, r in parts], discretization=10)
                else:
                    O.bodies.append(sphere((x, y, z), 0.002))
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Facet_Aabb()]),
        InteractionLoop(
            [Ig2_Sphere_Sphere_ScGeom(), Ig2_Facet_Sphere_ScGeom()],
            [Ip2_FrictMat_FrictMat_MindlinPhys(en=0.2, es=0.2, eta=0.3, krot=0.005)],
            [Law2_ScGeom_MindlinPhys_Mindlin(includeMoment=True)],
        ),
        NewtonIntegrator(gravity=(0, 0, -9.81), damping=0.05),
    ]
    O.dt = 2e-5
    O.run(20000, True)


collapse(clumped=False)
export.text("yade_spheres.txt")
export.textExt("yade_spheres_id.txt", format="id_x_y_z_r_matId")
export.VTKExporter("yade_").exportSpheres(what={"radius": "b.shape.radius"})
VTKRecorder(fileName="yade-", recorders=["spheres"], multiblock=False)()
collapse(clumped=True)
export.textClumps("yade_clumps.txt")
exit()
