"""Heaps of LIGGGHTS, LAMMPS and Yade, measured like dem-warp's own.

The files under ``data`` were written by LIGGGHTS-PUBLIC 3.8.0, LAMMPS and Yade 2023.02a of Debian 12 with the
scripts there.
"""

import json
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
import pyvista
from commandline import dem_warp, refused
from scipy.spatial import cKDTree
from vtkmodules.vtkCommonDataModel import vtkPartitionedDataSet
from vtkmodules.vtkIOHDF import vtkHDFWriter

from experiments.grains.spheres import read_spheres
from experiments.io.errors import InputError
from imaging import PictureError, heap_angle
from imaging.drawing import opengl
from imaging.drawing.ground import find_ground
from imaging.geometry import Spheres

DATA = Path(__file__).parent / "data"


def measured(*arguments: object) -> list[dict]:
    code, out, err = dem_warp("angle", *arguments, "--json")
    assert code == 0, err
    return json.loads(out)["pictures"]


@pytest.mark.parametrize(
    "names",
    [
        ("liggghts_spheres.dump", "liggghts_scaled.dump", "liggghts_20000.vtk"),
        ("lammps_scaled.dump", "lammps_unwrapped.dump"),
        ("yade_spheres.txt", "yade_spheres_id.txt", "yade_-spheres-00000000.vtk", "yade-spheres.20000.vtu"),
    ],
)
def test_one_heap_has_the_same_spheres_in_every_format(names: tuple[str, ...]) -> None:
    first, *others = (read_spheres(DATA / name).spheres for name in names)
    for other in others:
        distance, nearest = cKDTree(first).query(other)
        assert sorted(nearest) == list(range(len(first)))
        # Six digits of a place in a box of 0.13 m.
        assert distance.max() < 1e-6


def test_the_angle_is_that_of_the_spheres_on_the_plate_of_the_script() -> None:
    """Read without the package's reader: the last frame, the plate of ``liggghts_spheres.in`` taken off."""
    last = (DATA / "liggghts_spheres.dump").read_text("utf-8").rpartition("ITEM: ATOMS")[2]
    table = np.loadtxt(last.splitlines()[1:])
    plate = np.array([0.0, 0.0, -0.003])
    truth = heap_angle(table[:, 2:5] - plate, table[:, 5])
    [given] = measured(DATA / "liggghts_spheres.dump", "--plate-height", "-3 mm")
    assert (given["mean"], given["se"]) == pytest.approx((truth.mean, truth.se), abs=1e-9)
    assert "frame 2 of 2 (timestep 20000)" in given["source"]
    assert given["doubts"] == []
    [high] = measured(DATA / "liggghts_spheres.dump", "--plate-height", "1 mm")
    assert any("given at 1 mm; most spheres rest at -3" in doubt for doubt in high["doubts"])
    # Found where most spheres rest, a few micrometres deep in the plate.
    spheres = read_spheres(DATA / "liggghts_spheres.dump").spheres
    assert find_ground(Spheres(spheres[:, :3], spheres[:, 3])) == pytest.approx(-3e-3, abs=1e-5)


def test_the_unit_scales_the_radii_and_not_the_angle(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(opengl, "opengl_works", lambda: False)
    [metres] = measured(DATA / "yade_clumps.txt", "--overlay", tmp_path / "drawn")
    assert Path(metres["overlay"]).stat().st_size > 1000
    [millimetres] = measured(DATA / "yade_clumps.txt", "--unit", "mm")
    assert millimetres["mean"] == pytest.approx(metres["mean"], abs=1e-6)
    assert "1.2 to 1.5 mm radius in 208 grains" in metres["source"]
    assert "0.0012 to 0.0015 mm radius in 208 grains" in millimetres["source"]


def test_grains_next_to_the_plate_do_not_count() -> None:
    spheres = read_spheres(DATA / "yade_spheres.txt").spheres
    fallen = int((spheres[:, 2] < 0.0).sum())
    assert fallen > 0
    [row] = measured(DATA / "yade_spheres.txt")
    assert f"{fallen} below it left out" in row["source"]
    assert "plate found at" in row["source"]


def test_a_cut_dump_gives_its_last_complete_frame(tmp_path: Path) -> None:
    text = (DATA / "liggghts_spheres.dump").read_text("utf-8")
    cut = tmp_path / "cut.dump"
    cut.write_text(text[: int(0.9 * len(text))], "utf-8")
    read = read_spheres(cut)
    assert read.description.endswith("frame 1 of 2 (timestep 10000), the last complete one")
    assert len(read.spheres) == 280
    cut.write_text(text[:1000], "utf-8")
    with pytest.raises(InputError, match="no complete frame"):
        read_spheres(cut)


def test_clumps_of_a_dump_are_its_bodies() -> None:
    read = read_spheres(DATA / "liggghts_clumps.dump")
    assert (len(read.spheres), read.body_count) == (447, 149)


def test_a_flat_heap_is_doubted(tmp_path: Path) -> None:
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(40.0), np.arange(40.0)))
    z = 1.0 + 0.03 * (28.0 - np.hypot(x - 19.5, y - 19.5))
    flat = tmp_path / "flat.csv"
    rows = "".join(f"{a},{b},{c},0.6\n" for a, b, c in zip(x, y, z, strict=True))
    flat.write_text("x,y,z,r\n" + rows, "utf-8")
    [row] = measured(flat, "--unit", "mm", "--plate-height", "0 mm")
    assert any(doubt.startswith("range") for doubt in row["doubts"])


