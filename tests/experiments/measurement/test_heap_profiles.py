"""Outlines of heaps as profiles: alike from points, pictures, spheres and states; bad ones refused."""

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from drawn_heaps import Camera, DrawnHeap, draw
from small_study import ANGLE

from dem_warp import CaseResult
from experiments.io.errors import InputError
from experiments.measurement.case_observables import measure, observe
from experiments.measurement.measured_file import read_measured
from experiments.measurement.profile_files import read_heap_profiles
from experiments.measurement.profile_responses import with_profiles
from experiments.measurement.value_limits import ValueLimits
from experiments.studyfile import load_study, observables, study
from imaging import save_picture, silhouette
from imaging.flank.heap_shape import SPACING, STATIONS, profile_heights

SIZE = ValueLimits(grain=1e-4, length=0.14, time=np.inf, density=1e3)
SETTINGS = study.MeasurementSection(azimuths=4, pixels=400, outline=True)
NAMES = [each.name for each in observables.OUTLINE]
TARGET = '[target]\nobservable = "outline"\nprofiles = "p.csv"\n'
Cone = Callable[..., CaseResult]


def file(folder: Path, text: str, head: str = "replicate,x,z") -> Path:
    path = folder / "p.csv"
    path.write_text(f"{head}\n{text}", encoding="utf-8")
    return path


def test_a_triangle_has_the_heights_of_its_formula() -> None:
    """Slope 1/2, 40 wide, 10 high, area 200: the mean of a straight flank is its height at the station."""
    x = np.linspace(100.0, 140.0, 4001)
    z = 10.0 - 0.5 * np.abs(x - 120.0)
    root = np.sqrt(200.0)
    expected = 10.0 - 0.5 * np.array(STATIONS) * root
    expected[0] = 10.0 - 0.5 * 0.25 * SPACING * root  # the apex stands in the middle of its width
    inside = np.array(STATIONS) + SPACING / 2 < 20.0 / root
    assert profile_heights(x, z)[inside] == pytest.approx(expected[inside], rel=1e-6)
    assert len(STATIONS) == observables.OUTLINE_STATIONS == len(observables.OUTLINE)


def test_the_profile_does_not_depend_on_the_place_and_on_single_grains() -> None:
    x = np.linspace(-20.0, 20.0, 801)
    z = 10.0 - 0.5 * np.abs(x)
    moved = profile_heights(x + 7.0, z)
    assert moved == pytest.approx(profile_heights(x, z))
    far, grain = np.linspace(30.0, 31.0, 21), np.full(21, 0.5)
    tailed = profile_heights(np.append(x, far), np.append(z, grain))
    # Half an area of one in 200 moves the middle by 0.4 of a step, and two flanks are averaged.
    assert tailed[:6] == pytest.approx(moved[:6], abs=0.1)


