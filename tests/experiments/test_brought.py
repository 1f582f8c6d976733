"""Files as people bring them, each with its answer: the right number, or a message with the fault.

Those with a source are made after a public report of somebody's trouble, in our own words and numbers.
"""

import io
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from commandline import dem_warp
from PIL import Image

from imaging import heap_angle

SLOPE = 25.0
"""Angle of the cone of spheres and of that on the picture [degrees]."""
STUDY = (Path(__file__).parent / "small.toml").read_text(encoding="utf-8")

BOX = np.array([[x, y, z] for x in (0, 6) for y in (0, 4) for z in (0, 3)], dtype=float)
SIDES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
     [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)  # fmt: skip
"""A box of 6 x 4 x 3 mm, of triangles that look outward."""
TRIANGLES = BOX[SIDES]


FAR = "angle --distance 100"
"""The pictures are drawn from far away; one whose camera may be near is doubted."""


@dataclass(frozen=True)
class Brought:
    """A command on a file, and its answer."""

    name: str
    """Name of the file."""
    content: Callable[[], str | bytes]
    words: tuple[str, ...] = ()
    """Words of the message; none: it is measured, or made into a clump."""
    command: str = "angle"
    source: str = ""
    """The public report of such a file."""


@cache
def cone() -> tuple[np.ndarray, np.ndarray]:
    """Place the spheres of a cone on z = 0: centres and radii [m]."""
    radius, width = 2e-3, 0.06
    steps = np.arange(-width, width, 1.8 * radius)
    heights = np.arange(radius, width * np.tan(np.radians(SLOPE)), 1.8 * radius)
    places = np.stack(np.meshgrid(steps, steps, heights), axis=-1).reshape(-1, 3)
    rim = width - np.hypot(places[:, 0], places[:, 1])
    inside = places[places[:, 2] < rim * np.tan(np.radians(SLOPE))]
    return inside + np.random.default_rng(2).normal(0.0, 1e-4, inside.shape), np.full(len(inside), radius)


def dump(columns: str, rows: np.ndarray, bounds: np.ndarray, kind: str = "ff ff ff", head: str = "") -> str:
    """Write a dump of LAMMPS with these columns."""
    box = "".join(" ".join(f"{value:.9g}" for value in line) + "\n" for line in bounds)
    body = "".join(" ".join(f"{value:.9g}" for value in row) + "\n" for row in rows)
    count = f"ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n{len(rows)}\n"
    return f"{head}{count}ITEM: BOX BOUNDS {kind}\n{box}ITEM: ATOMS {columns}\n{body}"


@cache
def slope_of_cone() -> float:
    """Measure the angle of the cone of spheres [degrees]."""
    return heap_angle(*cone()).mean


BOUNDS = np.array([[-0.15, 0.25], [-0.12, 0.2], [-0.01, 0.11]])


def dumped(columns: str, scaled: bool = False, factor: float = 1.0, head: str = "") -> str:
    """Write the cone as a dump; columns are x, y, z and radius in some order and convention."""
    centers, radii = cone()
    low, high = BOUNDS.T
    places = (centers - low) / (high - low) if scaled else factor * centers
    values = {"x": places[:, 0], "y": places[:, 1], "z": places[:, 2], "radius": factor * radii}
    names = [name if name == "radius" else name[0] for name in columns.split()]
    return dump(columns, np.column_stack([values[name] for name in names]), factor * BOUNDS, head=head)


def table(head: str, columns: str) -> str:
    """Write the cone as a table: d is a diameter."""
    centers, radii = cone()
    values = dict(zip("xyz", centers.T, strict=True)) | {"r": radii, "d": 2.0 * radii}
    rows = np.column_stack([values[name] for name in columns])
    return head + "\n" + "\n".join(",".join(f"{value:.6g}" for value in row) for row in rows) + "\n"


def in_rows() -> str:
    centers, radii = cone()
    lines = zip(("X", "Y", "Z", "Radius"), (*centers.T, radii), strict=True)
    rows = [f'"{name} (m)",' + ",".join(f"{value:.6g}" for value in line) for name, line in lines]
    return "EXTRACTED DATA\n\nTIME:,1.5\n\n" + "\n".join(rows) + "\n"


