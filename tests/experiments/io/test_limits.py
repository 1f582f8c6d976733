"""Files that would take all memory or time, or are no files: each is refused by a stated limit."""

import gzip
import os
import time
import tracemalloc
import zipfile
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from dem_warp import ClumpShape
from dem_warp.solids import read_mesh
from doe import DesignError
from doe.discrepancy import load_bank
from experiments.cases.store.outcome_table import OutcomeTable
from experiments.grains.clumps.mesh_file import read_surface
from experiments.grains.spheres import read_spheres
from experiments.io import errors, rows, toml_files, units
from experiments.measurement.measured_target import with_measurements
from experiments.runs.choices import measured_study
from experiments.studyfile import load_study
from experiments.studyfile.manifest import read_manifest
from imaging import PictureError, measure_photograph
from imaging.photo.picture_file import read_picture

WriteStudy = Callable[..., Path]

READERS: dict[str, Callable[[Path], object]] = {
    "a.toml": load_study,
    "a.csv": lambda path: list(rows.read_rows(path, [], ["a"])),
    "a.xlsx": lambda path: list(rows.read_rows(path, [], ["a"])),
    "a.txt": ClumpShape.read,
    "a.stl": read_mesh,
    "a.png": read_picture,
    "a.jpg": lambda path: measure_photograph(path, "flank"),
    "a.npz": load_bank,
    "study.json": lambda path: read_manifest(path.parent),
    "a.sqlite": lambda path: OutcomeTable(path).load(["a"]),
}
"""Readers of files that anyone may send, by a file name that they take."""

REFUSED = (ValueError, OSError)


@pytest.mark.parametrize("name", READERS)
def test_a_pipe_and_a_device_are_no_files(tmp_path: Path, name: str) -> None:
    os.mkfifo(tmp_path / name)
    with pytest.raises(REFUSED, match="regular file" if name == "a.png" else None):
        READERS[name](tmp_path / name)
    (tmp_path / name).unlink()
    (tmp_path / name).symlink_to("/dev/zero")
    with pytest.raises(REFUSED):
        READERS[name](tmp_path / name)


@pytest.mark.parametrize("name", ["a.toml", "a.csv", "a.xlsx", "a.txt", "a.stl", "a.png"])
def test_a_file_of_a_terabyte_is_not_read(tmp_path: Path, name: str) -> None:
    with (tmp_path / name).open("wb") as file:
        file.truncate(10**12)
    with pytest.raises(REFUSED, match=r"at most [\d,]+ bytes"):
        READERS[name](tmp_path / name)


@pytest.mark.parametrize("text", ["1" * 4000 + "x", "9" * 400])
def test_a_long_number_is_no_quantity(text: str) -> None:
    started = time.process_time()
    with pytest.raises(ValueError, match="must be"):
        units.Quantity.parse(text)
    # a cubic search takes minutes
    assert time.process_time() - started < 0.1


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("[measurement]\nazimuths = 1000000000\n", "azimuths"),
        ("seeds = " + "[" * 100_000, "levels of tables|valid TOML"),
        ("[a" + ".a" * 100_000 + "]\n", "levels of tables"),
        ("n = " + "1" * 5000 + "\n", "valid TOML"),
        (f"[numerics]\nskin = {10**400}\n", "64 bits"),
        ("[campaign.noise_floor]\nreplicates = 1000000000\n", "replicates.*equal to 1000"),
        ("[campaign.climb]\nsteps = 1000000000\n", "steps.*equal to 1000"),
        ("[campaign.surface]\ncenter_points = 1000000000\n", "center_points.*equal to 1000"),
    ],
)
def test_an_excessive_study_is_refused(write_study: WriteStudy, line: str, said: str) -> None:
    measurement = "[measurement]\nazimuths = 2\npixels = 200\n"
    path = write_study((measurement, ""), ("[numerics]\nmodulus_scale = 400.0\n", ""), add=line)
    with pytest.raises(errors.StudyError, match=said):
        load_study(path)


