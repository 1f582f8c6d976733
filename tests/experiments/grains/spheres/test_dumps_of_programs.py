"""LIGGGHTS, LAMMPS and Yade write the forms of dumps of their manuals; the spheres come back in metres."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

from experiments.grains.spheres import read_spheres
from experiments.io.errors import InputError
from experiments.io.units import UNITS

SPHERES = np.array(
    [[0.001, 0.002, 0.003, 0.001], [-0.004, 0.01, 0.02, 0.0015], [0.015, -0.02, 0.001, 0.00225]]
)
"""Places and radii [m], by size."""

LENGTHS = {"si": 1.0, "cgs": UNITS["length"]["cm"], "micro": 1e-6, "nano": 1e-9}
"""Unit of length of LAMMPS's systems of units [m], https://docs.lammps.org/units.html."""

INPUT = """units {units}
atom_style {style}
boundary {boundary}
{settings}
region box {region}
create_box 2 box
{atoms}
{physics}
timestep 1e-12
fix move all nve/sphere
{dump}
run 2
"""
PHYSICS = {
    "lmp": "pair_style gran/hooke 1 NULL 1 NULL 0.5 0\npair_coeff * *\ncomm_modify vel yes\n"
    "compute rad all property/atom radius\nvariable radius atom c_rad\nvariable d atom 2*c_rad",
    "liggghts": "fix m1 all property/global youngsModulus peratomtype 5e8 5e8\n"
    "fix m2 all property/global poissonsRatio peratomtype 0.45 0.45\n"
    "fix m3 all property/global coefficientRestitution peratomtypepair 2 0.9 0.9 0.9 0.9\n"
    "fix m4 all property/global coefficientFriction peratomtypepair 2 0.1 0.1 0.1 0.1\n"
    "pair_style gran model hertz tangential history\npair_coeff * *\nneighbor 0.002 bin\n"
    "communicate single vel yes",
}
FIXED, TILTED = "block {} {} {} {} {} {}", "prism {} {} {} {} {} {} 0 0 0"
COLUMNS = (
    "id type x y z radius", "id type diameter zs xs ys", "radius xu yu zu", "vx id xsu ysu zsu radius type",
)  # fmt: skip
OF_LAMMPS = ("id x y z c_rad", "id x y z v_radius", "id v_d z y x")

LAMMPS = [
    *((f"custom 1 FILE {columns}", "si", "f f f", FIXED) for columns in (*COLUMNS, *OF_LAMMPS)),
    *((f"custom 1 FILE {COLUMNS[0]}\ndump_modify d units yes time yes sort id", units, "f f f", FIXED)
      for units in LENGTHS),
    *((f"custom 1 FILE {columns}", "si", boundary, FIXED)
      for columns in COLUMNS for boundary in ("p p p", "s s s", "m p f")),
    (f"custom 1 FILE {COLUMNS[0]}", "si", "p p p", TILTED),
    (f"custom/gz 1 FILE.gz {COLUMNS[0]}\ndump_modify d units yes", "si", "f f f", FIXED),
    (f"custom 1 FILE {COLUMNS[2]}\ndump_modify d sort -1 format float %.12g", "si", "f f f", FIXED),
    (f"custom 1 FILE.* {COLUMNS[0]}\ndump_modify d first yes", "si", "f f f", FIXED),
]  # fmt: skip
LIGGGHTS = [
    *((f"custom 1 FILE {columns}", units, boundary, FIXED)
      for columns in COLUMNS for units in ("si", "cgs") for boundary in ("f f f", "m m m")),
    *((f"custom/vtk 1 FILE_*.{ending} {COLUMNS[0]}", "si", "f f f", FIXED)
      for ending in ("vtk", "vtp", "vtu")),
    ("atom/vtk 1 FILE_*.vtk", "si", "f f f", FIXED),
]  # fmt: skip
WITHOUT_RADII = {
    "atom 1 FILE": "radius",
    "xyz 1 FILE.xyz": "without radii",
    f"custom 1 FILE.bin {COLUMNS[0]}": "a binary dump",
    f"custom/zstd 1 FILE.zst {COLUMNS[0]}": "a compressed file",
}
"""Dumps that cannot be read, and a word of the message."""


def written(program: str, form: tuple[str, str, str, str], folder: Path) -> list[Path]:
    """Let a program of the LAMMPS family write a dump of the spheres; return its files by name."""
    dump, units, boundary, region = form
    size, is_lammps = LENGTHS[units], program == "lmp"
    in_box = "" if is_lammps else " units box"
    atoms = [
        line
        for number, (x, y, z, radius) in enumerate(SPHERES / size, 1)
        for line in (
            f"create_atoms {1 + number % 2} single {x:.9g} {y:.9g} {z:.9g}{in_box}",
            f"set atom {number} diameter {2 * radius:.9g}",
        )
    ]
    box = np.array([-0.01, 0.02, -0.03, 0.02, -0.01, 0.04]) / size
    text = INPUT.format(
        units=units, style="sphere" if is_lammps else "granular", boundary=boundary,
        settings="" if is_lammps else "newton off",
        region=region.format(*(f"{each:.9g}" for each in box)) + in_box,
        atoms="\n".join(atoms), physics=PHYSICS[program],
        dump=f"dump d all {dump.replace('FILE', 'out')}",
    )  # fmt: skip
    (folder / "in").write_text(text, encoding="utf-8")
    done = subprocess.run([program, "-in", "in", "-log", "none"], cwd=folder, capture_output=True, timeout=60)
    assert done.returncode == 0, done.stdout[-2000:].decode(errors="replace")
    return sorted(path for path in folder.glob("out*") if "boundingBox" not in path.name)