def stl(triangles: np.ndarray) -> str:
    """Write a mesh as STL in text."""
    facets = (
        "facet normal 0 0 0\nouter loop\n"
        + "".join("vertex {:.9g} {:.9g} {:.9g}\n".format(*corner) for corner in triangle)
        + "endloop\nendfacet\n"
        for triangle in triangles
    )
    return "solid grain\n" + "".join(facets) + "endsolid grain\n"


def with_triangle(*corners: np.ndarray) -> Callable[[], str]:
    return lambda: stl(np.concatenate([TRIANGLES, [corners]]))


def turned_over() -> str:
    mixed = TRIANGLES.copy()
    mixed[[3, 7]] = mixed[[3, 7], ::-1]
    return stl(mixed)


def binary_stl() -> bytes:
    """Binary STL whose head begins like that of a text."""
    faces = b"".join(struct.pack("<3f", 0, 0, 0) + t.astype("<f4").tobytes() + b"\0\0" for t in TRIANGLES)
    return b"solid by a CAD program".ljust(80) + struct.pack("<I", len(TRIANGLES)) + faces


def quads() -> str:
    corners = "".join("v {:g} {:g} {:g}\n".format(*corner) for corner in BOX)
    sides = ("1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4")
    return corners + "".join(f"f {side}\n" for side in sides)


def points() -> str:
    head = f"ply\nformat ascii 1.0\nelement vertex {len(BOX)}\n"
    names = "".join(f"property float {name}\n" for name in "xyz")
    return f"{head}{names}end_header\n" + "".join("{:g} {:g} {:g}\n".format(*corner) for corner in BOX)


@cache
def photographed() -> Image.Image:
    """Draw a brown cone in front of a light wall, with the noise of a camera."""
    picture = np.full((400, 600, 3), 235, dtype=np.uint8)
    tip = 300 - round(170 * np.tan(np.radians(SLOPE)))
    cv2.fillPoly(picture, [np.array([[130, 300], [300, tip], [470, 300]])], (90, 60, 40))
    picture[300:] = 120
    noise = np.random.default_rng(5).normal(0.0, 4.0, picture.shape)
    return Image.fromarray(np.clip(picture + noise, 0, 255).astype(np.uint8))


def saved(kind: str, mode: str = "RGB", turned: bool = False) -> Callable[[], bytes]:
    """Save the photograph in a format; turned: as a phone held upright does, with its orientation in EXIF."""

    def write() -> bytes:
        picture, exif, file = photographed().convert(mode), Image.Exif(), io.BytesIO()
        if turned:
            exif[0x0112] = 6
            picture = picture.transpose(Image.Transpose.ROTATE_90)
        picture.save(file, kind, exif=exif)
        return file.getvalue()

    return write


def study(old: str, new: str) -> Callable[[], str]:
    return lambda: STUDY.replace(old, new, 1)


HEAP = "heap --device cpu --dry-run"
CLUMP = "clump --spheres 2"
DENSITY = next(line for line in STUDY.splitlines() if line.startswith("density"))

