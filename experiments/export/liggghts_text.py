"""Commands of LIGGGHTS: head, contacts, templates of grains and their rain."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from experiments.export.lift import Template
from experiments.export.script_text import Rain, plain, space_words

_HEAD = """\
atom_style granular
atom_modify map array{sort}
boundary f f f
newton off
communicate single vel yes
units si
hard_particles yes
soft_particles yes  # a softened modulus is meant so
region box block {box} units box
create_box {count} box  # types: {types}
neighbor {skin:.6g} bin
neigh_modify delay 0 every 1 check yes{binsize}
"""

_CONTACTS = """\
{properties}
pair_style gran model {model}
pair_coeff * *
timestep {time_step:.9g}
"""

_RAIN = """\
{templates}
fix sizes all particledistribution/discrete/numberbased {sizes_seed} {kinds} {fractions}
region rain {space} units box
fix rain all insert/rate/region seed {rain_seed} distributiontemplate sizes &
    nparticles {count} particlerate {rate:.6g} insert_every {rain.steps} overlapcheck yes all_in yes &
    maxattempt 500 vel constant 0 0 -{rain.speed} orientation random region rain ntry_mc 10000

"""

_DUMP = """\
dump {name} all custom 1 {file} id {body} x y z radius
dump_modify {name} sort id format "%d %d %.9g %.9g %.9g %.9g"
run 0
undump {name}
"""

_ORDER = ("normal", "tangential_history", "cohesion", "rolling", "tangential_damping", "attraction")
"""Order in which LIGGGHTS wants the words of its model."""

Numbers = Mapping[str, float]


def model_words(words: Mapping[str, str]) -> str:
    """Join LIGGGHTS' words for each law to those after ``model``."""
    return " ".join(words[law] for law in _ORDER if words.get(law))


def head(
    types: Sequence[str], box: Sequence[float], skin: float, bin_size: float = 0.0, sort: str = ""
) -> str:
    """Write the first commands, up to the neighbour lists.

    `types` names the types of atoms, `box` has its lower and upper side along x, y and z [m]. The lists reach
    `skin` beyond contact, in bins of a side [m]; 0 leaves it to LIGGGHTS. `sort` are words on sorting.
    """
    return _HEAD.format(
        sort=f" {sort}" if sort else "",
        box=plain(box, 6),
        count=len(types),
        types=", ".join(f"{number} {name}" for number, name in enumerate(types, 1)),
        skin=skin,
        binsize=f" binsize {bin_size:.6g}" if bin_size else "",
    )


def contacts(properties: Mapping[str, str], model: str, time_step: float) -> str:
    """Write the global properties by name, the contact model and the time step [s]."""
    lines = (f"fix {name} all property/global {name} {text}" for name, text in properties.items())
    return _CONTACTS.format(properties="\n".join(lines), model=model, time_step=time_step)


def properties(materials: Sequence[Numbers], contact: Callable[[int, int], Numbers]) -> dict[str, str]:
    """Write the terms of the materials and of the contacts of each pair of types, numbered from 0."""
    types = range(len(materials))
    written = {name: f"peratomtype {plain([each[name] for each in materials])}" for name in materials[0]}
    for name in contact(0, 0):
        rows = (plain([contact(i, j)[name] for j in types]) for i in types)
        written[name] = f"peratomtypepair {len(materials)} {'  '.join(rows)}"
    return written


def weight(gravity: Sequence[float]) -> str:
    """Write a constant gravity [m/s2]; nothing when it is zero."""
    size = sum(part**2 for part in gravity) ** 0.5
    return f"fix weight all gravity {size} vector {plain(part / size for part in gravity)}\n" if size else ""


def grain_template(number: int, template: Template, seed: int, atom_type: int = 1) -> str:
    """Write a template as LIGGGHTS' fix ``grain{number}``; the seed is a prime."""
    material = f"atom_type {atom_type} density constant {template.density:.9g}"
    if template.shape.sphere_count == 1:
        radius = float(template.radii[0])
        return f"fix grain{number} all particletemplate/sphere {seed} {material} radius constant {radius:.9g}"
    spheres = " &\n    ".join(
        plain([*center, radius]) for center, radius in zip(template.centers, template.radii, strict=True)
    )
    xx, yy, zz = template.inertia.tolist()
    return (
        f"fix grain{number} all particletemplate/multisphere {seed} {material} &\n"
        f"    nspheres {template.shape.sphere_count} ntry 100000 spheres &\n    {spheres} &\n"
        f"    type {number} mass {template.mass:.9g} &\n"
        f"    inertia_tensor {xx:.9g} 0 0 {yy:.9g} 0 {zz:.9g} use_density"
    )


def dump(name: str, file: str, body: str = "type") -> str:
    """Write the spheres into a file, with their type or the number of their body."""
    return _DUMP.format(name=name, file=file, body=body)


def pouring(kinds: Sequence[tuple[Template, float, int]], rain: Rain, seeds: Sequence[int]) -> str:
    """Write the templates and the rain of grains.

    `kinds` are templates with their share of the number of grains and their type of atom; `seeds` are primes,
    two and one for each template.
    """
    sizes_seed, rain_seed, *own = seeds
    words = [
        grain_template(number, template, seed, atom_type)
        for number, ((template, _, atom_type), seed) in enumerate(zip(kinds, own, strict=True), 1)
    ]
    return _RAIN.format(
        templates="\n".join(words),
        sizes_seed=sizes_seed,
        kinds=len(kinds),
        fractions=" ".join(f"grain{number} {part:.9g}" for number, (_, part, _) in enumerate(kinds, 1)),
        rain=rain,
        space=space_words(rain.section, rain.bottom, rain.top),
        count=rain.count,
        rate=rain.rate,
        rain_seed=rain_seed,
    )
