"""Tangential force: Mindlin without slip, with history, EDEM's damping and the Coulomb limit."""

from typing import Any

import warp as wp


@wp.func
def mindlin_stiffness(shear_modulus: Any, radius: Any, overlap: Any):
    """Return the tangential stiffness S_t = 8 G* sqrt(R* d) [N/m].

    Source: Mindlin, Journal of Applied Mechanics 16 (1949) 259-268.
    """
    return type(overlap)(8.0) * shear_modulus * wp.sqrt(radius * overlap)


@wp.func
def advance_displacement(displacement: Any, normal: Any, tangential_velocity: Any, time_step: Any):
    """Return the tangential displacement [m] after a step: turned into the contact's plane, then advanced."""
    return displacement - normal * wp.dot(displacement, normal) + tangential_velocity * time_step


@wp.func
def limited(force: Any, limit: Any):
    """Return a force [N] reduced to a limit."""
    size = wp.length(force)
    if size > limit:
        force = force * (limit / size)
    return force


@wp.func
def coulomb_spring(
    displacement: Any, stiffness: Any, damping_rate: Any, tangential_velocity: Any, limit: Any
):
    """Return tangential force [N] and displacement [m] under the Coulomb limit |F_t| <= mu F_n.

    The spring slides when it alone passes the limit; its displacement then shrinks to the limit, without
    damping. A spring within the limit is damped, and the sum is limited again.

    Source: Cundall and Strack, Geotechnique 29 (1979) 47-65; EDEM 2.7 Theory Reference Guide.
    """
    force = displacement * (-stiffness)
    size = wp.length(force)
    if size > limit:
        keep = limit / size
        displacement = displacement * keep
        force = force * keep
    else:
        force = force - tangential_velocity * damping_rate
        # written out: calling `limited` makes a CPU's step 5 % longer
        size = wp.length(force)
        if size > limit:
            force = force * (limit / size)
    return force, displacement


@wp.func
def free_spring(displacement: Any, stiffness: Any, damping_rate: Any, tangential_velocity: Any, limit: Any):
    """Return tangential force [N] and displacement [m] of a spring under the Coulomb limit.

    The damping has no limit; a sliding spring has no damping.

    Source: LIGGGHTS-PUBLIC 3.8.0, src/tangential_model_history.h, lines 161-218; Yade,
    pkg/dem/HertzMindlin.cpp, Law2_ScGeom_MindlinPhys_Mindlin::go, "MOHR-COULOMB law".
    """
    force = displacement * (-stiffness)
    size = wp.length(force)
    if size > limit:
        keep = limit / size
        displacement = displacement * keep
        force = force * keep
    else:
        force = force - tangential_velocity * damping_rate
    return force, displacement


@wp.func
def sum_spring(displacement: Any, stiffness: Any, damping_rate: Any, tangential_velocity: Any, limit: Any):
    """Return tangential force [N] and displacement [m]; the sum of spring and damping is limited.

    In sliding, the displacement is set so that the sum equals the limit.

    Source: LAMMPS (2022-01-06), src/GRANULAR/pair_granular.cpp, lines 494-533; DEM-Engine 3.0.19,
    FullHertzianForceModel.cu, "Tangential force part"; S. Luding, Granular Matter 10 (2008) 235-246.
    """
    force = displacement * (-stiffness) - tangential_velocity * damping_rate
    size = wp.length(force)
    if size > limit:
        force = force * (limit / size)
        if stiffness > type(limit)(0.0):
            displacement = (force + tangential_velocity * damping_rate) * (type(limit)(-1.0) / stiffness)
    return force, displacement


@wp.func
def stretch_of(force: Any, stiffness: Any):
    """Return the displacement [m] of a spring from its remembered force [N].

    Source: Yade, pkg/dem/HertzMindlin.cpp, Law2_ScGeom_MindlinPhys_Mindlin::go, "SHEAR FORCE"; LAMMPS
    (2022-01-06), src/GRANULAR/pair_granular.cpp, lines 483-489, tangential mindlin/force.
    """
    if stiffness > type(stiffness)(0.0):
        return force * (type(stiffness)(-1.0) / stiffness)
    return force * type(stiffness)(0.0)


@wp.func
def unloaded(contact: Any, history: Any, memory: Any, at: int):
    """Return the displacement [m] or force [N] of the spring, reduced as the contact radius shrinks.

    Source: LAMMPS (2022-01-06), src/GRANULAR/pair_granular.cpp, lines 434-446, tangential mindlin_rescale;
    C. Thornton, S. J. Cummins and P. W. Cleary, Powder Technology 233 (2013) 30-46.
    """
    radius = wp.sqrt(contact.radius * contact.overlap)
    if not contact.is_new and radius < memory[at]:
        history = history * (radius / memory[at])
    memory[at] = radius
    return history