@pytest.mark.parametrize(
    ("new", "most", "value", "key"),
    [
        ("grain_count = 100000000", "20,000,000", "100,000,000", "lifted-cylinder.grain_count"),
        ("grain_count = 1000000000", "134,217,728", "1,000,000,000", "lifted-cylinder.grain_count"),
        ('height = "9e9 m"', "134,217,728", "", "scene.lifted-cylinder"),
    ],
)
def test_a_case_that_no_memory_holds_is_refused_before_it_is_made(
    write_study: WriteStudy, new: str, most: str, value: str, key: str
) -> None:
    height = ('height = "28 mm"\n', "" if "height" in new else 'height = "28 mm"\n')
    study = load_study(write_study(height, ("grain_count = 30", new)))
    for refused in (lambda: study.case({}, 1), lambda: measured_study(study)):
        with pytest.raises(errors.StudyError, match=f"at most {most} grains") as caught:
            refused()
        [problem] = caught.value.problems
        assert problem.place.endswith(key)
        assert "got" not in problem.problem
        assert not value or problem.value == value


def test_the_place_of_too_many_grains_is_that_of_the_condition_that_asks_for_them(
    write_study: WriteStudy,
) -> None:
    condition = "\n[condition.large]\nscene.lifted-cylinder.grain_count = 130_000_000\n"
    study = load_study(write_study(add=condition))
    with pytest.raises(errors.StudyError) as caught:
        study.case({}, 1, "large")
    assert caught.value.place.endswith(": condition.large.scene.lifted-cylinder.grain_count")


def test_a_clump_has_a_limit_of_spheres(tmp_path: Path) -> None:
    path = tmp_path / "clump.txt"
    path.write_text("0 0 0 1\n" * 20_000, encoding="utf-8")
    with pytest.raises(ValueError, match="at most 256 spheres"):
        ClumpShape.read(path)


@pytest.mark.parametrize(
    ("name", "start", "said"),
    [
        ("plain.txt", "", "at most 1,500,000 lines, got 1,600,000. Write the grains of the heap alone"),
        ("table.csv", "x y z r\n", "at most 1,500,000 lines, got 1,600,001"),
        ("yade.txt", "#format x_y_z_r\n", "at most 1,500,000 lines, got 1,600,001"),
        ("cloud.off", "OFF\n1600000 0 0\n", "at most 1,000,000 lines, got 1,600,002. Simplify it"),
    ],
)
def test_a_text_of_too_many_spheres_or_corners_is_not_read(
    tmp_path: Path, name: str, start: str, said: str
) -> None:
    path = tmp_path / name
    path.write_text(start + "0 0 0 1\n" * 1_600_000, encoding="utf-8")
    tracemalloc.start()
    with pytest.raises(errors.InputError, match=said):
        read_surface(path, 1.0) if name.endswith("off") else read_spheres(path)
    # the file has 13 MB, its lines as Python's texts ten times as many; it is looked through by the megabyte
    assert tracemalloc.get_traced_memory()[1] < 8e6
    tracemalloc.stop()


def test_a_frame_of_too_many_spheres_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("experiments.grains.spheres.sphere_file.MOST", 3)
    table = np.ones((4, 4))
    for number in (3, 4):
        np.save(tmp_path / "heap.npy", table[:number])
        atoms = "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n{}\nITEM: ATOMS x y z radius\n{}"
        (tmp_path / "heap.dump").write_text(atoms.format(number, "1 1 1 1\n" * number), encoding="utf-8")
        for name in ("heap.npy", "heap.dump"):
            if number == 3:
                assert len(read_spheres(tmp_path / name).spheres) == 3
                continue
            with pytest.raises(errors.InputError, match=r"at most 3 spheres, got more\. Write"):
                read_spheres(tmp_path / name)


