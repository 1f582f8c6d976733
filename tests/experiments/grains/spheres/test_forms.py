"""The same spheres in the forms of other programs, and files that are neither spheres nor pictures."""

import gzip
from pathlib import Path

import numpy as np
import pytest
from commandline import dem_warp

from experiments.grains.spheres import read_spheres
from experiments.io.errors import InputError

SPHERES = np.array([[0.0, 0.0, 1e-3, 1e-3], [1e-3, -2e-3, 1.5e-3, 1.5e-3], [2.5e-3, 1e-3, 2e-3, 1.25e-3]])
PIECE = (
    '<VTKFile type="PUnstructuredGrid" version="0.1"><PUnstructuredGrid GhostLevel="0"><PPoints>'
    '<PDataArray type="Float64" NumberOfComponents="3"/></PPoints><PPointData><PDataArray type="Float64" '
    'Name="diameter"/></PPointData><Piece Source="p.vtu"/></PUnstructuredGrid></VTKFile>'
)
TIMES = '<DataSet timestep="0" part="0" file="p.vtu"/><DataSet timestep="1" part="0" file="p.pvtu"/>'
SERIES = f'<VTKFile type="Collection" version="0.1"><Collection>{TIMES}</Collection></VTKFile>'


def _dump() -> str:
    rows = "".join(f"{n} 1 {x} {y} {z} {r}\n" for n, (x, y, z, r) in enumerate(SPHERES, 1))
    box = "ITEM: BOX BOUNDS ff ff ff\n" + "-1 1\n" * 3
    return f"ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n3\n{box}ITEM: ATOMS id type x y z radius\n{rows}"


def _xyz() -> str:
    rows = "".join(f"X {x} {y} {z} 0 0 0 {r}\n" for x, y, z, r in SPHERES)
    return f'3\nLattice="1 0 0 0 1 0 0 0 1" Properties=species:S:1:pos:R:3:velo:R:3:radius:R:1 Time=0\n{rows}'


def _mercury() -> str:
    rows = "".join(f"{x} {y} {z} 0 0 0 {r} 0 0 0 0 0 0 0\n" for x, y, z, r in SPHERES)
    return f"3 0.5 -1 -1 -1 1 1 1\n{rows}"


def write_form(name: str, folder: Path) -> Path:
    """Write the spheres in the form of a file's name."""
    path, text = folder / name, {"a.xyz": _xyz, "a.data": _mercury}.get(name, _dump)()
    if name.endswith(".gz"):
        path.write_bytes(gzip.compress(text.encode()))
    elif name == "a.npz":
        np.savez(path, position=SPHERES[:, :3], radius=SPHERES[:, 3])
    elif name == "a.npy":
        np.save(path, SPHERES)
    elif name.startswith("p."):
        import pyvista

        grid = pyvista.PolyData(SPHERES[:, :3]).cast_to_unstructured_grid()
        grid["diameter"] = 2 * SPHERES[:, 3]
        grid.save(folder / "p.vtu")
        (folder / "p.pvtu").write_text(PIECE)
        (folder / "p.pvd").write_text(SERIES)
    else:  # a last frame that is cut off
        path.write_text(text + text[: len(text) // 2])
    return path


@pytest.mark.parametrize("name", ["a.dump.gz", "a.xyz", "a.data", "a.npz", "a.npy", "p.pvtu", "p.pvd"])
def test_spheres_are_the_same_in_every_form(name: str, tmp_path: Path) -> None:
    read = read_spheres(write_form(name, tmp_path)).spheres
    assert read == pytest.approx(SPHERES, rel=1e-6)  # VTK's points are single precision


def test_an_error_in_a_compressed_file_names_the_file_that_was_given(tmp_path: Path) -> None:
    path = tmp_path / "heap.dump.gz"
    path.write_bytes(gzip.compress(_dump().replace("radius", "mass").encode()))
    with pytest.raises(InputError, match="radius") as refusal:
        read_spheres(path)
    assert refusal.value.place.startswith(str(tmp_path / "heap.dump"))
    path.write_bytes(gzip.compress(_dump().encode())[:-9])
    with pytest.raises(InputError, match="cannot be read"):
        read_spheres(path)


@pytest.mark.parametrize(
    ("content", "name"),
    [
        (b"\0\1LAMMPSCUSTOM\0\0", "a binary dump of LAMMPS"),
        (b"\x89HDF\r\n\x1a\n\0", "an HDF5 file"),
        (b"%PDF-1.7 ", "a PDF"),
        (b"PK\3\4\0\0xl/workbook.xml", "a ZIP archive"),
        (b"\0\0\0 ftypisom\0\0", "a video"),
    ],
)
def test_another_format_is_named(content: bytes, name: str, tmp_path: Path) -> None:
    (tmp_path / "heap.bin").write_bytes(content)
    code, _, said = dem_warp("angle", tmp_path / "heap.bin")
    assert code == 2
    assert name in " ".join(said.split())
    assert "OpenCV" not in said


def _table(head: str, row: str, tail: str = "") -> str:
    return f"{head}\n{''.join(row.format(*sphere) for sphere in SPHERES)}{tail}"


@pytest.mark.parametrize(
    "text",
    [
        _table("id pos_x pos_y pos_z rad", "7 {} {} {} {}\n"),
        _table(
            '"Particle X-Coordinate (m)","Particle Y-Coordinate (m)","Particle Z-Coordinate (m)",'
            '"Particle Radius (m)"',
            "{},{},{},{}\n",
        ),
        _table("% a study\n% x y z r", "{} {} {} {}\n"),
        "Time (s),x,y,z,r\n" + "".join(f"0,{x},{y},{z + 1},{r}\n" for x, y, z, r in SPHERES)
        + "".join(f"0.5,{x},{y},{z},{r}\n" for x, y, z, r in SPHERES),
        "x [µm];y [μm];z [um];r [µm]\n"
        + "".join(";".join(f"{1e6 * value:.9g}" for value in sphere) + "\n" for sphere in SPHERES),
    ],
)  # fmt: skip
def test_tables_of_other_programs_give_the_spheres_of_their_last_time(text: str, tmp_path: Path) -> None:
    path = tmp_path / "heap.txt"
    path.write_text(text, encoding="utf-8")
    read = read_spheres(path)
    np.testing.assert_allclose(read.spheres * (read.unit or 1.0), SPHERES, rtol=1e-8)


def test_a_name_with_a_blank_shifts_no_column(tmp_path: Path) -> None:
    path = tmp_path / "heap.txt"
    path.write_text(_table("Ball id x y z r wall mat", "7 {} {} {} {} 0.1 1\n"), encoding="utf-8")
    with pytest.raises(InputError, match=r"line 2: must have as many cells as line 1 has names, 8"):
        read_spheres(path)