CASES: Mapping[str, Brought] = {
    # heaps of other codes
    "scaled positions, and a box away from 0": Brought(
        "a.dump", lambda: dumped("xs ys zs radius", scaled=True), source="MDAnalysis/mdanalysis#4788"
    ),
    "a tilted box": Brought(
        "a.dump",
        lambda: dump("xs ys zs radius", np.ones((9, 4)), np.ones((3, 3)), "xy xz yz pp pp ff"),
        ("tilted box", "Dump x y z"),
        source="MDAnalysis/mdanalysis#3383",
    ),
    "unwrapped positions": Brought(
        "a.dump", lambda: dumped("xu yu zu radius"), source="MDAnalysis/mdanalysis#3358"
    ),
    "scaled and unwrapped positions": Brought(
        "a.dump", lambda: dumped("xsu ysu zsu radius", scaled=True), source="deepmodeling/dpdata#177"
    ),
    "columns in another order": Brought(
        "a.dump", lambda: dumped("radius z y x"), source="MDAnalysis/mdanalysis#3360"
    ),
    "lengths in centimetres": Brought(
        "a.dump",
        lambda: dumped("x y z radius", factor=100.0, head="ITEM: UNITS\ncgs\n"),
        source="lammps.org, dump_modify units",
    ),
    "a spreadsheet of ParaView with diameters": Brought(
        "a.csv",
        lambda: table('"Diameter","Points:0","Points:1","Points:2"', "dxyz"),
        source="chaos-polymtl/lethe#1191",
    ),
    "results of EDEM in rows": Brought(
        "a.csv", in_rows, ("is text", "columns x, y, z"), source="help.altair.com, Exporting Data"
    ),
    "a VTK file without points": Brought(
        "a.vtk",
        lambda: "# vtk DataFile Version 3.0\nempty\nASCII\nDATASET POLYDATA\nPOINTS 0 float\n",
        ("has no points",),
        source="SudoDEM/SudoDEM#11",
    ),
    "a position that is not a number": Brought(
        "a.dump",
        lambda: dump("x y z radius", np.array([[0.0, 0.0, np.nan, 2e-3]]), BOUNDS),
        ("a.dump, line 10", "four finite numbers"),
    ),
    "points of a scanner": Brought(
        "a.pcd",
        lambda: f"# .PCD v0.7\nVERSION 0.7\nFIELDS x y z radius\nPOINTS 9\nDATA ascii\n{'0 0 1 1' * 9}",
        ("is a PCD file", "table of x, y, z, radius"),
    ),
    "no sphere": Brought("a.dump", lambda: dump("x y z radius", np.empty((0, 4)), BOUNDS), ("no spheres",)),
    # meshes
    "triangles that look inward": Brought("a.stl", turned_over, command=CLUMP, source="wolph/numpy-stl#186"),
    "corners that differ by rounding": Brought(
        "a.stl",
        lambda: stl(TRIANGLES + np.random.default_rng(1).normal(0.0, 2e-7, TRIANGLES.shape)),
        command=CLUMP,
        source="ChHarding/TouchTerrain_for_CAGEO#86",
    ),
    "a triangle on a line": Brought(
        "a.stl",
        with_triangle(BOX[0], BOX[1], (BOX[0] + BOX[1]) / 2.0),
        command=CLUMP,
        source="mikedh/trimesh#18",
    ),
    "a doubled triangle": Brought(
        "a.stl", with_triangle(*TRIANGLES[0]), command=CLUMP, source="earthtojake/text-to-cad#371"
    ),
    "a hole": Brought(
        "a.stl",
        lambda: stl(TRIANGLES[1:]),
        ("is open", "3 open edges", "Close the hole"),
        CLUMP,
        "MeshInspector/MeshInspector#133",
    ),
    "a fin on an edge": Brought(
        "a.stl",
        with_triangle(BOX[0], BOX[1], np.array([-2.0, -2.0, 1.0])),
        ("inner walls", "Remove them"),
        CLUMP,
        "mikedh/trimesh#122",
    ),
    "decimal commas": Brought(
        "a.stl", lambda: stl(TRIANGLES + 0.5).replace(".5", ",5"), ("decimal comma",), CLUMP
    ),
    "inside out": Brought("a.stl", lambda: stl(TRIANGLES[:, ::-1]), command=CLUMP),
    "two boxes through one another": Brought(
        "a.stl",
        lambda: stl(np.concatenate([TRIANGLES, 0.5 * TRIANGLES + [5.0, 1.0, 1.0]])),
        ("one closed body", "2 bodies"),
        CLUMP,
    ),
    "metres": Brought("a.stl", lambda: stl(TRIANGLES / 1000.0), ("--unit", "0.006 mm"), CLUMP),
    "a cloud of points": Brought(
        "a.ply", points, ("a cloud of points",), CLUMP, "EPhysLab-UVigo/VisualSPHysics#1"
    ),
    "a drawing of a CAD program": Brought(
        "a.step", lambda: "ISO-10303-21;\nEND-ISO-10303-21;\n", ("stl", "Export the shape as STL"), CLUMP
    ),
    "quadrangles": Brought("a.obj", quads, command=CLUMP),
    "a binary STL that begins with solid": Brought("a.stl", binary_stl, command=CLUMP),
    # pictures
    "a GIF called PNG": Brought("a.png", saved("GIF"), command=FAR, source="opencv/opencv#21835"),
    "a turned PNG": Brought("a.png", saved("PNG", turned=True), command=FAR, source="opencv/opencv#16579"),
    "a turned TIFF": Brought("a.tif", saved("TIFF", turned=True), command=FAR, source="opencv/opencv#10703"),
    "a turned JPEG": Brought("a.jpg", saved("JPEG", turned=True), command=FAR, source="opencv/opencv#8172"),
    "a JPEG for printing": Brought("a.jpg", saved("JPEG", "CMYK"), command=FAR),
    "a PNG with transparency": Brought("a.png", saved("PNG", "RGBA"), command=FAR),
    "a grey TIFF": Brought("a.tif", saved("TIFF", "L"), command=FAR),
    "a WebP": Brought("a.webp", saved("WEBP"), command=FAR),
    "a web page called JPEG": Brought("a.jpg", lambda: "<html>404 Not Found</html>", ("is a web page",)),
    "half a JPEG": Brought("a.jpg", lambda: saved("JPEG")()[:5000], ("damaged or cut off",)),
    "an empty picture": Brought("a.jpg", lambda: "", ("is empty",)),
    "a data file of LAMMPS": Brought(
        "a.data", lambda: "LAMMPS data file via write_data\n\n3 atoms\n", ("data file",)
    ),
    "a MAT-file": Brought(
        "a.mat", lambda: b"MATLAB 5.0 MAT-file, Platform: GLNXA64" + bytes(99), ("not a picture",)
    ),
    "a video": Brought("a.mp4", lambda: b"\0\0\0\x18ftypmp42" + bytes(999), ("is a video", "Save one frame")),
    "a PDF": Brought("a.pdf", lambda: b"%PDF-1.5\n\xff\xfe" + bytes(999), ("is a PDF", "Save its picture")),
    # studies
    "thousands with a comma": Brought(
        "a.toml", study(DENSITY, 'density = "1,250 kg/m^3"'), ('"1.250 kg/m^3" or "1250 kg/m^3"',), HEAP
    ),
    "the density of air": Brought(
        "a.toml", study(DENSITY, 'density = "1.25 kg/m^3"'), ("grain.density", "unlikely"), HEAP
    ),
    "a modulus scale of a trillion": Brought(
        "a.toml", study("modulus_scale = 400.0", "modulus_scale = 1e12"), ("numerics.modulus_scale",), HEAP
    ),
    "a size in inches": Brought(
        "a.toml", study('diameter = "28 mm"', 'diameter = "1.1 in"'), ("needs a unit of length",), HEAP
    ),
}


@pytest.mark.usefixtures("_coarse_clumps")
@pytest.mark.parametrize("name", CASES)
def test_what_people_bring_is_answered(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    case = CASES[name]
    monkeypatch.chdir(tmp_path)
    content = case.content()
    Path(case.name).write_bytes(content if isinstance(content, bytes) else content.encode())
    command, *options = case.command.split()
    code, out, said = dem_warp(command, case.name, *options)
    assert "Traceback" not in said
    if case.words:
        assert all(word in out + said for word in case.words), said
        assert code == (0 if "unlikely" in case.words else 2)
    else:
        assert code == 0, said
        if command == "angle":
            mean = float(out.rpartition("mean ")[2].split()[0])
            if case.name.endswith((".dump", ".csv")):
                # the angle is printed with two decimals, of positions with six digits or more
                assert mean == pytest.approx(slope_of_cone(), abs=0.02)
                assert "spheres of 2 mm radius" in said
            else:
                # a pixel of the tip is 0.3 degrees, and the camera's noise blurs two
                assert mean == pytest.approx(SLOPE, abs=0.5)
        else:
            # the box has 72 mm3; two spheres in it have less, and at least a third
            volume = float(out.partition("volume ")[2].split()[0])
            assert 24.0 < volume < 72.0
