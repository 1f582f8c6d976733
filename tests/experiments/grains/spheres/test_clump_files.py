"""Clumps in the formats of other codes: the same grain, whatever the file."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from commandline import dem_warp, refused

from dem_warp import ClumpShape
from experiments.grains.spheres import read_clump
from experiments.io.errors import InputError
from experiments.studyfile import load_study

DATA = Path(__file__).parent / "data"
PELLET = ClumpShape.from_spheres(
    np.array([[0.0, 0.0, -1.5], [0.0, 0.0, 0.0], [0.0, 0.0, 1.5]]) * 1e-3, [1.2e-3, 1.5e-3, 1.2e-3]
)

FILES = {
    "own": "# Clump: x y z r of each sphere in mm, at rest.\n0 0 -1.5 1.2\n0 0 0 1.5\n0 0 1.5 1.2\n",
    "commas": "0, 0, -1.5, 1.2\n0, 0, 0, 1.5\n0, 0, 1.5, 1.2\n",
    "yade text": "#format x_y_z_r\n0\t0\t-1.5\t1.2\n0\t0\t0\t1.5\n0\t0\t1.5\t1.2\n",
    "yade clump": "#format x_y_z_r_clumpId\n0\t0\t-1.5\t1.2\t7\n0\t0\t0\t1.5\t7\n0\t0\t1.5\t1.2\t7\n",
    "yade template": "from yade import *\npellet = clumpTemplate(relRadii=[1.2, 1.5, 1.2],\n"
    "    relPositions=[[0, 0, -1.5], [0, 0, 0], [0, 0, 1.5]])\n",
    "deme": "x,y,z,r\n0,0,-1.5,1.2\n0,0,0,1.5\n0,0,1.5,1.2\n# volume = 23.5\n",
    "edem table": "Name\tPhysical Radius (mm)\tContact Radius (mm)\tPosition X (mm)\tPosition Y (mm)\t"
    "Position Z (mm)\n"
    "sphere 0\t1.2\t2\t0\t0\t-1.5\nsphere 1\t1.5\t2\t0\t0\t0\nsphere 2\t1.2\t2\t0\t0\t1.5\n",
    "edem results": "EXTRACTED DATA FROM\nTIME: 1 s\n"
    "Sphere Position X [m],Sphere Position Y [m],Sphere Position Z [m],Sphere Radius [m]\n"
    "0,0,-0.0015,0.0012\n0,0,0,0.0015\n0,0,0.0015,0.0012\n",
    "german excel": "X (mm);Y (mm);Z (mm);Radius (mm)\r\n0;0;-1,5;1,2\r\n0;0;0;1,5\r\n0;0;1,5;1,2\r\n",
    "sheet of an export": "shape,x,y,z,radius,unit\n1,0,0,-1.5,1.2,mm\n1,0,0,0,1.5,mm\n1,0,0,1.5,1.2,mm\n",
    "diameters": "x y z diameter\n0 0 -1.5 2.4\n0 0 0 3\n0 0 1.5 2.4\n",
    "xml": "<?xml version='1.0'?><particle units='mm'>"
    "<sphere><position x='0' y='0' z='-1.5'/><radius>1.2</radius></sphere>"
    "<sphere x='0' y='0' z='0' radius='1.5'/><sphere x='0' y='0' z='1.5' radius='1.2'/></particle>",
}
"""One grain of three spheres, in mm, as each program writes it."""


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_every_format_gives_the_same_grain(tmp_path: Path, name: str, mark: bytes) -> None:
    path = tmp_path / "grain"
    path.write_bytes(mark + FILES[name].encode())
    shape = read_clump(path).shape
    np.testing.assert_allclose(shape.centers, PELLET.centers, rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(shape.radii, PELLET.radii, rtol=1e-12)
    code, out, err = dem_warp("clump", path, "--json")
    assert (code, json.loads(out)["sphere_count"]) == (0, 3)
    assert "Read: " in err


def test_own_files_are_read_to_the_last_bit(tmp_path: Path) -> None:
    PELLET.write(tmp_path / "grain.txt")
    ours, plain = read_clump(tmp_path / "grain.txt").shape, ClumpShape.read(tmp_path / "grain.txt")
    assert ours == plain
    assert (ours.volume, ours.inertia_over_mass.tolist()) == (plain.volume, plain.inertia_over_mass.tolist())


def test_a_template_of_liggghts_has_the_mass_that_liggghts_gives_it() -> None:
    """LIGGGHTS said at the insertion of ``liggghts_clumps.in``: 150 templates of 1000 kg/m3, 3.531203e-3 kg.

    Its volume is counted on a million random points in the box of the template: 0.1 % is two deviations.
    """
    volume = read_clump(DATA / "pellet.multisphere").shape.volume
    assert 150 * 1000.0 * volume == pytest.approx(3.531203e-3, rel=1e-3)


def test_a_clump_is_taken_from_a_dump_of_it(tmp_path: Path) -> None:
    """LIGGGHTS moved and turned it: places of six digits keep the moments to 1e-4."""
    text = (DATA / "liggghts_clumps.dump").read_text("utf-8")
    head, _, rows = text.partition("id_multisphere \n")
    body = [row for row in rows.splitlines() if row.split()[-1] == "114"]
    one = tmp_path / "one.dump"
    one.write_text(f"{head}id_multisphere \n".replace("\n447\n", "\n3\n") + "\n".join(body) + "\n", "utf-8")
    shape = read_clump(one, "m").shape
    assert shape.volume == pytest.approx(PELLET.volume, rel=1e-4)
    np.testing.assert_allclose(np.sort(shape.inertia_over_mass), np.sort(PELLET.inertia_over_mass), rtol=1e-3)


def test_another_unit_than_the_file_names_is_refused() -> None:
    with pytest.raises(InputError, match="the unit must be that of the file"):
        read_clump(DATA / "pellet.multisphere", "m")


@pytest.mark.parametrize("name", ["sheet of an export", "edem table", "german excel"])
def test_a_table_names_its_unit(tmp_path: Path, name: str) -> None:
    path = tmp_path / "spheres.csv"
    path.write_text(FILES[name], "utf-8")
    assert read_clump(path, "mm").shape.volume == read_clump(path).shape.volume
    with pytest.raises(InputError, match="the unit must be that of the file"):
        read_clump(path, "m")


def test_a_sheet_of_two_shapes_or_two_units_is_no_clump(tmp_path: Path) -> None:
    path, sheet = tmp_path / "spheres.csv", FILES["sheet of an export"]
    head, last = sheet.rstrip().rsplit("\n", 1)
    for row, rule in (
        (f"2{last[1:]}", "must be one body"),
        (last.replace("mm", "cm"), "the same unit of length"),
    ):
        path.write_text(f"{head}\n{row}\n", "utf-8")
        with pytest.raises(InputError, match=rule):
            read_clump(path)


def test_a_file_without_a_unit_takes_the_one_given(tmp_path: Path) -> None:
    path = tmp_path / "grain.csv"
    path.write_text(FILES["deme"], "utf-8")
    for unit, size in (("m", 1.0), ("cm", 1e-2), ("2.5 mm", 2.5e-3)):
        assert read_clump(path, unit).shape.volume == pytest.approx(
            PELLET.volume * (size / 1e-3) ** 3, rel=1e-9
        )


def test_metres_taken_for_millimetres_are_seen(tmp_path: Path) -> None:
    path = tmp_path / "grain.csv"
    path.write_text("x,y,z,r\n0,0,-0.0015,0.0012\n0,0,0,0.0015\n0,0,0.0015,0.0012\n", "utf-8")
    assert "Give the unit (--unit" in refused("clump", path)
    _, out, _ = dem_warp("clump", path, "--unit", "m", "--json")
    assert json.loads(out)["volume_mm3"] == pytest.approx(1e9 * PELLET.volume, rel=1e-9)


@pytest.mark.parametrize("name", FILES)
def test_a_study_reads_them(tmp_path: Path, write_study: Callable[..., Path], name: str) -> None:
    (tmp_path / "grain.txt").write_text(FILES[name], "utf-8")
    study = load_study(write_study(('sphere = "2 mm"', 'clump = "grain.txt"')))
    np.testing.assert_allclose(study.grain.shape().centers, PELLET.centers, rtol=1e-12, atol=1e-18)


def test_a_study_names_the_unit(tmp_path: Path, write_study: Callable[..., Path]) -> None:
    (tmp_path / "grain.csv").write_text(FILES["deme"], "utf-8")
    study = load_study(write_study(('sphere = "2 mm"', 'clump = "grain.csv"\nclump_unit = "2 mm"')))
    assert study.grain.shape().volume == pytest.approx(8.0 * PELLET.volume, rel=1e-9)
    for wrong, rule in (('clump = "grain.csv"\nclump_unit = "kg"', "a unit of length"),
                        ('sphere = "2 mm"\nclump_unit = "mm"', "only with a clump")):  # fmt: skip
        path = tmp_path / "small.toml"
        path.unlink()
        path = write_study(('sphere = "2 mm"', wrong))
        with pytest.raises(InputError, match=rule):
            load_study(path)


TWO = "x y z r\n0 0 0 1\n5 0 0 1\n"


@pytest.mark.parametrize(
    ("text", "rule", "place"),
    [
        ("0 0 0 1\n0 0 one 1\n", "four finite numbers", "line 2"),
        ("0 0 0 -1\n", "r > 0", "line 1"),
        ("x,y,z,r\n", "no spheres", ""),
        ("x (ft),y (ft),z (ft),r (ft)\n0,0,0,1\n", "a unit of length", "line 1"),
        ("x (mm),y,z,r\n0,0,0,1\n", "must have a unit", "line 1"),
        (TWO, "must touch", ""),
        ("#format x_y_z_r_clumpId\n0 0 0 1 3\n0 0 1 1 4\n", "one body", ""),
        (
            "clumpTemplate(relRadii=[1, 2], relPositions=[[0, 0, 0]])\n",
            "a position (x, y, z) for each",
            "line 1",
        ),
        ("clumpTemplate(relRadii=radii, relPositions=places)\n", "lists of plain numbers", "line 1"),
        ("clumpTemplate(relRadii=[1], relPositions=[[0,0,0]])\n" * 2, "must have one clumpTemplate", ""),
        ("<particle><sphere x='0'", "well-formed XML", ""),
        ("<!DOCTYPE a [<!ENTITY b 'c'>]><a>&b;</a>", "with a document type", ""),
        ("<a><sphere x='0' y='0' z='0'/></a>", "no spheres", ""),
        ("<a><sphere x='0' y='0' z='0' radius='big'/></a>", "four finite numbers", "sphere 1"),
        ("", "is empty", ""),
    ],
)
def test_a_wrong_file_is_refused_with_its_place(tmp_path: Path, text: str, rule: str, place: str) -> None:
    path = tmp_path / "grain"
    path.write_text(text, "utf-8")
    with pytest.raises(InputError) as caught:
        read_clump(path)
    assert rule in caught.value.problem
    assert caught.value.place == f"{path}, {place}" if place else caught.value.place == str(path)


@pytest.mark.parametrize(
    ("data", "named"),
    [
        ("x y z r\n0 0 0 1\n".encode("utf-16"), "UTF-16"),
        (b"\x00\x01\x02\x03" * 9, "binary data"),
    ],
)
def test_other_encodings_are_named(tmp_path: Path, data: bytes, named: str) -> None:
    path = tmp_path / "grain"
    path.write_bytes(data)
    with pytest.raises(InputError, match=named):
        read_clump(path)
