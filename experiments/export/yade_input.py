"""The lifted cylinder as a Python program of Yade."""

from __future__ import annotations

from collections.abc import Sequence

from experiments.export.exporter import Translated, Translation
from experiments.export.lift import Lift, disc, prism
from experiments.export.same_rain import HEAP, SCRIPT, program, program_files, same_rain_rows, world_of

_ROWS = (
    Translated(
        "clumps",
        "rigid, mass properties of the union of the spheres",
        "`appendClumped` of spheres without a mass and a member without a surface that has mass and moments; "
        "both are checked. The spheres' own `state.mass` is the grain's: the damping takes it from there",
    ),
    Translated(
        "edges of the tube's facets",
        "none",
        "a sphere over an edge touches both facets at once; they share its stiffness and damping",
    ),
    Translated(
        "limit of rolling",
        "mu_r R*",
        "the same, set contact by contact; among unequal spheres that of equal ones in the first 20 steps",
    ),
    Translated("endless plate", "plane", "one triangle, far larger than the heap"),
    Translated("numerical damping", "none", "none: `NewtonIntegrator(damping=0)`, whose default is 0.2"),
    Translated("rotation into shear", "at the contact point", "the same: `avoidGranularRatcheting=False`"),
)


def translate_lift(
    lift: Lift,
    materials: Sequence[dict[str, float]],
    contacts: Sequence[dict[str, float]],
    warnings: tuple[str, ...],
    laws: Sequence[Translated],
) -> Translation:
    """Write the program and what it reads.

    Parameters
    ----------
    lift
        The test.
    materials, contacts
        Terms of the grains, the tube and the plate, and of their contacts with grains.
    warnings, laws
        What Yade lacks of the test, and the rows of the README on its contact laws.
    """
    scene, world = lift.scene, world_of(lift)
    numbers = {
        "materials": list(materials),
        "contacts": list(contacts),
        "domain": world.domain,
        "tube": prism(scene.diameter / 2, scene.height).tolist(),
        "plate": None if scene.plate_diameter is None else disc(scene.plate_diameter / 2).tolist(),
    }
    return Translation(
        files=program_files(lift, world, program("Yade", "yade"), numbers),
        main=SCRIPT,
        command=("yade", "-n", "-x", "-j1", SCRIPT),
        heap=HEAP,
        translated=(*same_rain_rows(lift), *laws, *_ROWS),
        warnings=warnings,
    )