def test_few_grains_are_no_heap() -> None:
    with pytest.raises(PictureError, match="at least 20 grains, got 1"):
        heap_angle(np.array([[0.0, 0.0, 1e-3]]), np.array([1e-3]))


def test_a_plate_is_found_in_any_unit_and_under_grains_that_sink_in() -> None:
    random = np.random.default_rng(1)
    radii = random.normal(1.0, 0.05, 60)
    centers = np.column_stack([random.uniform(-20, 20, (60, 2)), radii - random.uniform(0.0, 0.01, 60)])
    layers = np.vstack([centers, centers + np.array([0.0, 0.0, 1.6])]) + np.array([0.0, 0.0, 7.0])
    for unit in (1.0, 1e-3):
        both = Spheres(unit * layers, unit * np.tile(radii, 2))
        # The deepest overlap is a hundredth of a radius.
        assert find_ground(both) == pytest.approx(7.0 * unit, abs=0.01 * unit)
    with pytest.raises(PictureError, match="give its height"):
        find_ground(Spheres(centers * [1.0, 1.0, 0.0] + np.arange(60.0)[:, None] * [0.0, 0.0, 1.0], radii))


def dump_with(line: str, replacement: str) -> str:
    text = (DATA / "lammps_scaled.dump").read_text("utf-8")
    assert text.count(line) == 1
    return text.replace(line, replacement)


@pytest.mark.parametrize(
    ("text", "rule", "place"),
    [
        (
            dump_with("ITEM: ATOMS id type xs ys zs radius", "ITEM: ATOMS id type xs ys zs"),
            "columns",
            "line 9",
        ),
        (
            dump_with("ITEM: BOX BOUNDS ff ff ff", "ITEM: BOX BOUNDS xy xz yz ff ff ff"),
            "a tilted box are not supported",
            "line 1",
        ),
        (
            dump_with("169 1 0.410705 0.0295139 0.0923283 0.002", "169 1 0.410705 nan 0.0923283 0.002"),
            "finite",
            "line 10",
        ),
        ("#format jointedPM\n1 2 3\n", "a format of Yade with spheres", "line 1"),
        ("x,y,z,weight\n1,2,3,4\n", "columns x, y, z and radius", "line 1"),
        ("# vtk DataFile Version 3.0\nnonsense\nASCII\n", "VTK file", "heap"),
    ],
)
def test_a_wrong_file_is_refused_with_its_place(tmp_path: Path, text: str, rule: str, place: str) -> None:
    path = tmp_path / "heap"
    path.write_text(text, "utf-8")
    err = refused("angle", path)
    assert rule in err
    assert f"{path}, {place}" in err if place != "heap" else str(path) in err


def test_blank_lines_take_no_longer_than_reading_them(tmp_path: Path) -> None:
    # 0.1 s; a search that began anew at each took most of a minute
    (tmp_path / "heap.txt").write_text("0 0 0 1.5\n" + "\n" * 200_000, encoding="utf-8")
    started = time.process_time()
    with suppress(InputError):
        read_spheres(tmp_path / "heap.txt")
    assert time.process_time() - started < 2.0


def with_floor(folder: Path, floor_type: int) -> Path:
    """Write the heap of LIGGGHTS on a floor of fixed spheres, which rests on the plate of the script."""
    text = (DATA / "liggghts_spheres.dump").read_text("utf-8")
    head, columns, rows = text.rpartition("ITEM: TIMESTEP")[2].rpartition("ITEM: ATOMS")
    names, count = rows.partition("\n")[0].split(), 900
    sides = np.linspace(-0.06, 0.06, 30)
    for number, (x, y) in enumerate(np.array(np.meshgrid(sides, sides)).reshape(2, -1).T):
        known = {"id": 5000 + number, "type": floor_type, "x": x, "y": y, "z": -0.004, "radius": 0.001}
        rows += " ".join(str(known.get(name, 0)) for name in names) + "\n"
    before = head.splitlines().index("ITEM: NUMBER OF ATOMS") + 1
    lines = head.splitlines()
    lines[before] = str(int(lines[before]) + count)
    path = folder / "floor.dump"
    path.write_text("ITEM: TIMESTEP" + "\n".join(lines) + "\n" + columns + rows, "utf-8")
    return path


