"""Inputs of other codes: the same test in their words, refused by name where they lack something, and run."""

import csv
import io
import json
import math
import re
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from commandline import dem_warp, refused
from exported_lift import COUNT, GRAIN, ROD
from exported_lift import exported_lift as exported

from dem_warp import PRESETS, ClumpShape, ContactLaws, Ledge, Material, ShapeMixture
from dem_warp.laws.conventions import Rolling
from dem_warp.laws.twisting import Twisting
from dem_warp.population import SIZE_VARIANCE
from experiments.export import EXPORTERS, ExportedTest, case_terms, export_input, term_warnings, write_export
from experiments.export.lammps_exporter import grains_at_once
from experiments.export.lift import Lift, disc, prism
from experiments.export.sizes import size_classes
from experiments.io.errors import InputError
from experiments.studyfile import load_study

SPHERE = ClumpShape.sphere(1e-3)
LEDGE = Ledge(width=0.1, depth=0.1, fill_depth=0.1, wall_material=Material(7800.0, 70e9, 0.3))
PROGRAMS = {"liggghts": "liggghts", "lammps": "lmp"}
"""Codes with an input in their own language, and their programs."""

with_programs = pytest.mark.parametrize(
    "code", [pytest.param(code, marks=pytest.mark.program(name)) for code, name in PROGRAMS.items()]
)


def test_classes_of_size_have_the_populations_moments() -> None:
    sizes, parts = np.array(size_classes(1.1, 0.2)).T
    assert parts.sum() == pytest.approx(1.0, rel=1e-12)
    assert parts @ sizes == pytest.approx(1.1, rel=1e-12)
    variance = SIZE_VARIANCE * 0.2**2
    assert parts @ (sizes - 1.1) ** 2 == pytest.approx(variance, rel=1e-10)
    # the mean mass goes as the third moment, m^3 + 3 m v of a symmetric distribution
    assert parts @ sizes**3 == pytest.approx(1.1**3 + 3 * 1.1 * variance, rel=1e-10)
    assert sizes.min() > 1.1 - 3 * 0.2
    assert size_classes(0.9, 0.0) == ((0.9, 1.0),)


def test_a_slower_rain_is_said_with_the_rate_that_makes_the_tests_equal() -> None:
    test = exported("liggghts")
    rate = Lift(test).rain_rate
    assert rate < 0.9 * test.case.scene.rain_rate
    for given, said in ((test.case.scene.rain_rate, True), (0.9 * rate, False)):
        same = replace(test, case=replace(test.case, scene=replace(test.case.scene, rain_rate=given)))
        [row] = [row for row in export_input(same, "liggghts").translated if row.subject == "filling"]
        assert (f"rain_rate = {rate:.4g} in the study's scene" in row.there) is said


def test_seeds_are_distinct_primes_above_ten_thousand() -> None:
    lift = Lift(exported("liggghts"))
    seeds = lift.seeds(40)
    assert len(set(seeds)) == 40
    for seed in seeds:
        assert seed > 10_000
        assert all(seed % divisor for divisor in range(2, math.isqrt(seed) + 1))
    assert seeds == lift.seeds(40)


def test_a_mixture_has_a_template_for_every_shape_and_size() -> None:
    mixture = ShapeMixture((SPHERE, ROD), (0.25, 0.75))
    templates = Lift(exported("liggghts", mixture)).templates
    assert sum(template.fraction for template in templates) == pytest.approx(1.0)
    assert sum(t.fraction for t in templates if t.shape == ROD) == pytest.approx(0.75)


def test_meshes_close_around_the_tube_and_have_the_plates_area() -> None:
    corners = prism(0.01, 0.03)
    assert np.linalg.norm(corners[..., :2], axis=-1).min() > 0.01
    middles = corners[..., :2].mean(axis=1)
    assert np.linalg.norm(corners[:, :2, :2].mean(axis=1), axis=-1).min() == pytest.approx(0.01, rel=1e-12)
    assert np.linalg.norm(middles, axis=-1).max() < 0.0101
    round_plate = disc(0.02)
    sides = round_plate[:, 1:] - round_plate[:, :1]
    area = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum()
    assert area == pytest.approx(math.pi * 0.02**2, rel=1e-12)