def in_metres(path: Path, unit: float) -> np.ndarray:
    """Read spheres by size; a file that names no unit is in that of its system."""
    found = read_spheres(path)
    return found.spheres[np.argsort(found.spheres[:, 3])] * (found.unit or unit)


@pytest.mark.parametrize(
    ("program", "form"),
    [
        pytest.param(program, form, marks=pytest.mark.program(program), id=f"{program} {' '.join(form)}")
        for program, forms in (("lmp", LAMMPS), ("liggghts", LIGGGHTS))
        for form in forms
    ],
)
def test_spheres_of_lammps_and_liggghts_come_back(
    program: str, form: tuple[str, str, str, str], tmp_path: Path
) -> None:
    files = written(program, form, tmp_path)
    for path in files:
        # a dump has six digits
        np.testing.assert_allclose(in_metres(path, LENGTHS[form[1]]), SPHERES, rtol=2e-5, atol=1e-8)
    if "units yes" in form[0]:
        assert read_spheres(files[0]).unit == LENGTHS[form[1]]


@pytest.mark.program("lmp")
def test_the_last_frame_of_a_dump_that_was_cut_off_is_left_out(tmp_path: Path) -> None:
    [path] = written(
        "lmp", (f"custom 1 FILE {COLUMNS[0]}\ndump_modify d units yes", "cgs", "f f f", FIXED), tmp_path
    )
    path.write_bytes(path.read_bytes()[:-30])
    found = read_spheres(path)
    assert found.unit == 0.01
    assert "frame 2 of 3 (timestep 1), the last complete one" in found.description
    np.testing.assert_allclose(in_metres(path, 1.0), SPHERES, rtol=2e-5, atol=1e-8)


@pytest.mark.parametrize(
    ("program", "dump"),
    [
        pytest.param(program, dump, marks=pytest.mark.program(program))
        for program in PHYSICS
        for dump in WITHOUT_RADII
        if program == "lmp" or not dump.startswith(("atom", "custom/zstd"))  # LIGGGHTS has no such styles
    ],
)
def test_a_dump_that_cannot_be_read_is_named(program: str, dump: str, tmp_path: Path) -> None:
    path = written(program, (dump, "si", "f f f", FIXED), tmp_path)[0]
    with pytest.raises(InputError, match=WITHOUT_RADII[dump]):
        read_spheres(path)


FRAME = """---
creator: LAMMPS
timestep: {step}
units: cgs
natoms: 3
boundary: [ f, f, f, ]
thermo:
  - keywords: [ Step, Atoms, ]
    data: [ 0, 3, ]
box:
  - [ -1, 2 ]
  - [ -3, 2 ]
  - [ -1, 4 ]
keywords: [ id, type, {columns}, radius, ]
data:
{rows}
...
"""
"""Frame of https://docs.lammps.org/dump.html; the LAMMPS of Debian 12 has no ``dump yaml``."""


@pytest.mark.parametrize("columns", ["x, y, z", "xs, ys, zs"])
def test_a_yaml_dump_of_lammps_comes_back_from_its_last_complete_frame(columns: str, tmp_path: Path) -> None:
    low, high = np.array([-1.0, -3.0, -1.0]), np.array([2.0, 2.0, 4.0])
    table = 100.0 * SPHERES
    if columns.startswith("xs"):
        table[:, :3] = (table[:, :3] - low) / (high - low)
    rows = "\n".join(
        f"  - [ {n} , 1 , {' , '.join(f'{v:.9g}' for v in row)} , ]" for n, row in enumerate(table)
    )
    frames = [FRAME.format(step=step, columns=columns, rows=rows) for step in (0, 1)]
    (tmp_path / "dump.yaml").write_text("".join(frames)[:-60], encoding="utf-8")
    found = read_spheres(tmp_path / "dump.yaml")
    assert "frame 1 of 2 (timestep 0), the last complete one" in found.description
    assert (found.unit, found.type_counts) == (0.01, {"1": 3})
    np.testing.assert_allclose(in_metres(tmp_path / "dump.yaml", 1.0), SPHERES, rtol=1e-8, atol=1e-12)


YADE = """
from yade import export
for *place, radius in {spheres}:
    O.bodies.append(sphere(place, radius))
export.text("text.out")
for form, more in (("x_y_z_r", {{}}), ("x_y_z_r_matId", {{}}), ("id_x_y_z_r_matId", {{}}),
                   ("x_y_z_r_attrs", {{"attrs": ["b.mat.density"]}})):
    export.textExt(form + ".out", format=form, **more)
export.VTKExporter("exported").exportSpheres()
for name, more in (("plain", {{}}), ("ascii", {{"ascii": True}}), ("packed", {{"compress": True}})):
    VTKRecorder(fileName=name + "-", recorders=["spheres", "velocity"], iterPeriod=1, **more)()
O.bodies.clear()
O.bodies.appendClumped([sphere(place, radius) for *place, radius in {spheres}])
export.textClumps("clumps.out")
"""


@pytest.mark.program("yade")
def test_spheres_of_yade_come_back(tmp_path: Path) -> None:
    (tmp_path / "write.py").write_text(YADE.format(spheres=SPHERES.tolist()), encoding="utf-8")
    subprocess.run(
        ["yade", "-n", "-x", "write.py"], cwd=tmp_path, capture_output=True, timeout=120, check=True
    )
    files = [path for pattern in ("*.out", "*.vtk", "*.vtu") for path in sorted(tmp_path.glob(pattern))]
    assert len(files) == 10
    for path in files:
        np.testing.assert_allclose(in_metres(path, 1.0), SPHERES, rtol=2e-5, atol=1e-8, err_msg=path.name)