def test_states_spheres_pictures_and_points_give_one_profile(cone: Cone, tmp_path: Path) -> None:
    heap = cone(radius=1e-3)
    own = np.array([observe(SETTINGS, heap).observables[name] for name in NAMES])
    values, reason = measure(SETTINGS, heap, NAMES)
    assert (reason, values.tolist()) == ("", own.tolist())
    assert "outline_1" not in observe(study.MeasurementSection(azimuths=4, pixels=400), heap).observables
    spheres = np.column_stack([heap.sphere_centers, heap.sphere_radii])
    np.savetxt(tmp_path / "heap.csv", spheres, delimiter=",", header="x,y,z,radius", comments="")
    drawn = silhouette(heap.sphere_centers, heap.sphere_radii, 0.0)
    cv2.imwrite(str(tmp_path / "heap.png"), drawn.image)
    x = np.linspace(-0.022, 0.022, 400)
    points = "".join(
        f"2,,{1e3 * a:.4f} mm,{1e3 * b:.4f} mm,,\n"
        for a, b in zip(
            x, np.maximum(0.5 * (0.02 - np.abs(x)) + 0.5e-3, 0.0) * (np.abs(x) < 0.021), strict=True
        )
    )
    text = f"1,,,,heap.csv,\n{points}3,a,,,heap.png,{1e3 * drawn.meters_per_pixel} mm\n"
    found = read_heap_profiles(file(tmp_path, text, "replicate,view,x,z,picture,pixel"), "flank", SIZE)
    assert [len(views) for views in found.views] == [8, 1, 1]
    # The points draw a smooth cone over the spheres, whose radius is 1 mm.
    for heights in found.heights:
        assert heights == pytest.approx(own, abs=1e-3)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1,0 mm,0 mm\n1,1 mm,1 mm\n", r"p.csv:2: .*needs 8 points or more, got 2"),
        ("".join(f"1,{n} mm,{n} mm\n" for n in range(9)), r"p.csv:2: both ends of .*got 0 and 8 "),
        ("", r"p.csv: has no rows below the names of the columns"),
        ("1,0 mm,-1 mm\n", r"p.csv:2: z: must be 0 or more"),
        ("1,0,1\n", r"p.csv:2: x: needs a unit of length"),
        ("1,0 mm,1 mm\n1,0 mm,2 mm\n", r"p.csv:3: x: appears twice"),
        ("".join(f"1,{n} mm,0 mm\n" for n in range(9)), r"p.csv:2: .*has no area"),
        ("1,none.png,1 mm\n", r"p.csv:2: picture: no such file"),
        ("1,plain.png,\n", r"p.csv:2: pixel: outlines in a picture need the size of its pixels"),
        ("1,plain.png,0 mm\n", r"p.csv:2: pixel: must be positive"),
        ("1,plain.png,1 kg\n", r"p.csv:2: pixel: needs a unit of length"),
        ("1,plain.png,1 mm\n", r"p.csv:2: picture: has no measurable heap: .*contrast"),
        ("1,top.png,1 mm\n", r"p.csv:2: picture: has no measurable heap"),
    ],
)
def test_what_shows_no_side_of_a_heap_is_refused_with_its_row(
    tmp_path: Path, text: str, message: str
) -> None:
    cv2.imwrite(str(tmp_path / "plain.png"), np.full((200, 300), 200, np.uint8))
    top = np.full((400, 600, 3), 220, np.uint8)
    cv2.circle(top, (300, 200), 120, (60, 90, 120), -1)
    cv2.imwrite(str(tmp_path / "top.png"), top)
    head = "replicate,picture,pixel" if "png" in text else "replicate,x,z"
    with pytest.raises(InputError, match=message):
        read_heap_profiles(file(tmp_path, text, head), "flank", SIZE)


def test_a_heap_that_the_test_cannot_give_is_refused_with_file_and_pixel(tmp_path: Path) -> None:
    """The heap is drawn 400 pixels wide: with pixels of 0.1 mm it is some 10 mm high."""
    save_picture(tmp_path / "heap.png", draw(DrawnHeap(28.0, 28.0, 200), Camera(noise=0)))
    for pixel in ("3 m", "0.1 um"):
        row = file(tmp_path, f"1,heap.png,{pixel}\n", "replicate,picture,pixel")
        with pytest.raises(
            InputError,
            match=rf"p.csv:2: pixel: .*0.1 to 140 mm .* mm in .*heap.png, with a pixel of {pixel}",
        ):
            read_heap_profiles(row, "flank", SIZE)
    points = "".join(f"1,{x} m,{5 - abs(x)} m\n" for x in range(-5, 6))
    with pytest.raises(InputError, match=r"p.csv:2: z: .*got 5000 mm\. Check the unit"):
        read_heap_profiles(file(tmp_path, points), "flank", SIZE)
    spheres = [[x, y, z, 0.5] for z in range(4) for x in range(z - 8, 9 - z) for y in range(z - 8, 9 - z)]
    np.savetxt(tmp_path / "heap.csv", spheres, delimiter=",", header="x,y,z,radius", comments="")
    with pytest.raises(InputError, match=r"p.csv:2: picture: .* mm in .*heap.csv\. Check its unit"):
        read_heap_profiles(file(tmp_path, "1,heap.csv\n", "replicate,picture"), "flank", SIZE)
    for row, heads in (("heap.csv,1 mm", "picture,pixel"), ("heap.png,1", "picture,type")):
        unused = heads.partition(",")[2]
        with pytest.raises(InputError, match=rf"p.csv:2: {unused}: is for .*, unlike .*{row[:8]}"):
            read_heap_profiles(file(tmp_path, f"1,{row}\n", f"replicate,{heads}"), "flank", SIZE)


