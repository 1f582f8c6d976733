"""Studies that cannot be: each is refused with the rule, the key and the line that broke it."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from small_study import ANGLE

from experiments.io.errors import StudyError
from experiments.studyfile import load_study

TUBE = '[scene.lifted-cylinder]\ndiameter = "28 mm"\nheight = "28 mm"\n'
COUNT = 'grain_count = 30\nrain_rate = "3000 1/s"\n'
HOPPER = '[scene.hopper]\ndiameter = "40 mm"\nfill_depth = "30 mm"\noutlet = "18 mm"\n'
DRUM = (
    '[scene.drum]\ndiameter = "32 mm"\nlength = "12 mm"\nrotation_rate = "1 1/s"\nrest_speed = "0.05 m/s"\n'
)
DIE = '[scene.compression]\ndiameter = "40 mm"\nfill_depth = "30 mm"\nstress = "1 kPa"\n'
DROP = '[scene.drop]\nheight = "100 mm"\n'
SHEAR = '[scene.shear]\nwidth = "40 mm"\nfill_depth = "30 mm"\nstress = "1 kPa"\nspeed = "0.05 m/s"\n'
POURED = HOPPER.replace("hopper", "poured-heap") + 'drop = "50 mm"\nmass = "5 g"\nmass_rate = "20 g/s"\n'
SEEN = '[[response]]\nobservable = "{}"\n'
SHAPES = (
    '[grain.shapes.whole]\nsphere = "2 mm"\n[grain.shapes.split]\nclump = "split.txt"\nfraction = 0.25\n\n'
)
SIZES = '[grain.sizes]\ndistribution = "lognormal"\nmedian = "3.6 mm"\ngeometric_sd = 1.2\nby = "volume"\n\n'
RESPONSES = """
[response-scene.bin.hopper]
diameter = "40 mm"
fill_depth = "30 mm"
outlet = "20 mm"

[[response]]
observable = "solid_fraction"
mean = 0.55
sd = 0.01
n = 4

