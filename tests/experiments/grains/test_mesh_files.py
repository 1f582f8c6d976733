"""Meshes as programs write them: welded by position, and refused by what is wrong with their surface."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import trimesh

from experiments.grains.clumps.mesh_file import read_surface
from experiments.io.errors import InputError

BALL = trimesh.creation.icosphere(subdivisions=2, radius=2.5)
CORNERS, FACES = np.asarray(BALL.vertices), np.asarray(BALL.faces)


def obj(path: Path, corners: np.ndarray, faces: np.ndarray, marks: Sequence[int] = ()) -> Path:
    """Write an OBJ whose corners may have marks (texture), which split them in readers."""
    text = "".join("v {!r} {!r} {!r}\n".format(*corner) for corner in corners.tolist())
    text += "".join(f"vt {n / 10} 0\n" for n in range(10)) if marks else ""
    for number, face in enumerate(faces):
        ends = [f"/{(number + mark) % 10 + 1}" for mark in marks] or [""] * 3
        text += "f " + " ".join(f"{corner + 1}{end}" for corner, end in zip(face, ends, strict=True)) + "\n"
    path.write_text(text, "utf-8")
    return path


def test_corners_at_one_place_are_one_and_doubled_and_empty_triangles_are_none(tmp_path: Path) -> None:
    apart = CORNERS[FACES].reshape(-1, 3)
    apart = apart * (1.0 + 2e-8 * np.random.default_rng(0).standard_normal((len(apart), 1)))
    doubled = np.vstack([FACES, FACES[:40], FACES[5:6, ::-1], FACES[3:4, [0, 0, 1]]])
    for path in (
        obj(tmp_path / "apart.obj", apart, np.arange(len(apart)).reshape(-1, 3)),
        obj(tmp_path / "doubled.obj", CORNERS, doubled),
        obj(tmp_path / "marked.obj", CORNERS, FACES, (0, 3, 5)),
    ):
        read = read_surface(path, 1e-3)
        assert read.is_watertight
        # single precision of the welded corners, and ten digits of the copy that is read
        assert read.volume == pytest.approx(1e-9 * BALL.volume, rel=1e-6)


def test_an_open_surface_says_how_many_edges_where_and_how_long(tmp_path: Path) -> None:
    path = obj(tmp_path / "open.obj", CORNERS, FACES[1:])
    missing = CORNERS[FACES[0]]
    length = np.linalg.norm(missing - np.roll(missing, 1, axis=0), axis=1).sum()
    x, y, z = missing.mean(axis=0)
    with pytest.raises(InputError, match="Close the hole") as refusal:
        read_surface(path, 1e-3)
    said = f"is open, got 3 open edges around ({x:.4g}, {y:.4g}, {z:.4g}), {length:.4g} long in all"
    assert said in str(refusal.value)
    whole = CORNERS[FACES].mean(axis=1)[:, 2]
    ends = FACES[
        [whole.argmin(), whole.argmax()]
    ]  # two holes, far from one another: the place is one of them
    path = obj(tmp_path / "holes.obj", CORNERS, np.delete(FACES, [whole.argmin(), whole.argmax()], axis=0))
    with pytest.raises(InputError, match="6 open edges at 2 places, most of them around") as refusal:
        read_surface(path, 1e-3)
    assert any(
        "({:.4g}, {:.4g}, {:.4g})".format(*CORNERS[face].mean(axis=0)) in str(refusal.value) for face in ends
    )


@pytest.mark.parametrize("unit", [1e-3, 1.0])
def test_a_surface_that_crosses_itself_is_refused_and_thin_and_hollow_ones_are_not(
    tmp_path: Path, unit: float
) -> None:
    top, one = CORNERS[:, 2:] > 1.8, CORNERS[:, 2:] == CORNERS[:, 2].max()  # pushed through the bottom
    for pushed in (top, one):
        with pytest.raises(InputError, match="crosses itself"):
            read_surface(obj(tmp_path / "crossing.obj", CORNERS - [0.0, 0.0, 6.0] * pushed, FACES), unit)
    with pytest.raises(InputError, match="too flat to be filled with spheres"):
        read_surface(obj(tmp_path / "flat.obj", CORNERS * [1.0, 1.0, 1e-4], FACES), unit)
    dented = CORNERS * [1.0, 1.0, 1.0] - [0.0, 0.0, 3.0] * (CORNERS[:, 2:] > 1.8)
    for name, corners in (("dented.obj", dented), ("thin.obj", CORNERS * [1.0, 1.0, 0.02])):
        assert read_surface(obj(tmp_path / name, corners, FACES), unit).volume > 0.0


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "a cloud of points, not a surface, got 3 points"),
        ("a.stl", "hello\n", "has no triangles"),
        ("a.off", "OFF\n3 1 0\nnan 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "not a finite number"),
        ("a.step", "ISO-10303-21;\n", "Export the shape as STL"),
    ],
)
def test_a_file_without_a_surface_is_called_what_it_is(
    tmp_path: Path, name: str, content: str, said: str
) -> None:
    (tmp_path / name).write_text(content, "utf-8")
    with pytest.raises(InputError, match=said):
        read_surface(tmp_path / name, 1e-3)


def test_inner_walls_are_named(tmp_path: Path) -> None:
    """Two boxes with a common wall, which is doubled."""
    box = trimesh.creation.box([1.0, 1.0, 1.0])
    corners = np.vstack([box.vertices, np.add(box.vertices, [1.0, 0.0, 0.0])])
    path = obj(tmp_path / "wall.obj", corners, np.vstack([box.faces, box.faces + len(box.vertices)]))
    with pytest.raises(InputError, match="inner walls, got 4 edges of three triangles"):
        read_surface(path, 1e-3)