def test_outlines_of_a_study_are_as_high_as_its_test_can_give(
    write_study: Callable[..., Path], tmp_path: Path
) -> None:
    save_picture(tmp_path / "heap.png", draw(DrawnHeap(28.0, 28.0, 200), Camera(noise=0)))
    file(tmp_path, "1,heap.png,3 m\n", "replicate,picture,pixel")
    with pytest.raises(InputError, match=r"p.csv:2: pixel: .*must be 1.7 to 168 mm high in this test"):
        with_profiles(load_study(write_study((ANGLE, TARGET))))
    table = tmp_path / "m.csv"
    table.write_text(
        "condition,replicate,observable,value,profile\nbase,1,angle,25,\nbase,1,outline,,p.csv\n", "utf-8"
    )
    asked = load_study(write_study(("pixels = 200", "pixels = 200\noutline = true")))
    with pytest.raises(InputError, match=r"p.csv:2: pixel: .*must be 1.7 to 168 mm high in this test"):
        read_measured(table, asked)


def test_copies_of_an_outline_are_refused_with_both_places(
    write_study: Callable[..., Path], tmp_path: Path
) -> None:
    save_picture(tmp_path / "heap.png", draw(DrawnHeap(28.0, 28.0, 200), Camera(noise=0)))
    (tmp_path / "copy.png").write_bytes((tmp_path / "heap.png").read_bytes())
    rows = file(tmp_path, "1,a,heap.png,0.1 mm\n1,b,copy.png,0.1 mm\n", "replicate,view,picture,pixel")
    with pytest.raises(
        InputError, match=r"p.csv:3: picture: copy.png is a copy of heap.png \(.*p.csv:2: picture\)"
    ):
        read_heap_profiles(rows, "flank", SIZE)
    points = [f"{x} mm,{9 - abs(x)} mm\n" for x in range(-9, 10)]
    text = "".join(f"1,{point}" for point in points) + "".join(f"2,{point}" for point in points[::-1])
    with pytest.raises(InputError, match=r"p.csv:21: replicate 2 is a copy of replicate 1 \(.*p.csv:2\)"):
        read_heap_profiles(file(tmp_path, text), "flank", SIZE)
    # In a measured table each replicate may have a file of its own.
    table = tmp_path / "m.csv"
    table.write_text(
        "condition,replicate,observable,profile\nbase,1,outline,1.csv\nbase,2,outline,2.csv\n", "utf-8"
    )
    for name in "12":
        rows = "".join(f"{name},{point}" for point in points)
        (tmp_path / f"{name}.csv").write_text(f"replicate,x,z\n{rows}", "utf-8")
    asked = load_study(write_study(("pixels = 200", "pixels = 200\noutline = true")))
    with pytest.raises(
        InputError, match=r"m.csv:3: profile: 2.csv is a copy of 1.csv \(.*m.csv:2: profile\)"
    ):
        read_measured(table, asked)


def test_a_doubtful_outline_is_refused_with_the_doubt(tmp_path: Path) -> None:
    save_picture(tmp_path / "lean.png", draw(DrawnHeap(24.0, 33.0, 200), Camera(noise=0)))
    row = file(tmp_path, "1,lean.png,0.1 mm\n", "replicate,picture,pixel")
    with pytest.raises(InputError, match=r"p.csv:2: picture: is doubtful: .*left"):
        read_heap_profiles(row, "flank", SIZE)


def test_a_measured_file_has_outlines_where_the_study_asks(
    write_study: Callable[..., Path], tmp_path: Path
) -> None:
    table = tmp_path / "m.csv"
    table.write_text(
        "condition,replicate,observable,value,unit\nbase,1,outline_3,4.2,mm\nbase,2,outline_8,0,mm\n",
        encoding="utf-8",
    )
    plain = load_study(write_study())
    with pytest.raises(InputError, match=r"must be an observable or 'clogged'"):
        read_measured(table, plain)
    asked = load_study(write_study(("pixels = 200", "pixels = 200\noutline = true")))
    data = read_measured(table, asked)
    assert data.observables == ("outline_3", "outline_8")
    # Beyond its foot a heap has no height, and that is a value.
    assert data.values["base"][:, 1].tolist()[1] == 0.0
