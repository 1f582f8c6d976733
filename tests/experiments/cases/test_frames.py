"""Frames and pictures that ``dem-warp heap`` leaves: read back with VTK, and measured again."""

import json
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
import pyvista
from commandline import dem_warp, refused
from PIL import Image
from scipy.spatial.transform import Rotation
from small_study import ANGLE, TUBE

from dem_warp import CaseResult
from experiments.cases import Heap, write_heap
from experiments.grains.spheres.reader import read_spheres
from experiments.measurement.case_observables import observe
from experiments.studyfile import Study

COUNT = 4
SERIES = ("spheres", "grains", "contacts", "plate", "tube")


@pytest.fixture(scope="module")
def filmed(tmp_path_factory: pytest.TempPathFactory, small_text: str) -> Path:
    """Folder of a heap of two-sphere grains with frames."""
    folder = tmp_path_factory.mktemp("Körner und Rahmen")
    (folder / "two.txt").write_text("-0.001 0 0 0.0015\n0.001 0 0 0.0015\n", encoding="utf-8")
    study = folder / "study.toml"
    text = small_text.replace('sphere = "2 mm"', 'clump = "two.txt"\nclump_unit = "m"')
    # the laws of a new study, whose kernels another test compiles, too
    study.write_text(f'{text}\n[solver]\nlaws = "relative"\n', encoding="utf-8")
    words = ("heap", study, "--device", "cpu", "--frames", COUNT)
    code, _, err = dem_warp(*words, "--out", folder / "filmed")
    assert code == 0, err
    return folder


@pytest.fixture(scope="module")
def series(filmed: Path) -> dict[str, list[tuple[float, pyvista.PolyData]]]:
    """Time and data of every frame of every series, as ParaView reads them."""
    found = {}
    for name in SERIES:
        reader = pyvista.PVDReader(filmed / "filmed" / "frames" / f"{name}.pvd")
        frames = []
        for number, time in enumerate(reader.time_values):
            reader.set_active_time_point(number)
            frames.append((time, reader.read()[0]))
        found[name] = frames
    return found


def test_every_series_has_every_time_in_seconds(filmed: Path, series: dict) -> None:
    end = json.loads((filmed / "filmed/angle.json").read_text("utf-8"))["observables"]["simulated_time"]
    times = [time for time, _ in series["grains"]]
    assert (len(times), times[0]) == (COUNT, 0.0)
    assert times[-1] == pytest.approx(end, rel=1e-8)
    assert all([time for time, _ in series[name]] == times for name in SERIES)


def test_grains_and_spheres_have_their_arrays(series: dict) -> None:
    grains, spheres = series["grains"][-1][1], series["spheres"][-1][1]
    assert grains.n_points == grains.n_verts == 30
    assert spheres.n_points == spheres.n_verts == 60
    names = "id radius mass shape orientation tensor v omega f"
    assert set(grains.array_names) == set(names.split())
    assert set(spheres.array_names) == {"id", "radius", "grain", "shape", "v", "omega"}
    assert sorted(grains["id"]) == list(range(30))
    assert len(set(spheres["id"])) == 60
    # The axes of the matrix are those of the quaternion; single precision.
    turns = Rotation.from_quat(grains["orientation"]).as_matrix()
    np.testing.assert_allclose(grains["tensor"].reshape(-1, 3, 3), turns, atol=1e-6)
    # Both spheres of a grain lie 1 mm from its centre, times its size, along its first axis.
    for k, owner in enumerate(grains["id"]):
        apart = np.diff(spheres.points[spheres["grain"] == owner], axis=0)[0]
        size = np.linalg.norm(apart) / 2e-3
        np.testing.assert_allclose(np.abs(apart @ turns[k][:, 0]), 2e-3 * size, rtol=1e-4)
        np.testing.assert_allclose(spheres["radius"][spheres["grain"] == owner], 1.5e-3 * size, rtol=1e-4)


def test_a_sphere_moves_as_a_point_of_its_grain(series: dict) -> None:
    time, grains = next((t, g) for t, g in series["grains"] if g.n_points and np.abs(g["omega"]).max() > 1.0)
    spheres = next(s for t, s in series["spheres"] if t == time)
    row = {owner: k for k, owner in enumerate(grains["id"])}
    rows = [row[owner] for owner in spheres["grain"]]
    moved = grains["v"][rows] + np.cross(grains["omega"][rows], spheres.points - grains.points[rows])
    # Single precision of 1 m/s, and of places of 0.1 m times spins of 100 rad/s.
    np.testing.assert_allclose(spheres["v"], moved, atol=1e-5)


def test_the_contacts_carry_the_heap(series: dict) -> None:
    grains, contacts = series["grains"][-1][1], series["contacts"][-1][1]
    weight = 9.81 * grains["mass"].sum()
    on_plate = contacts["wall"] == 0
    assert contacts.n_lines == contacts.n_cells > 0
    # At rest: speeds below 1 cm/s change by far less than a hundredth of the weight.
    assert contacts["force"][on_plate, 2].sum() == pytest.approx(weight, rel=0.01)
    np.testing.assert_allclose(grains["f"].sum(axis=0), [0.0, 0.0, weight], atol=0.01 * weight)
    sizes = np.hypot(contacts["normal_force"], contacts["tangential_force"])
    np.testing.assert_allclose(sizes, np.linalg.norm(contacts["force"], axis=1), rtol=1e-5)
    # A line goes from the centre of its first grain to that of its second, or to the wall.
    place = dict(zip(grains["id"].tolist(), grains.points, strict=True))
    starts, ends = contacts.points[contacts.lines.reshape(-1, 3)[:, 1:].T]
    for k in range(contacts.n_cells):
        np.testing.assert_array_equal(starts[k], place[contacts["id1"][k]])
        second = contacts["point"][k] if on_plate[k] else place.get(contacts["id2"][k], contacts["point"][k])
        np.testing.assert_array_equal(ends[k], second)


