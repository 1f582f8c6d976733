"""Commands of LAMMPS: head, box, contacts, bodies and molecule files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from experiments.export.lift import Template
from experiments.export.script_text import plain

QUIT = "quit 1"
"""Command that ends a program that has failed."""

_HEAD = """\
units si
atom_style sphere
atom_modify map {map}
boundary f f f
newton off
comm_modify vel yes{cutoff}
"""

_NEIGHBORS = """\
neighbor {skin:.6g} bin
neigh_modify delay 0 every 1 check yes{binsize}
"""

BODY_NUMBERS = "fix clump all property/atom mol ghost yes\n"
"""Command that gives each atom the number of its body."""

_BODIES = """\
neigh_modify exclude molecule/intra all
group nothing empty
# gravity acts on the bodies alone: spheres of a body overlap, and together are heavier than it is
{weight}\
fix bodies all rigid/small molecule {bodies} gravity weight
"""


def head(atom_map: str, cutoff: float = 0.0) -> str:
    """Write the first commands: how atoms are found and sorted, the reach of communication [m] if not 0."""
    return _HEAD.format(map=atom_map, cutoff=f" cutoff {cutoff:.6g}" if cutoff else "")


def box(sides: Sequence[float], types: int = 1) -> str:
    """Write the box of some types of atoms by its lower and upper side along x, y and z [m]."""
    return f"region box block {plain(sides, 6)}\ncreate_box {types} box\n"


def neighbors(skin: float, bin_size: float = 0.0) -> str:
    """Write the neighbour lists: their reach beyond contact, and the side of their bins [m].

    A side of 0 leaves it to LAMMPS.
    """
    return _NEIGHBORS.format(skin=skin, binsize=f" binsize {bin_size:.6g}" if bin_size else "")


def contacts(pairs: Mapping[str, str], time_step: float) -> str:
    """Write the granular words for each pair of types, and the time step [s]."""
    lines = "".join(f"pair_coeff {types} {words}\n" for types, words in pairs.items())
    return f"pair_style granular\n{lines}timestep {time_step:.9g}\n"


def granular_words(terms: Mapping[str, float], words: Mapping[str, str], surface_energy: float = 0.0) -> str:
    """Write a contact with its terms and the words for each law, after ``pair_coeff`` or ``granular``.

    With a surface energy [J/m2] it adheres after Derjaguin, Muller and Toporov.
    """
    damping = terms["e"] if "e" in terms else terms["eta_n0"]
    normal = f"hertz/material {terms['E']!r} {damping!r} 0"
    if surface_energy > 0.0:
        normal = f"dmt {terms['E']!r} {damping!r} 0 {surface_energy!r}"
    return (
        f"{normal} "
        f"tangential {words['tangential_history']} {terms['k_t']!r} {terms['x_gamma,t']!r} {terms['mu_s']!r} "
        f"rolling sds {terms['k_roll']!r} {terms['gamma_roll']!r} {terms['mu_roll']!r} "
        f"{words['attraction']} {words['normal_damping']}"
    ).replace("  ", " ")


def weight(gravity: Sequence[float], group: str = "all") -> str:
    """Write a constant gravity [m/s2] on a group of atoms; nothing when it is zero."""
    size = sum(part**2 for part in gravity) ** 0.5
    direction = plain(part / size for part in gravity) if size else ""
    return f"fix weight {group} gravity {size:.9g} vector {direction}\n" if size else ""


def rigid_bodies(gravity: Sequence[float], bodies: str = "mol grains") -> str:
    """Write the motion of grains whose spheres are a molecule each, under a gravity [m/s2].

    `bodies` are the words that say where their masses and inertias are.
    """
    return _BODIES.format(weight=weight(gravity, "nothing"), bodies=bodies)


def dump(file: str, columns: str = "id type") -> str:
    """Write the spheres into a file, with columns before their places and radii."""
    return f"write_dump all custom {file} {columns} x y z radius modify sort id format float %.9g\n"


def written_shares(fractions: Sequence[float]) -> list[str]:
    """Write parts that add up to 1 within LAMMPS' tolerance."""
    return [f"{fraction:.15g}" for fraction in (*fractions[:-1], 1.0 - sum(fractions[:-1]))]


def molecule_file(number: int) -> str:
    """Return the name of the file of a template."""
    return f"grain{number}.mol"


def molecule_text(template: Template, atom_type: int = 1) -> str:
    """Write a template as a molecule file: mass and inertia are the body's."""
    count = template.shape.sphere_count
    xx, yy, zz = template.inertia.tolist()
    rows = list(enumerate(zip(template.centers, template.radii, strict=True), 1))
    share = template.mass / count
    sections = {
        "Coords": [f"{i} {plain(center)}" for i, (center, _) in rows],
        "Types": [f"{i} {atom_type}" for i, _ in rows],
        "Diameters": [f"{i} {2.0 * radius:.9g}" for i, (_, radius) in rows],
        "Masses": [f"{i} {share:.9g}" for i, _ in rows],
    }
    head = (
        f"# a grain of size {template.size:.6g}\n\n{count} atoms\n{template.mass:.9g} mass\n0 0 0 com\n"
        f"{xx:.9g} {yy:.9g} {zz:.9g} 0 0 0 inertia\n"
    )
    return head + "".join(f"\n{name}\n\n" + "\n".join(lines) + "\n" for name, lines in sections.items())