def test_liggghts_gets_laws_masses_and_seeds() -> None:
    test = exported("liggghts", plate_friction=0.9)
    lift, text = Lift(test), export_input(test, "liggghts").files["lift.in"]
    assert text.count("model hertz tangential history rolling_friction epsd2") == 3
    masses = [float(word) for word in re.findall(r" mass (\S+)", text)]
    assert masses == pytest.approx([GRAIN.density * ROD.volume * t.size**3 for t in lift.templates])
    numbers = [line.split()[1:] for line in re.findall(r"inertia_tensor .*", text)]
    tensors = np.array([row[:6] for row in numbers], dtype=float)
    assert tensors[:, [0, 3, 5]] == pytest.approx(np.array([t.inertia for t in lift.templates]))
    friction = text.split("coefficientFriction peratomtypepair 3 ")[1].splitlines()[0].split()
    assert [float(word) for word in friction[:3]] == [0.5, 0.4, 0.9]
    assert f"timestep {test.case.time_step:.9g}" in text
    seeds = re.findall(r"(?:multisphere|numberbased|seed) (\d+)", text)
    assert len(set(seeds)) == len(seeds) == 7


def test_liggghts_takes_the_laws_that_it_has_options_for() -> None:
    laws = replace(PRESETS["liggghts-cdt"], attraction="clamped", tangential_damping="none")
    test = exported("liggghts")
    translation = export_input(replace(test, case=replace(test.case, laws=laws)), "liggghts")
    wanted = "model hertz tangential history rolling_friction cdt tangential_damping off limitForce on"
    assert wanted in translation.files["lift.in"]
    assert translation.warnings == ()


def test_lammps_gets_molecules_with_the_mass_of_the_union() -> None:
    test = exported("lammps")
    files = export_input(test, "lammps").files
    for number, template in enumerate(Lift(test).templates, 1):
        text = files[f"grain{number}.mol"]
        mass, inertia = re.search(r"(\S+) mass", text)[1], re.search(r"(.*) 0 0 0 inertia", text)[1]
        assert float(mass) == pytest.approx(template.mass, rel=1e-8)
        assert [float(word) for word in inertia.split()] == pytest.approx(template.inertia, rel=1e-8)
    assert "rolling sds" in files["lift.in"]


@pytest.mark.parametrize("code", list(EXPORTERS))
def test_an_input_that_nobody_has_run_says_so_at_the_top(code: str, tmp_path: Path) -> None:
    test = exported("deme", SPHERE)
    translation = export_input(test, code, approximate=True)
    write_export(test, code, translation, tmp_path)
    run = code in ("liggghts", "lammps", "yade")
    wanted = f"has not been run in {EXPORTERS[code].code}"
    for file in (translation.main, "README.md"):
        top = (tmp_path / file).read_text(encoding="utf-8").splitlines()[:6]
        assert any(wanted in line for line in top) is not run


def test_sheets_have_the_spheres_and_the_time_step() -> None:
    for code, laws in (("edem", "edem"), ("rocky", "rocky")):
        test = exported(laws)
        translation = export_input(test, code, approximate=True)
        rows = list(csv.DictReader(io.StringIO(translation.files["spheres.csv"])))
        assert [float(row["radius"]) for row in rows] == pytest.approx([1.0] * 3)
        values = {
            row["name"]: row["value"] for row in csv.DictReader(io.StringIO(translation.files["values.csv"]))
        }
        assert float(values["Fixed Time Step" if code == "edem" else "Fixed Timestep"]) == pytest.approx(
            test.case.time_step, rel=1e-5
        )
        assert translation.command == ()


def test_a_sheet_tells_the_whole_test() -> None:
    mixture = ShapeMixture((SPHERE, ROD), (0.25, 0.75))
    test = exported("edem", mixture, plate_diameter=0.05, tilt=math.radians(5.0))
    text = export_input(test, "edem").files["values.md"]
    for part in ("a disc of 50 mm", "0.25 of shape 1, 0.75 of shape 2", "gravity to (0.855, 0, -9.773) m/s2"):
        assert part in text
    assert "-0.000000" not in text


def test_lammps_says_that_its_gravity_is_upright() -> None:
    translation = export_input(exported("lammps", tilt=math.radians(5.0)), "lammps", approximate=True)
    [gravity] = [row for row in translation.translated if row.subject == "gravity"]
    assert gravity.here != gravity.there == "(0, 0, -9.81) m/s2"
    assert "vector 0 0 -1" in translation.files["lift.in"]