def test_a_small_file_of_spheres_that_unpacks_to_much_is_refused_before(tmp_path: Path) -> None:
    """The archive and the gzipped table unpack to 600 MB; VTK makes room for as many values as are named."""
    with (
        zipfile.ZipFile(tmp_path / "heap.npz", "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open("xyz.npy", "w") as member,
        gzip.open(tmp_path / "heap.csv.gz", "w", compresslevel=1) as table,
    ):
        np.lib.format.write_array_header_1_0(
            member, {"descr": "<f8", "fortran_order": False, "shape": (18_750_000, 4)}
        )
        table.write(b"x,y,z,r\n")
        for _ in range(60):
            member.write(bytes(10_000_000))
            table.write(b"0,0,1,1\n" * 1_250_000)
    (tmp_path / "many.vtp").write_text(
        '<VTKFile type="PolyData"><PolyData><Piece NumberOfPoints="200000000">', encoding="utf-8"
    )
    (tmp_path / "long.vtk").write_text("# vtk DataFile Version 3.0\nx\nASCII\nPOINTS 3000000000 float\n")
    (tmp_path / "all.pvtu").write_text(
        '<VTKFile type="PUnstructuredGrid"><Piece Source="many.vtp"/></VTKFile>', encoding="utf-8"
    )
    tracemalloc.start()
    for name, said in (
        ("heap.npz", "unpacks to 600,000,1.. bytes, more than 500,000,000"),
        ("heap.csv.gz", "at most 500,000,000 bytes when decompressed"),
        ("many.vtp", "at most 1,500,000 spheres, got 200,000,000"),
        ("long.vtk", "at most 1,500,000 spheres, got 3,000,000,000"),
        ("all.pvtu", "many.vtp: must have at most 1,500,000 spheres"),
    ):
        with pytest.raises(errors.InputError, match=said):
            read_spheres(tmp_path / name)
    # blocks of a megabyte, and what is imported; the unpacked tables have 600
    assert tracemalloc.get_traced_memory()[1] < 60e6
    tracemalloc.stop()


def test_a_small_bank_that_claims_much_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "bank.npz"
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open("values.npy", "w") as member,
    ):
        for _ in range(60):
            member.write(bytes(10_000_000))
    with pytest.raises(DesignError, match="at most 500,000,000"):
        load_bank(path)


def test_a_small_sheet_of_excel_that_claims_much_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "runs.xlsx"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr("xl/sharedStrings.xml", bytes(101_000_000))
    with pytest.raises(errors.InputError, match="at most 100,000,000 bytes, unpacked"):
        list(rows.read_rows(path, [], ["a"]))
    path.write_bytes(b"a,b\n1,2\n")
    with pytest.raises(errors.InputError, match="is not a sheet of Excel"):
        list(rows.read_rows(path, [], ["a"]))


def test_a_small_picture_that_claims_much_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "black.png"
    cv2.imwrite(str(path), np.zeros((11_000, 11_000), np.uint8))
    assert path.stat().st_size < 200_000
    with pytest.raises(PictureError, match="at most 120 million pixels"):
        read_picture(path)


def test_a_chunk_of_a_picture_that_claims_much_is_not_decoded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "grey.png"
    cv2.imwrite(str(path), np.full((60, 80, 3), 128, np.uint8))
    whole = path.read_bytes()
    path.write_bytes(whole + b"anything after the end is ignored")
    assert read_picture(path).shape == (60, 80, 3)
    at = whole.index(b"IDAT") - 4
    path.write_bytes(whole[:at] + (2**31 - 1).to_bytes(4) + whole[at + 4 :])
    # OpenCV would take two gigabytes for it, and then refuse it
    monkeypatch.setattr(cv2, "imdecode", lambda *_: pytest.fail("it was decoded"))
    with pytest.raises(PictureError, match="damaged or cut off"):
        read_picture(path)


def test_a_mesh_names_no_other_file(tmp_path: Path) -> None:
    path = tmp_path / "a.gltf"
    path.write_bytes(b"anything")
    with pytest.raises(ValueError, match="must end in stl, obj, ply, off"):
        read_mesh(path)


def test_toml_that_is_no_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    for content in (b"a = \x00", "a = 1\u2028= 2\x0b".encode()):
        path.write_bytes(content)
        with pytest.raises(errors.InputError):
            toml_files.read_toml(path)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('sphere = "2 mm"', f'clump = "{"a" * 5000}.txt"'),
        ("n = 5", f"n = {2**63}"),
        ('mean = "30 deg"\nsd = "0.5 deg"\nn = 5', f'pictures = "{"a" * 5000}"'),
    ],
)
def test_names_and_integers_beyond_the_machine_are_refused(
    write_study: WriteStudy, old: str, new: str
) -> None:
    path = write_study((old, new))
    with pytest.raises(errors.InputError):
        with_measurements(load_study(path))


@pytest.mark.parametrize("sizes", ["size_sd = 1e308", "size_mean = 1e-200\nsize_sd = 0.0"])
def test_sizes_whose_cubes_are_no_numbers_are_refused(write_study: WriteStudy, sizes: str) -> None:
    path = write_study(('sphere = "2 mm"', f'sphere = "2 mm"\nsize_mean_of = "masses"\n{sizes}'))
    with pytest.raises(errors.StudyError, match=r"size_(sd|mean): .*(less|greater) than or equal to"):
        load_study(path)
