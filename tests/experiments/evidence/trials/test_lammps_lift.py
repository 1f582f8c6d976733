"""A second reality in LAMMPS: its input says what was hidden, and refuses what it cannot make."""

import math
import re
from dataclasses import replace

import pytest

from dem_warp import Case
from dem_warp.laws.capillary import CapillaryBridge
from dem_warp.laws.jkr import JKR
from dem_warp.materials import tsuji_damping
from experiments.evidence.trials.generate_trials import STUDY
from experiments.evidence.trials.other_codes.code_effects import OUTSIDE, SLIPPERY
from experiments.evidence.trials.other_codes.code_surfaces import Bench
from experiments.evidence.trials.other_codes.generate_other import plan_for
from experiments.evidence.trials.other_codes.lammps_trials import lammps_files, surface_energy
from experiments.evidence.trials.other_codes.setting import Setting
from experiments.evidence.trials.truths import Plan
from experiments.io.errors import InputError
from experiments.studyfile import load_study

THETA = {"mu_gg": 0.6, "mu_gw": 0.5, "e_gg": 0.3}
G = 9.81


def case_of() -> Case:
    """Return a test in the setting of LAMMPS's workshop."""
    return Setting(1.0, 1000.0, 48, 4e-3, "sds").of(load_study(STUDY, "bench").case(THETA, seed=3), "lammps")


def lammps_text(case: Case) -> str:
    return lammps_files(Bench(case))["lift.in"]


def test_lammps_is_told_what_is_hidden() -> None:
    case = case_of()
    text = lammps_text(case)
    assert "dmt" not in text
    work = 0.02
    adhesive = lammps_text(replace(case, mechanisms=(JKR(between="grains", work_of_adhesion=work),)))
    # among grains alone: the walls' laws have no adhesion
    assert [line.split()[3] for line in adhesive.splitlines() if line.startswith("pair_coeff")] == ["dmt"]
    assert adhesive.count("dmt") == 1
    assert "rotate v_turn" in text
    turning = lammps_text(OUTSIDE["turning_tube"].change(case, 5.0))
    [rate] = re.findall(r"variable turn equal \"\(step - v_begin\) \* (\S+)\"", turning)
    assert float(rate) == pytest.approx(5.0 * case.time_step)
    tilt = math.radians(5.0)
    tilted = lammps_text(replace(case, scene=replace(case.scene, tilt=tilt)))
    [weight] = re.findall(r"gravity (\S+) vector (\S+) (\S+) (\S+)", tilted)
    assert [float(number) for number in weight] == pytest.approx(
        [G, math.sin(tilt), 0.0, -math.cos(tilt)], rel=1e-8
    )
    scene = replace(case.scene, vibration_amplitude=1e-4)
    assert 'variable shake equal "v_shakes * 0.0001 * sin(' in lammps_text(replace(case, scene=scene))
    cone = OUTSIDE["conical_tube"].change(case, 3.0)
    [ends] = re.findall(r"region tube cone z 0 0 (\S+) (\S+) 0 (\S+) ", lammps_text(cone))
    low, high, height = (float(number) for number in ends)
    assert low + high == pytest.approx(case.scene.diameter, rel=1e-8)
    assert math.degrees(math.atan((low - high) / height)) == pytest.approx(3.0, rel=1e-6)


def test_lammps_has_a_contact_for_each_kind_of_grain() -> None:
    case = case_of()

    def contacts(effect: str, size: float) -> dict[str, list[float]]:
        text = lammps_text(OUTSIDE[effect].change(case, size))
        place = r"(?:pair_coeff|fix) (\S+ \S+) (?:wall/gran/region granular )?"
        found = re.findall(place + r"hertz/material (\S+) .* mindlin \S+ \S+ (\S+)", text)
        return {name: [float(modulus), float(friction)] for name, modulus, friction in found}

    slippery = contacts("slippery_class", 0.5)
    mu_gg, mu_gw, less = THETA["mu_gg"], THETA["mu_gw"], SLIPPERY
    assert slippery["1 1"][1] == pytest.approx(mu_gg)
    assert slippery["1 2"][1] == slippery["2 2"][1] == pytest.approx(less * mu_gg)
    assert slippery["tube_usual usual"][1] == slippery["plate_usual usual"][1] == pytest.approx(mu_gw)
    assert slippery["tube_odd odd"][1] == slippery["plate_odd odd"][1] == pytest.approx(less * mu_gw)
    soft = {name: modulus for name, (modulus, _) in contacts("soft_class", 20.0).items()}
    # springs in a row: the compliance of two unlike grains is the mean of those of like ones
    assert soft["2 2"] == pytest.approx(soft["1 1"] / 20.0)
    assert 1.0 / soft["1 2"] == pytest.approx(0.5 / soft["1 1"] + 0.5 / soft["2 2"])
    # walls are far stiffer: a grain on them has twice the modulus that it has on its like, but for 0.2 %
    assert soft["tube_odd odd"] == pytest.approx(2.0 * soft["2 2"], rel=2e-3)


def test_dmt_parts_spheres_as_hard_as_jkr() -> None:
    work, reduced = 0.02, 0.7e-3
    pull = 4.0 * math.pi * surface_energy(work) * reduced
    assert pull == pytest.approx(1.5 * math.pi * work * reduced)


def test_lammps_refuses_liquid_bridges_by_name() -> None:
    bridge = CapillaryBridge(between="grains", surface_tension=0.01, bridge_volume=5e-11)
    with pytest.raises(InputError, match=r"LAMMPS has no liquid bridges, got capillary"):
        lammps_text(replace(case_of(), mechanisms=(bridge,)))
    with pytest.raises(InputError, match=r"lammps makes only contact_adhesion, .*liquid_bridges"):
        plan_for("lammps", Plan(mechanisms=("liquid_bridges",)))


def test_the_damping_is_ours_and_the_sums_of_rains_are_the_grains() -> None:
    ours = load_study(STUDY, "bench").case(THETA, seed=3)
    text = lammps_text(case_of())
    [restitution] = re.findall(r"pair_coeff 1 1 hertz/material \S+ (\S+) 0 ", text)
    among = ours.contacts(ours.scene.wall_material)[0]
    # the number that LAMMPS's polynomial makes our damping of, to the root's own tolerance
    assert tsuji_damping(float(restitution)) == pytest.approx(among.damping, rel=1e-9)
    mixed = lammps_text(OUTSIDE["slippery_class"].change(case_of(), 0.3))
    for one, counts in ((text, [100]), (mixed, [70, 30])):
        assert [int(count) for count in re.findall(r"deposit (\d+) ", one)] == counts
        for shares in re.findall(r"molfrac ([\d. e+-]+) rigid", one):
            assert sum(float(share) for share in shares.split()) == pytest.approx(1.0, abs=1e-12)


def test_a_tube_that_trembles_is_lifted_and_a_heap_that_does_is_none() -> None:
    text = lammps_text(case_of())

    def loop(name: str) -> str:
        return text.split(f"label {name}\n")[1].split(f"label {name}_done")[0]

    assert "quit 1" not in loop("settle")
    assert "quit 1" in loop("rest")