@pytest.mark.parametrize(
    ("laws", "word"),
    [("edem", "Standard Rolling Friction"), ("edem-rvd", "RVD Rolling Friction"), ("relative", "Type C")],
)
def test_a_sheet_for_edem_names_its_rolling_friction_with_its_ratio(laws: str, word: str) -> None:
    text = export_input(exported(laws), "edem").files["values.csv"]
    assert f",Rolling Friction,{word}," in text
    ratio = f",Rolling Viscous Damping Ratio,{PRESETS[laws].rolling_damping:g}," in text
    assert ratio is (word == "Type C")


def taken(code: str, rolling: Rolling) -> str:
    return EXPORTERS[code].conventions.taken(ContactLaws(rolling=rolling))["rolling"]


@pytest.mark.parametrize("rolling", get_args(Rolling))
def test_the_replacement_of_a_rolling_law_turns_the_same_way(rolling: Rolling) -> None:
    # a torque on each spin misses a drum by ten degrees that one on the relative roll meets
    for code in ("edem", "rocky"):
        assert rolling.startswith("own_spin") == taken(code, rolling).startswith("own_spin")
    if rolling in ("rocky_3", "sds", "yade"):  # a spring replaces a spring
        assert taken("liggghts", rolling) == "epsd2"


def test_a_rolling_spring_that_edem_has_no_entry_for_is_told() -> None:
    test = exported("relative")
    laws = replace(test.case.laws, rolling_stiffness=1.0)
    with pytest.raises(InputError, match=r"rolling_stiffness = 1: EDEM's Type C has 2\.25"):
        export_input(replace(test, case=replace(test.case, laws=laws)), "edem")


@pytest.mark.parametrize("name", list(EXPORTERS))
def test_terms_of_a_case_are_there_for_every_code_and_set_of_laws(name: str) -> None:
    for laws in PRESETS.values():
        case = replace(exported("edem").case, laws=laws)
        subjects = [subject for subject, _ in case_terms(name, case)]
        assert {"grain with grain", "grain with wall"} <= set(subjects)
    if name in PRESETS:
        assert term_warnings(name, replace(exported("edem").case, laws=PRESETS[name])) == ()
    # the report warns of the laws that the input warns of
    test = exported("edem" if name in ("lammps", "yade", "deme", "liggghts") else "lammps")
    warned = [text for text in term_warnings(name, test.case) if text.startswith("law ")]
    assert set(warned) <= set(export_input(test, name, approximate=True).warnings)
    assert warned


def test_a_law_that_the_code_lacks_is_refused_or_told_at_the_top(tmp_path: Path) -> None:
    test = exported("edem")
    with pytest.raises(InputError, match=r"law rolling = 'own_spin': LIGGGHTS lacks it; using 'cdt'"):
        export_input(test, "liggghts")
    with pytest.raises(InputError, match=r"rolling = 'epsd2'"):
        export_input(exported("liggghts"), "yade")
    translation = export_input(test, "liggghts", approximate=True)
    write_export(test, "liggghts", translation, tmp_path)
    head = (tmp_path / "lift.in").read_text().splitlines()[1:4]
    assert all(line.startswith("# WARNING: law ") for line in head)
    assert "Not the same there" in (tmp_path / "README.md").read_text()


@pytest.mark.parametrize("code", PROGRAMS)
def test_a_mechanism_and_an_option_of_the_scene_without_counterpart_are_refused_by_name(code: str) -> None:
    test = exported(code, air_drag=2.0)
    test = replace(test, case=replace(test.case, mechanisms=(Twisting(twisting_radius=1.0),)))
    with pytest.raises(
        InputError, match=r"(?s)mechanism 'twisting' has no counterpart.*air_drag = 2 /s"
    ) as error:
        export_input(test, code)
    assert len(error.value.problems) == 2


def test_another_test_and_another_code_are_refused() -> None:
    drum = load_study(Path("experiments/studies/trial/study.toml"), "bench").case({}, 1)
    strange = ExportedTest("strange", replace(drum, scene=LEDGE), "here")
    for code in ("liggghts", "yade", "deme", "mercurydpm"):
        with pytest.raises(InputError, match=r"must be a lifted-cylinder.*got ledge"):
            export_input(strange, code)
        with pytest.raises(
            InputError, match=r"plate must have no lip: no code is given one, got lip = 0.001 m"
        ):
            export_input(exported("edem", plate_diameter=1.0, lip=1e-3), code)
    with pytest.raises(InputError, match=r"must be one of .*liggghts.*got fluent"):
        export_input(exported("edem"), "fluent")