[[response]]
name = "outflow"
observable = "flow_rate"
scene = "bin"
mean = "12 g/s"
sd = "0.4 g/s"
n = 5
"""
FACTOR = '[[factor]]\nname = "{}"\nlabel = "x"\nparameter = "{}"\nlow = 0.1\nhigh = 0.2\n'
GRAINS, FREE = "contact.grain-grain.static_friction", "mechanism.jkr.work_of_adhesion"
IGNORED = '[solver.laws]\nbase = "lammps"\nnormal_damping = "mass_velocity"\ndamping_rate = "200 1/s"\n'
PARAMETER = f'parameter = "{GRAINS}"'

WITHOUT_LINE = ("", "scene", "response-scene.target", "factor C")

Refused = tuple[tuple[tuple[str, str], ...], str, str, str]
"""Changes of the small study, text added to it, the key that is named, and the rule."""


def changed(old: str, new: str, key: str, rule: str) -> Refused:
    return ((old, new),), "", key, rule


def added(text: str, key: str, rule: str) -> Refused:
    return (), f"\n{text}\n", key, rule


def scene(section: str, key: str, rule: str, add: str = "") -> Refused:
    """Replace the heap by another test."""
    return ((TUBE + COUNT, section), (ANGLE, "")), add, key, rule


def shapes(old: str, new: str, key: str, rule: str) -> Refused:
    """Change one of several shapes."""
    assert old in SHAPES
    return (('sphere = "2 mm"\n', ""), ("[wall]", f"{SHAPES.replace(old, new)}[wall]")), "", key, rule


def sizes(old: str, new: str, key: str, rule: str) -> Refused:
    """Change a distribution of sizes."""
    assert old in SIZES
    return (("[wall]", f"{SIZES.replace(old, new)}[wall]"),), "", key, rule


def response(old: str, new: str, key: str, rule: str) -> Refused:
    """Change one of several responses."""
    assert RESPONSES.count(old) == 1
    return (), RESPONSES.replace(old, new), key, rule


REFUSED = [
    changed('sphere = "2 mm"', "sphere = 2", "grain.sphere", "unit of length"),
    changed('sphere = "2 mm"', 'sphere = "-2 mm"', "grain.sphere", "greater than 0"),
    changed('sphere = "2 mm"', 'sphere = "wide"', "grain.sphere", "must be a number"),
    changed('sphere = "2 mm"', 'clump = "none.txt"', "grain.clump", "no such file"),
    changed('sphere = "2 mm"', "", "grain", "needs a clump"),
    changed('sphere = "2 mm"', 'spere = "2 mm"', "grain.spere", "did you mean 'sphere'?"),
    changed(
        "poisson_ratio = 0.25", "poisson_ratio = 0.7", "grain.poisson_ratio", "less than or equal to 0.5"
    ),
    changed(
        "modulus_scale = 400.0", "modulus_scale = 1e12", "numerics.modulus_scale", "modulus of 1 kPa or more"
    ),
    changed('density = "700 kg/m^3"', 'density = "1.250,5 kg/m^3"', "grain.density", 'any: "1250.5 kg/m^3"'),
    changed('density = "700 kg/m^3"', 'density = "1 250 kg/m^3"', "grain.density", 'any: "1250 kg/m^3"'),
    changed('density = "700 kg/m^3"', 'density = "1,250.5 kg/m^3"', "grain.density", 'any: "1250.5 kg/m^3"'),
    changed('sd = "0.5 deg"\n', "", "target", "missing: sd"),
    changed("low = 0.2", "low = 0.9", "factor[1]", "low must be below high"),
    changed("low = 0.2", "low = -0.2", "factor[1]", "must stay within 0"),
    changed(PARAMETER, 'parameter = "contact.friction"', "factor[1].parameter", "quantity of the study"),
    changed(
        "restitution = 0.2\n",
        "restitution = 0.2\nstatic_friction = 0.5\n",
        GRAINS,
        "varied by the factor 'E'",
    ),
    changed('name = "E"', 'name = "E:F"', "factor[1].name", "pattern"),
    *(
        changed('name = "E"', f'name = "{name}"', "factor[1].name", "is a column")
        for name in ("seed", "case_key", "solid_fraction", "height", "angle_1", "dummy2")
    ),
    added(FACTOR.format("E_coded", FREE), "factor[2].name", "is a column"),
    added(FACTOR.format("E", FREE), "", "may have the same name"),
    added(FACTOR.format("F", GRAINS), "", "may have the same parameter"),
    added(
        "[campaign.climb]\nstart = { Q = 0.3 }\nstep = { Q = 0.1 }",
        "campaign.climb.start.Q",
        "must name a factor",
    ),
    added("[campaign.screning]\nruns = 12", "campaign.screning", "did you mean 'screening'?"),
    added("[campaign.screening]\nruns = 13", "campaign.screening.runs", "multiple of 4"),
    added("[surplus]", "surplus", "unknown key"),
    # Shapes and sizes
    shapes("fraction = 0.25", "fraction = 1.25", "grain.shapes.split.fraction", "less than or equal to 1"),
    shapes("fraction = 0.25", "fractoin = 0.25", "grain.shapes.split.fractoin", "did you mean 'fraction'?"),
    shapes('"split.txt"', '"none.txt"', "grain.shapes.split.clump", "no such file"),
    shapes('"split.txt"', '"split.txt"\nsphere = "1 mm"', "grain.shapes.split", "not both"),
    shapes("fraction = 0.25", "", "grain", "every shape but one needs its fraction"),
    shapes('sphere = "2 mm"', 'sphere = "2 mm"\nfraction = 0.7', "grain", "add up to 1"),
    changed(
        'sphere = "2 mm"', 'sphere = "2 mm"\nelongation = 0.3', "grain", "elongation: must be 0 for a shape"
    ),
    sizes('by = "volume"', "", "grain.sizes", "a distribution needs by"),
    sizes("geometric_sd = 1.2", "", "grain.sizes", "a lognormal distribution needs geometric_sd"),
    sizes("geometric_sd = 1.2", "geometric_sd = 0.9", "grain.sizes.geometric_sd", "must be greater than 1"),
    sizes("geometric_sd = 1.2", 'geometric_sd = 1.2\nsd = "1 mm"', "grain.sizes", "must not have sd"),
    changed(
        'sphere = "2 mm"',
        'sphere = "2 mm"\nsize_mean = 0.5\nsize_sd = 0.2',
        "grain",
        "below size_mean / 3, got 0.2",
    ),
    sizes('"lognormal"', '"log"', "grain.sizes.distribution", "must be 'normal', 'lognormal'"),
    sizes('distribution = "lognormal"', 'counts = "none.csv"', "grain.sizes.counts", "no such file"),
    sizes("[grain.sizes]", "size_sd = 0.1\n[grain.sizes]", "grain", "or size_sd, not both"),
    sizes(
        'by = "volume"', 'by = "volume"\ncut = [0.9, 0.1]', "grain.sizes", "cut must rise, got 0.9 and 0.1"
    ),
    sizes('by = "volume"', 'by = "volume"\nclasses = 0', "grain.sizes.classes", "greater than or equal to 1"),
    sizes(
        SIZES,
        '[grain.sizes]\ndistribution = "normal"\nmean = "3 mm"\nsd = "2 mm"\nby = "number"\n',
        "grain.sizes",
        "the sizes at the lower cut, 0.01, must be positive: raise it",
    ),
    # Scenes
    scene(HOPPER.replace('"18 mm"', '"41 mm"'), "scene.hopper", "outlet: must be below"),
    scene(HOPPER.replace("hopper", "hoper"), "scene.hoper", "did you mean 'hopper'?"),
    scene(DRUM.replace('"1 1/s"', '"300 1/min"'), "scene.drum", "rotation_rate: must be below"),
    scene(DRUM + TUBE, "scene", "must be one of [scene.lifted-cylinder], [scene.hopper]"),
    scene(DRUM + 'inclination = "95 deg"\n', "scene.drum.inclination", "less than 90"),
    scene(DRUM + "filling = 0.9\n", "scene.drum.filling", "less than or equal to 0.8"),
    scene(DRUM + 'picture = "top"\n', "scene.drum.picture", "'depth', 'silhouette' or 'end'"),
    scene(DRUM + 'camera_distance = "1 m"\n', "scene.drum", "must be left out with the picture depth"),
    scene(DRUM + 'inclination = "80 deg"\n', "scene.drum", "the bed at the lower end must be below"),
    # Observables that a test does not have as it is set
    *(
        scene(test, "response[1].observable", f"the scene measures, it needs {need}", SEEN.format(name))
        for test, name, need in (
            (DIE, "tapped_density", "taps"),
            (DIE, "hausner_ratio", "taps"),
            (DROP, "tangential_ratio", "an inclined plate"),
            (DROP, "tangential_ratio_sd", "an inclined plate"),
            (SHEAR + 'base = "smooth"\n', "cohesion", "a rough base"),
            (SHEAR, "wall_friction_angle", "a smooth base"),
            (POURED, "flow_rate", "no mass_rate"),
        )
    ),
    scene(
        DIE,
        "candidate[1]",
        "the scene measures, it needs taps",
        '[[candidate]]\ntest = "target"\nobservables = ["tapped_density"]\n',
    ),
    changed(COUNT, 'tilt = "90 deg"\n', "scene.lifted-cylinder.tilt", "must be less than 90"),
    changed(
        COUNT,
        'vibration_frequency = "60 1/min"\n',
        "scene.lifted-cylinder.vibration_frequency",
        "unit of frequency (Hz)",
    ),
    changed(COUNT, 'air_drag = "-1 1/s"\n', "scene.lifted-cylinder.air_drag", "greater than or equal to 0"),
    # Walls of several materials
    scene(DRUM, "walls.lid", "must be one of shell, ends", "[walls.lid]\nstatic_friction = 0.1\n"),
    scene(TUBE, "walls.ends", "must be one of plate, tube", "[walls.ends]\nstatic_friction = 0.1\n"),
    scene(DRUM, "walls.ends.friction", "unknown key", "[walls.ends]\nfriction = 0.1\n"),
    scene(DRUM, "walls.ends.static_friction", "or equal", "[walls.ends]\nstatic_friction = -1\n"),
    scene(
        TUBE + "plate_friction = 0.3\n",
        "walls.plate",
        "must be left out if the plate has its own material",
        "[walls.plate]\nstatic_friction = 0.1\n",
    ),
    # Conditions
    *(
        added(f"[condition.base]\n[condition.odd]\n{text}", f"condition.odd.{key}", rule)
        for text, key, rule in (
            ('scene.lifted-cylinder.lift_sped = "1 m/s"', "scene.lifted-cylinder.lift_sped", "'lift_speed'"),
            (
                'scene.lifted-cylinder.lift_speed = "1 mm"',
                "scene.lifted-cylinder.lift_speed",
                "unit of speed",
            ),
            ("held_outt = true", "held_outt", "did you mean 'held_out'"),
            ("numerics = 3.0", "numerics", "unknown key"),
        )
    ),
    # Responses
    response('"flow_rate"', '"flow"', "response[2].observable", "the scene measures"),
    response('scene = "bin"', 'scene = "bim"', "response[2].scene", "did you mean 'bin'?"),
    response('mean = "12 g/s"', 'mean = "12 g"', "response[2].mean", "unit of mass flow"),
    response('mean = "12 g/s"\n', "", "response[2]", "missing: mean"),
    response("sd = 0.01", "sd = 0.0", "response[1].sd", "must be positive"),
    response('name = "outflow"', 'name = "solid_fraction"', "response[2]", "name that no other response has"),
    response('name = "outflow"', 'name = "E"', "factor[1].name", "is a column"),
    response('"solid_fraction"', '"angle"\nname = "a"', "response[1].observable", "matches this observable"),
    response('outlet = "20 mm"', 'outlet = "50 mm"', "response-scene.bin.hopper", "below the diameter"),
    added(
        HOPPER.replace("scene.", "response-scene.target."), "response-scene.target", "the study's own scene"
    ),
    # Laws and mechanisms
    added('[solver]\nlaws = "ligghts"', "solver.laws", "must be a set of laws, did you mean 'liggghts'?"),
    added(
        "[solver]\nlaws = 3", "solver.laws", 'must name a set of laws, e.g. laws = "liggghts", or be a table'
    ),
    added('[solver.laws]\nrolling = "spd2"', "solver.laws.rolling", "must be 'own_spin', "),
    added(
        "[solver.laws]\nrolling_damping = -1.0", "solver.laws.rolling_damping", "greater than or equal to 0"
    ),
    added('[solver.laws]\nnormal_damping = "viscoelastic"', "solver.laws", "damping_rate: must be given"),
    added(
        '[solver]\nlaws = "relative"\n[mechanism.elastic_plastic_rolling]\nrolling_stiffness = 2.25',
        "solver.laws",
        "must be 'own_spin' with the mechanism elastic_plastic_rolling, got 'elastic_plastic'",
    ),
    added(
        FACTOR.format("c", "solver.laws.rolling_stiffness"),
        "factor[2].parameter",
        "must lead to a quantity of the study",
    ),
    (
        (("restitution = 0.2\n", ""),),
        IGNORED + FACTOR.format("C", "contact.grain-grain.restitution"),
        "factor C",
        "the damping 'mass_velocity' ignores",
    ),
    added("[mechanism.jkrr]\nx = 1", "mechanism.jkrr", "unknown key, did you mean 'jkr'"),
    added(
        "[mechanism.jkr]\nwork_of_adhesion = -1.0", "mechanism.jkr.work_of_adhesion", "must be greater than"
    ),
    added(
        '[mechanism.jkr]\nbetween = "grain"', "mechanism.jkr.between", "must be 'all', 'grains' or 'walls'"
    ),
    added(
        "[mechanism.kinetic_friction]\nfriction_drop = 1.5",
        "mechanism.kinetic_friction.friction_drop",
        "less than 1",
    ),
    added(
        '[mechanism.jkr]\nwork_of_adhesion = "0.1 J"',
        "mechanism.jkr.work_of_adhesion",
        "needs a unit of surface energy (J/m^2",
    ),
    added(
        "[mechanism.jkr]\nwork_of_adhesion = 0.1\n[mechanism.hysteretic_spring]\nplasticity = 0.3",
        "",
        "mechanism.jkr and mechanism.hysteretic_spring must not act in one contact",
    ),
]


@pytest.mark.parametrize(("changes", "add", "key", "rule"), REFUSED)
def test_a_study_that_cannot_be_is_refused_with_rule_and_line(
    write_study: Callable[..., Path], tmp_path: Path, changes: tuple, add: str, key: str, rule: str
) -> None:
    (tmp_path / "split.txt").write_text("0 0 0 1\n1 0 0 1\n", encoding="utf-8")
    path = write_study(*changes, add=add)
    with pytest.raises(StudyError) as caught:
        load_study(path)
    problem = caught.value.problems[0]
    assert rule in problem.problem
    place = re.fullmatch(rf"{re.escape(str(path))}(?::(\d+))?(?:: (.+))?", problem.place)
    assert (place[2] or "") == key
    if place[1]:  # the line of the key itself, or of the table that should have it
        name = path.read_text(encoding="utf-8").splitlines()[int(place[1]) - 1].partition(" =")[0].strip("[]")
        assert name in key
    else:  # rules on several tables
        assert key in WITHOUT_LINE
