"""``dem-warp clump``: units, tolerances, advice, pictures."""

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from commandline import dem_warp

from dem_warp.clump_fitting import fit_clump
from dem_warp.solids import parse_solid
from experiments.grains.clumps.clump_search import Trial, fit_with, fit_within
from experiments.io.errors import InputError

DICE = 4.0
"""Edge of a die [mm]."""


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def die(unit: float) -> None:
    """Write a die whose edge is `DICE` mm in a unit [mm]."""
    trimesh.creation.box([DICE / unit] * 3).export("die.stl")


@pytest.mark.usefixtures("_coarse_clumps")
@pytest.mark.parametrize(("unit", "size"), [("mm", 1.0), ("m", 1e3), ("2.5 mm", 2.5)])
def test_a_mesh_is_read_in_the_unit_given(unit: str, size: float) -> None:
    die(size)
    code, out, _ = dem_warp("clump", "die.stl", "--spheres", 1, "--unit", unit, "--json")
    assert code == 0
    # The sphere that a die holds. Its centre is known to a tenth of a sample, 0.1 / 20 of the edge: 1 % of
    # the radius, 3 % of the volume.
    assert json.loads(out)["volume_mm3"] == pytest.approx(np.pi / 6.0 * DICE**3, rel=0.1)


def test_errors_are_those_of_a_sphere_in_a_die() -> None:
    """A unit cube and the ball within it: volume pi/6, moments over the mass 1/10 and 1/6."""
    fit = fit_clump(trimesh.creation.box([4e-3] * 3), 1)
    assert fit.volume_error == pytest.approx(np.pi / 6.0 - 1.0, abs=0.05)
    assert fit.inertia_error == pytest.approx(0.4, abs=0.05)
    # Mean square over a face of (sqrt(1/4 + x^2 + y^2) - 1/2)^2, of edge 1.
    x, y = np.meshgrid(*[(np.arange(400) + 0.5) / 400 - 0.5] * 2)
    face = np.sqrt(((np.sqrt(0.25 + x**2 + y**2) - 0.5) ** 2).mean())
    # Four thousand points, and the ball some hundredths of the edge off the middle.
    assert fit.surface_distance == pytest.approx(4e-3 * face, rel=0.15)


def test_a_ball_has_no_error() -> None:
    fit = fit_clump(parse_solid("sphere:4"), 1)
    # The mesh has flat faces, and its middle is found to a part of the samples' spacing.
    assert (abs(fit.volume_error), fit.inertia_error) == pytest.approx((0.0, 0.0), abs=0.06)
    assert fit.surface_distance < 0.03 * 4e-3


def test_the_protrusion_found_keeps_the_volume() -> None:
    solid = parse_solid("ellipsoid:6x3x3")
    fit, protrusion = fit_with(solid, 3, None)
    assert abs(fit.volume_error) <= 0.01
    assert fit.shape.volume == pytest.approx(fit_clump(solid, 3, protrusion).shape.volume, rel=1e-12)


@pytest.mark.usefixtures("_coarse_clumps")
def test_a_tolerance_takes_the_first_number_of_spheres_that_keeps_it() -> None:
    seen: list[Trial] = []
    fit, trials = fit_within(parse_solid("ellipsoid:6x3x3"), 0.2, None, seen.append)
    assert seen == trials
    assert [trial.worst <= 0.2 for trial in trials] == [False] * (len(trials) - 1) + [True]
    assert trials[-1].spheres == fit.shape.sphere_count > 1


@pytest.mark.usefixtures("_coarse_clumps")
def test_a_tolerance_that_no_clump_keeps_names_the_best(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("experiments.grains.clumps.clump_search.COUNTS", (1, 2))
    with pytest.raises(
        InputError, match=r"too small for 2 spheres: the best clump has 2 spheres, volume [+-]"
    ):
        fit_within(parse_solid("tri-pyramid:6x4"), 0.01, 0.0, lambda trial: None)


@pytest.mark.usefixtures("_coarse_clumps")
def test_trials_and_advice_are_printed() -> None:
    code, out, err = dem_warp("clump", "ellipsoid:6x3x3", "--tolerance", "25%", "--json")
    assert code == 0
    trials = json.loads(out)["trials"]
    assert [line.split()[0] for line in err.splitlines()] == [str(trial["spheres"]) for trial in trials]
    code, _, err = dem_warp("clump", "tri-pyramid:6x4", "--spheres", 2)
    assert code == 0
    assert "% less volume and mass than the solid: --protrusion auto" in err
    code, _, err = dem_warp("clump", "tri-pyramid:6x4", "--spheres", 2, "--protrusion", "auto")
    assert "Advice" not in err


@pytest.mark.usefixtures("_coarse_clumps")
def test_a_clump_is_drawn_with_its_solid_and_never_over_a_file() -> None:
    die(1.0)
    command = ("clump", "die.stl", "--spheres", 1)
    assert dem_warp(*command, "--picture", "die.png")[0] == 0
    picture = Path("die.png").read_bytes()
    assert picture.startswith(b"\x89PNG")
    for name, rule in (("die.png", "never overwrites"), ("die.docx", "must end in one of")):
        code, _, err = dem_warp(*command, "--picture", name)
        assert (code, rule in err) == (2, True)
    assert Path("die.png").read_bytes() == picture
    assert sorted(path.name for path in Path().iterdir()) == ["die.png", "die.stl"]