def test_the_command_writes_the_folder_and_refuses_with_exit_code_2(tmp_path: Path) -> None:
    assert refused("export", "--scale", "bench", "--to", "lammps", "--out", tmp_path / "no")
    assert not (tmp_path / "no").exists()
    words = ("export", "--scale", "bench", "--set", "E=0.4", "--to", "edem", "--json")
    code, out, _ = dem_warp(*words, "--out", tmp_path / "sheet")
    assert (code, json.loads(out)["warnings"]) == (0, [])
    assert "| E | 0.4 |" in (tmp_path / "sheet" / "README.md").read_text()
    assert refused(*words, "--out", tmp_path / "sheet")


@with_programs
@pytest.mark.parametrize(("shape", "count"), [(SPHERE, None), (ROD, COUNT)], ids=["rim", "counted"])
def test_an_input_runs_and_leaves_the_heap(
    code: str, shape: ClumpShape, count: int | None, tmp_path: Path
) -> None:
    test = exported(code, shape, grain_count=count)
    spheres = _heap_of(test, code, tmp_path)
    grains = len(spheres) / shape.sphere_count
    assert grains == count if count else COUNT < grains < Lift(test).count
    # sizes are those of the templates, and at rest on the plate no sphere sinks in by more than its weight's
    # overlap many times over
    sizes = {round(float(size), 6) for size in spheres[:, 5]}
    assert sizes <= {round(float(t.radii[0]), 6) for t in Lift(test).templates}
    assert (spheres[:, 4] > 0.8 * spheres[:, 5]).all()
    # the tube has let go of them
    assert np.hypot(spheres[:, 2], spheres[:, 3]).max() > test.case.scene.diameter / 2


@with_programs
def test_every_grain_is_poured_however_few_fall_at_once(code: str, tmp_path: Path) -> None:
    # so narrow that LAMMPS, which puts in whole grains, pours at three quarters of the rate
    test = exported(code, SPHERE, grain_count=50, diameter=0.008, height=0.04)
    assert len(_heap_of(test, code, tmp_path)) == 50


@with_programs
def test_grains_that_fall_off_a_plate_are_gone_whole(code: str, tmp_path: Path) -> None:
    test = exported(code, ROD, plate_diameter=0.02)
    spheres = _heap_of(test, code, tmp_path)
    assert 0 < len(spheres) < COUNT * ROD.sphere_count
    assert len(spheres) % ROD.sphere_count == 0
    # who stays has its centre above the disc, of which it is no further than its reach
    assert np.hypot(spheres[:, 2], spheres[:, 3]).max() < 0.01 + Lift(test).reach


@pytest.mark.program("lmp")
def test_lammps_pours_at_its_rate_up_to_the_rim(tmp_path: Path) -> None:
    # each look at the grains is a run of its own, and LAMMPS would pour at the start of every one
    test = exported("lammps", ROD, grain_count=None)
    _heap_of(test, "lammps", tmp_path)
    lift, text = Lift(test), (tmp_path / "log.lammps").read_text(encoding="utf-8")
    rows = [line.split() for line in text.splitlines() if re.fullmatch(r" *\d+ +\d+( +[-+.\de]+){5} *", line)]
    atoms = {int(row[0]): int(row[1]) for row in rows}
    step = lift.steps(0.25)
    fallen = max(count for at, count in atoms.items() if at <= step) / ROD.sphere_count
    # one more insertion than the time has room for, as the first is at its beginning
    assert 0 < fallen <= lift.rain_rate * 0.25 + grains_at_once(lift)


def _heap_of(test: ExportedTest, code: str, folder: Path) -> np.ndarray:
    """Run an exported test, and read its heap: id, type, x, y, z, radius."""
    translation = export_input(test, code)
    write_export(test, code, translation, folder)
    subprocess.run(translation.command, cwd=folder, check=True, capture_output=True)
    rows = (folder / translation.heap).read_text().split("ITEM: ATOMS id type x y z radius")[1].splitlines()
    return np.array([row.split() for row in rows if row.strip()], dtype=float)