def test_a_floor_of_another_type_is_mentioned_and_left_out_by_its_type(tmp_path: Path) -> None:
    path = with_floor(tmp_path, 2)
    [heap] = measured(DATA / "liggghts_spheres.dump")
    [row] = measured(path, "--type", "1")
    assert (row["mean"], row["se"]) == pytest.approx((heap["mean"], heap["se"]), abs=1e-9)
    [row] = measured(path)
    for part in ("2 (900 spheres)", "900 spheres of type 2 have the same z", "--type chooses"):
        assert part in row["source"]
    code, _, said = dem_warp("angle", path, "--type", "3")
    assert code == 2
    assert "must be a type of the file: 1 (278 spheres), 2 (900 spheres), got 3" in " ".join(said.split())


def test_a_heap_of_one_type_without_a_floor_has_nothing_to_mention() -> None:
    for name in ("liggghts_spheres.dump", "yade_clumps.txt", "yade-spheres.20000.vtu"):
        [row] = measured(DATA / name)
        assert "types:" not in row["source"]
        assert "the same" not in row["source"]


@pytest.mark.parametrize("name", ["t.csv", "t.xyz", "t.data", "t.npz", "t.vtp", "t.txt", "t.dump"])
def test_types_are_read_from_every_format_that_has_them(name: str, tmp_path: Path) -> None:
    path, types = tmp_path / name, [1, 2, 2]
    spheres = [(0.0, 0.0, 1.0, 0.5, types[0]), (1.0, 0.0, 1.0, 0.5, types[1]), (0.0, 1.0, 1.0, 0.5, types[2])]
    rows = {
        "t.csv": "x,y,z,radius,material\n" + "".join("{},{},{},{},{}\n".format(*row) for row in spheres),
        "t.xyz": "3\nProperties=pos:R:3:radius:R:1:species:S:1\n"
        + "".join("{} {} {} {} {}\n".format(*row) for row in spheres),
        "t.data": "3 0 0 0 0 1 1 1\n"
        + "".join("{} {} {} 0 0 0 {} 0 0 0 0 0 0 {}\n".format(*r) for r in spheres),
        "t.dump": "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n3\nITEM: ATOMS x y z radius element\n"
        + "".join("{} {} {} {} {}\n".format(*row) for row in spheres),
        "t.txt": "#format x_y_z_r_matId\n" + "".join("{} {} {} {} {}\n".format(*row) for row in spheres),
    }
    table = np.array(spheres)
    if name == "t.npz":
        np.savez(path, position=table[:, :3], radius=table[:, 3], type=table[:, 4])
    elif name == "t.vtp":
        cloud = pyvista.PolyData(table[:, :3])
        cloud["radius"], cloud["Particle_Type"] = table[:, 3], table[:, 4]
        cloud.save(path)
    else:
        path.write_text(rows[name], "utf-8")
    read = read_spheres(path)
    assert read.type_counts == {"1": 1, "2": 2}
    assert read.of_types(["2"], "").spheres[:, :2].tolist() == [[1.0, 0.0], [0.0, 1.0]]


def hdf(path: Path, data: pyvista.DataObject) -> Path:
    """Write a VTKHDF file."""
    writer = vtkHDFWriter()
    writer.SetInputDataObject(data)
    writer.SetFileName(str(path))
    assert writer.Write()
    return path


def test_a_particle_file_in_parts_is_read_whole(tmp_path: Path) -> None:
    parts = [pyvista.PolyData(np.array(points, float)) for points in ([[0, 0, 1], [1, 0, 1]], [[0, 1, 1]])]
    for part, radii in zip(parts, ([0.5, 0.4], [0.3]), strict=True):
        part["Diameter"] = 2 * np.array(radii)
    expected = [[0, 0, 1, 0.5], [1, 0, 1, 0.4], [0, 1, 1, 0.3]]
    pieces = vtkPartitionedDataSet()
    for number, part in enumerate(parts):
        pieces.SetPartition(number, part)
    blocks = pyvista.MultiBlock(parts)
    for name, data in {"parts": pieces, "blocks": blocks, "grid": blocks.combine()}.items():
        assert read_spheres(hdf(tmp_path / f"{name}.vtkhdf", data)).spheres == pytest.approx(
            np.array(expected)
        )