def test_the_walls_stand_where_they_are(series: dict) -> None:
    first, last = (series["tube"][k][1] for k in (0, -1))
    assert first.bounds[4:] == pytest.approx((0.0, 0.028), abs=1e-6)
    assert np.ptp(first.points[:, 0]) == pytest.approx(0.028, rel=1e-3)
    assert last.bounds[4] > 0.0
    assert last.bounds[5] - last.bounds[4] == pytest.approx(0.028, rel=1e-6)
    assert all(plate.bounds[4:] == (0.0, 0.0) for _, plate in series["plate"])


def test_files_are_such_that_ovito_reads_them(filmed: Path) -> None:
    # Its reader knows no compression, and takes points for particles where each is a vertex and nothing
    # comes before the piece.
    files = [filmed / "filmed/heap.vtp", *(filmed / "filmed/frames").glob("*/*.vtp")]
    assert len(files) == 1 + len(SERIES) * COUNT
    for file in files:
        root = ET.parse(file).getroot()
        assert "compressor" not in root.attrib
        [data] = root
        [piece] = data
        assert (data.tag, piece.tag) == ("PolyData", "Piece")
        if file.parent.name in ("spheres", "grains", "filmed"):
            assert piece.attrib["NumberOfVerts"] == piece.attrib["NumberOfPoints"]


def test_one_particle_file_has_the_spheres_of_every_time(filmed: Path, series: dict, tmp_path: Path) -> None:
    path = filmed / "filmed/frames/spheres.vtkhdf"
    reader = pyvista.get_reader(str(path), force_ext=".hdf")
    for number, (_, spheres) in enumerate(series["spheres"]):
        reader.reader.SetStep(number)
        found = reader.read()
        np.testing.assert_array_equal(found.points, spheres.points)
        np.testing.assert_array_equal(found["radius"], spheres["radius"])
    # files of spheres are read at their last time
    last = series["spheres"][-1][1]
    read = read_spheres(path)
    np.testing.assert_allclose(read.spheres, np.column_stack([last.points, last["radius"]]), rtol=1e-7)
    assert read.bodies is not None
    cut = tmp_path / "cut.vtkhdf"
    cut.write_bytes(path.read_bytes()[:-1000])
    assert f"{cut}: the VTKHDF file is cut off or damaged" in refused("angle", cut)


def test_the_film_has_every_frame(filmed: Path) -> None:
    with Image.open(filmed / "filmed/heap.gif") as film:
        assert film.n_frames == COUNT


def test_the_clean_picture_measures_to_the_same_angle(
    tmp_path: Path, small_study: Study, cone: Callable[..., CaseResult]
) -> None:
    result = cone(0.55)
    heap = Heap(small_study, {}, 1, result, observe(small_study.measurement, result, True))
    write_heap(heap, tmp_path)
    assert heap.angle is not None
    truth = heap.angle.views[0]
    assert dem_warp("angle", tmp_path / "heap.vtp", "--overlay", tmp_path)[0] == 0
    for clean, annotated in (("snapshot-clean", "snapshot"), ("heap-angle-clean", "heap-angle")):
        code, out, err = dem_warp("angle", tmp_path / f"{clean}.png", "--json")
        assert code == 0, err
        [seen] = json.loads(out)["pictures"]
        # The tolerance of a smooth heap in `imaging`.
        assert [seen["left"], seen["right"]] == pytest.approx([truth.left, truth.right], abs=0.3)
        drawn, bare = (cv2.imread(str(tmp_path / f"{name}.png")) for name in (annotated, clean))
        assert (drawn != bare).any(axis=2).mean() > 0.001


def test_another_test_is_filmed_and_gives_what_it_measures(
    write_study: Callable[..., Path], tmp_path: Path
) -> None:
    hopper = '[scene.hopper]\ndiameter = "40 mm"\nfill_depth = "16 mm"\noutlet = "20 mm"\n'
    study, out = write_study((TUBE, hopper), (ANGLE, "")), tmp_path / "out"
    words = ("heap", study, "--device", "cpu", "--frames", 2, "--movie", "mp4", "--out", out)
    code, said, err = dem_warp(*words)
    assert (code, err.splitlines()[-1]) == (0, f"Files: {out}")
    printed = dict(line.split(": ") for line in said.splitlines())
    kept = json.loads((out / "angle.json").read_text(encoding="utf-8"))
    assert kept["angle"] is None
    assert printed["fallen mass"] == f"{kept['observables']['fallen_mass']:.5g} kg"
    assert kept["observable_units"]["fallen_mass"] == "kg"
    assert (out / "snapshot.png").is_file()
    names = {"spheres", "grains", "contacts", "bin", "floor", "plug"}
    assert {path.stem for path in (out / "frames").glob("*.pvd")} == names
    film = cv2.VideoCapture(str(out / "heap.mp4"))
    assert film.get(cv2.CAP_PROP_FRAME_COUNT) == 2