def test_a_vtkhdf_file_without_spheres_says_what_it_lacks(tmp_path: Path) -> None:
    image = hdf(tmp_path / "image.vtkhdf", pyvista.ImageData(dimensions=(2, 2, 2)))
    problem = (
        "the type of the VTKHDF file must be PolyData or UnstructuredGrid, whole or in parts, got ImageData"
    )
    assert f"{image}: {problem}" in refused("angle", image)
    bare = hdf(tmp_path / "bare.vtkhdf", pyvista.PolyData(np.eye(3)))
    assert f"{bare}: the points need an array radius" in refused("angle", bare)


def test_lines_of_another_order_and_diameters_are_no_silent_radii(tmp_path: Path) -> None:
    heap = read_spheres(DATA / "liggghts_spheres.dump").spheres
    np.savetxt(tmp_path / "first.txt", heap[:, [3, 0, 1, 2]] + [0.0, 0.0, 0.0, 0.1])
    np.savetxt(tmp_path / "plain.txt", heap)
    np.savetxt(tmp_path / "wide.txt", heap * [1, 1, 1, 2], header="x y z diameter")
    assert "is the radius in another column?" in refused("angle", tmp_path / "first.txt")
    [plain], [wide] = measured(tmp_path / "plain.txt"), measured(tmp_path / "wide.txt")
    assert wide["mean"] == pytest.approx(plain["mean"], abs=1e-9)


@pytest.mark.parametrize("head", ["t,x,y,z,r", "t (s),x,y,z,r", "step,x,y,z,r", "frame,x,y,z,r"])
def test_of_a_table_with_times_the_last_is_read(tmp_path: Path, head: str) -> None:
    path = tmp_path / "heap.csv"
    path.write_text(f"{head}\n0,0,0,1,1\n0,0,0,3,1\n0.5,4,0,1,2\n0.5,0,4,1,2\n", "utf-8")
    assert read_spheres(path).spheres.tolist() == [[4.0, 0.0, 1.0, 2.0], [0.0, 4.0, 1.0, 2.0]]


@pytest.mark.parametrize(
    ("head", "message"),
    [
        (
            "x,y,z,r,t",
            "line 1: must say whether it is a time or a type, got t. Call the column time, or type",
        ),
        ("x,y,z,r,radius", "line 1: must have one column r, got r, radius. Rename the others"),
        ("x,y,z,r,Position Z", "line 1: must have one column z, got z, Position Z. Rename the others"),
    ],
)
def test_a_column_with_two_meanings_is_refused(tmp_path: Path, head: str, message: str) -> None:
    path = tmp_path / "heap.csv"
    path.write_text(f"{head}\n0,0,1,1,1\n0,0,3,1,2\n", "utf-8")
    assert f"heap.csv, {message}" in refused("angle", path)
    path.write_text(f"{head}\n0,0,1,1,1\n0,0,1,1,1\n", "utf-8")
    assert len(read_spheres(path).spheres) == 2, "the same numbers have one meaning"


@pytest.mark.parametrize("axis", ["x", "y", "-x", "-y", "-z"])
def test_a_heap_whose_height_is_along_another_axis_is_read_so(tmp_path: Path, axis: str) -> None:
    heap = read_spheres(DATA / "lammps_scaled.dump").spheres
    [upright] = measured(DATA / "lammps_scaled.dump")
    turned = heap[:, [1, 0, 2]] * [1.0, 1.0, -1.0] if axis.startswith("-") else heap[:, :3]
    places = np.roll(turned, "xyz".index(axis[-1]) - 2, axis=1)
    np.savez(tmp_path / "a.npz", position=places, radius=heap[:, 3])
    [row] = measured(tmp_path / "a.npz")
    # the same spheres, seen from the same eight sides
    assert (row["mean"], row["se"]) == pytest.approx((upright["mean"], upright["se"]), abs=1e-9)
    assert f"height seems to be along {axis}" in row["source"]
    assert "along" not in upright["source"]


@pytest.mark.parametrize("column", ["v_radius", "v_r", "c_diameter", "f_d", "d_rad"])
def test_the_size_of_a_dump_may_be_a_variable(tmp_path: Path, column: str) -> None:
    text = (DATA / "liggghts_spheres.dump").read_text("utf-8")
    factor = 0.5 if column in ("c_diameter", "f_d") else 1.0
    path = tmp_path / "heap.dump"
    path.write_text(text.replace("radius", column), "utf-8")
    spheres = read_spheres(DATA / "liggghts_spheres.dump").spheres
    assert read_spheres(path).spheres == pytest.approx(spheres * [1, 1, 1, factor])
