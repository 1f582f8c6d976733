"""Sixty inputs that no command can use: each ends with 2, says rule, value and place, and writes nothing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from commandline import dem_warp

SMALL_STUDY = (Path(__file__).parents[1] / "small.toml").read_text(encoding="utf-8")
LONGEST_MESSAGE = 2500
"""Characters: a message is read, whatever came in."""
CONDITIONS = "\n[condition.base]\n\n[condition.fast]\nscene.lifted-cylinder.lift_speed = '0.2 m/s'\n"
HEAD = "condition,replicate,observable,value,unit\n"
TETRAHEDRA = "".join(
    f"facet normal 0 0 0\nouter loop\n{''.join(f'vertex {x + s} {y} {z}' + chr(10) for x, y, z in face)}"
    "endloop\nendfacet\n"
    for s in (0, 9)
    for face in (
        ((0, 0, 0), (0, 1, 0), (1, 0, 0)),
        ((0, 0, 0), (1, 0, 0), (0, 0, 1)),
        ((0, 0, 0), (0, 0, 1), (0, 1, 0)),
        ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    )
)
TWO_BODIES = f"solid two\n{TETRAHEDRA}endsolid two\n"
ONE_BODY = TWO_BODIES.replace(TETRAHEDRA, TETRAHEDRA[: len(TETRAHEDRA) // 2])

PLY = "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\n"


@dataclass(frozen=True)
class Hostile:
    """A command, the files that it finds, and the words of its message."""

    command: str
    """Arguments between blanks."""
    words: tuple[str, ...]
    """Rule, value and place."""
    files: Mapping[str, str | bytes] = field(default_factory=dict)


def study(command: str, old: str, new: str, *words: str) -> Hostile:
    """A study file with one thing wrong."""
    assert SMALL_STUDY.count(old) == 1, old
    return Hostile(f"{command} s.toml --device cpu --out o", words, {"s.toml": SMALL_STUDY.replace(old, new)})


def measured(text: str | bytes, *words: str) -> Hostile:
    """A file of measured heaps with one thing wrong."""
    files = {"s.toml": SMALL_STUDY + CONDITIONS, "m.csv": text}
    return Hostile("discover s.toml m.csv --device cpu --out o", words, files)


def clump(text: str | bytes, *words: str, options: str = "", name: str = "g.txt") -> Hostile:
    """A file of a grain with one thing wrong."""
    return Hostile(f"clump {name} {options} --out o.txt", words, {name: text})


HOSTILE = {
    # Study files
    "no study": Hostile(
        "heap none.toml --device cpu --out o", ("none.toml", "no such file")
    ),
    "a folder": Hostile("heap . --device cpu --out o", ("regular file", "folder")),
    "empty study": Hostile(
        "heap s.toml --device cpu --out o", ("s.toml", "required", "nothing"), {"s.toml": ""}
    ),
    "no TOML": Hostile(
        "heap s.toml --device cpu", ("s.toml:1", "valid TOML", "hello"), {"s.toml": "hello\n"}
    ),
    "UTF-16": Hostile(
        "heap s.toml --device cpu", ("s.toml", "UTF-8", "UTF-16"), {"s.toml": SMALL_STUDY.encode("utf-16")}
    ),
    "Latin-1": Hostile(
        "heap s.toml --device cpu", ("s.toml, line 1", "UTF-8", "0xfc"), {"s.toml": b"name = 'K\xfcrbis'\n"}
    ),
    "a picture as study": Hostile(
        "heap s.toml --device cpu", ("s.toml", "UTF-8", "binary"), {"s.toml": bytes(range(256)) * 40}
    ),
    "decimal comma": study("heap", '"28 mm"\nheight', '"28,5 mm"\nheight', "s.toml:25", "28.5 mm", "comma"),
    "no unit": study("heap", '"28 mm"\nheight', "28\nheight", "s.toml:25: scene", "unit of length", "28"),
    "wrong unit": study("heap", '"700 kg/m^3"', '"700 lb/ft3"', "density", "kg/m^3", "700 lb/ft3"),
    "negative density": study("heap", '"700 kg/m^3"', '"-700 kg/m3"', "density", "greater than 0", "-700"),
    "true for a count": study("heap", "= 30", "= true", "grain_count", "not true or false", "True"),
    "half a grain": study("heap", "= 30", "= 30.5", "grain_count", "integer", "30.5"),
    "no grain": study("heap", "= 30", "= 0", "grain_count", "or equal to 1", "0"),
    "NaN": study("heap", "restitution = 0.2", "restitution = nan", "restitution", "finite", "nan"),
    "bouncing up": study(
        "heap", "restitution = 0.2", "restitution = 1.2", "restitution", "less than or", "1.2"
    ),
    "misspelt key": study(
        "heap", "poisson_ratio = 0.25", "poison_ratio = 0.25", "unknown key", "poisson_ratio"
    ),
    "narrow tube": study("heap", '"28 mm"\nheight', '"7 mm"\nheight', "scene", "2 grains wide", "7 mm"),
    "no grain's size": study("heap", '"2 mm"', '"0 mm"', "grain.sphere", "greater than 0", "0 mm"),
    "no clump": study("heap", 'sphere = "2 mm"', 'clump = "c.txt"', "grain.clump", "no such clump", "c.txt"),
    "clump and sphere": study("heap", "[grain]", '[grain]\nclump = "s.toml"', "grain", "not both"),
    "two megabytes": study(
        "heap", 'name = "Small"', f'nome = "{"x" * 2_000_000}"', "nome", "unknown key"
    ),
    "half a scene": study(
        "heap", "[numerics]", "[scene.drum]\n[numerics]", "scene.drum.length", "is required"
    ),
    "upside down": study("heap", "low = 0.2", "low = 0.9", "factor", "low", "0.9"),
    "factor of nothing": study("heap", "static_friction\"", "warmth\"", "factor", "warmth"),
    "escape sequences": study("heap", 'name = "Small"', 'nome = "\\u001b[2J"', "nome", "unknown key"),
    # Options
    "unknown scale": Hostile(
        "heap s.toml --scale huge --device cpu", ("scale", "huge"), {"s.toml": SMALL_STUDY}
    ),
    "no such device": Hostile(
        "heap s.toml --device tpu", ("--device", "tpu", "one of"), {"s.toml": SMALL_STUDY}
    ),
    "two CPUs": Hostile(
        "discover s.toml --device cpu,cpu", ("--device", "each device once", "cpu,cpu"),
        {"s.toml": SMALL_STUDY},
    ),
    "a setting without value": Hostile(
        "heap s.toml --device cpu --set E", ("--set", "NAME=VALUE", "E"), {"s.toml": SMALL_STUDY}
    ),
    "a setting of no factor": Hostile(
        "heap s.toml --device cpu --set Q=1", ("--set: Q", "factor", "1"), {"s.toml": SMALL_STUDY}
    ),
    "a setting in words": Hostile(
        "heap s.toml --device cpu --set E=much", ("--set: E", "number", "much"), {"s.toml": SMALL_STUDY}
    ),
    "a used folder": Hostile(
        "heap s.toml --device cpu --out .", (".", "folder is not empty", "--resume"), {"s.toml": SMALL_STUDY}
    ),
    "a file for a folder": Hostile(
        "heap s.toml --device cpu --out s.toml", ("s.toml", "must be a folder", ", got a file"),
        {"s.toml": SMALL_STUDY},
    ),
    "a bank of nothing": Hostile(
        "discover s.toml m.csv --bank b.npz --device cpu --out o",
        ("b.npz", "must be a bank", "an archive without space, observables, theta"),
        {"s.toml": SMALL_STUDY + CONDITIONS, "m.csv": HEAD, "b.npz": b"PK\x05\x06" + bytes(18)},
    ),
    "nothing to resume": Hostile(
        "calibrate s.toml --device cpu --resume --out in", ("in/study.json", "resume", "cannot be read"),
        {"s.toml": SMALL_STUDY, "in/x": "x"},
    ),
    "no such engine": Hostile(
        "calibrate s.toml --device cpu --engine magic --out o", ("engine", "magic"), {"s.toml": SMALL_STUDY}
    ),
    # Measured heaps
    "no measurement": measured(HEAD, "m.csv", "no measured value"),
    "wrong column": measured(HEAD.replace("unit", "units"), "m.csv:1", "known column", "units"),
    "columns missing": measured("a,b\n1,2\n", "m.csv:1", "missing", "a, b"),
    "one unit wrong in every row": measured(
        HEAD + "".join(f"base,{n},flank_angle,30,mm\n" for n in range(1, 40)),
        "m.csv:2: ", "and 36 more", "angle",
    ),
    "measured in UTF-16": measured(
        (HEAD + "base,1,flank_angle,30,deg\n").encode("utf-16"), "m.csv", "UTF-16"
    ),
    "unknown condition": measured(HEAD + "bsae,1,flank_angle,30,deg\n", "m.csv:2", "base", "bsae"),
    "a number in words": measured(HEAD + "base,1,flank_angle,thirty,deg\n", "m.csv:2", "number", "thirty"),
    # Grains
    "no such shape": Hostile("clump cube:2 --spheres 3", ("cube:2", "must be one of")),
    "no such file": Hostile("clump g.stl --spheres 3", ("g.stl: no such file",)),
    "a solid and no number": Hostile("clump sphere:2", ("--spheres", "needs one of the two", "neither")),
    "number and tolerance": Hostile(
        "clump sphere:2 --spheres 2 --tolerance 5%", ("--tolerance", "or", "both")
    ),
    "tolerance of everything": Hostile("clump sphere:2 --tolerance 200%", ("--tolerance", "share", "200%")),
    "dimensions missing": Hostile("clump ellipsoid:2x3 --spheres 3", ("ellipsoid:2x3", "ellipsoid:LENGTHx")),
    "comma for the protrusion": Hostile(
        "clump sphere:2 --spheres 1 --protrusion 0,1mm", ("--protrusion", "comma", "0,1mm")
    ),
    "two bodies": clump(
        TWO_BODIES, "g.stl", "one closed body", "2 bodies", options="--spheres 3", name="g.stl"
    ),
    "a mesh in metres": clump(
        ONE_BODY.replace("vertex 1 ", "vertex 5600 "), "g.stl", "--unit", "5600 mm", options="--spheres 3",
        name="g.stl",
    ),
    "an open mesh": clump(
        "solid o\nfacet normal 0 0 1\nouter loop\n"
        "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
        "endsolid o\n", "g.stl", "closed", "open or doubled", options="--spheres 3", name="g.stl",
    ),
    "half a mesh": clump(
        PLY + "property float y\nproperty float z\nend_header\n0",
        "g.ply", "not a readable mesh: PLY is unexpected length!",
        options="--spheres 3", name="g.ply",
    ),
    "a mesh without heights": clump(
        PLY.replace("binary_little_endian", "ascii") + "end_header\n0\n",
        "g.ply", "not a readable mesh: it has no 'y'",
        options="--spheres 3", name="g.ply",
    ),
    "spheres in metres": clump("x,y,z,r\n0,0,0,0.002\n", "g.txt", "--unit", "0.004 mm"),
    "spheres apart": clump("0 0 0 1\n9 0 0 1\n", "g.txt", "must touch", "2 separate parts"),
    "a word among spheres": clump("0 0 0 1\n0 0 one 1\n", "g.txt, line 2", "finite", "0 0 one 1"),
    "binary spheres": clump(bytes(range(256)), "g.txt", "UTF-8", "binary"),
    "no unit of length": clump("0 0 0 1\n", "--unit", "unit of length", "kg", options="--unit kg"),
    # Pictures and heaps
    "no picture": Hostile("angle p.jpg", ("p.jpg: no such file",)),
    "a folder as a picture": Hostile("angle .", ("is a folder", "name the files in it")),
    "text as a picture": Hostile("angle p.jpg", ("p.jpg", "not a picture", "6 bytes"),
                                 {"p.jpg": "hello\n"}),
    "half a crop": Hostile("angle p.jpg --crop 1,2", ("--crop", "four numbers", "1,2"), {"p.jpg": "x"}),
    "unknown fit": Hostile("angle p.jpg --fit wide", ("fit", "flank, middle", "wide"), {"p.jpg": "x"}),
    "one sphere as a heap": Hostile(
        "angle h.csv", ("h.csv", "at least", "1"), {"h.csv": "x,y,z,r\n0,0,1,1\n"}
    ),
    "a dump without radii": Hostile(
        "angle h.dump", ("h.dump, line 9", "radius", "id x y z"),
        {"h.dump": "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\n"
                   "ITEM: ATOMS id x y z\n1 0 0 0\n"},
    ),
    "a plate in kilograms": Hostile("angle h.csv --plate-height 3kg", ("--plate-height", "length", "3kg")),
    # Frames
    "a film of no frames": Hostile(
        "heap s.toml --device cpu --movie gif --out o", ("--movie", "--frames N", "gif"),
        {"s.toml": SMALL_STUDY},
    ),
    "an unknown film": Hostile(
        "heap s.toml --device cpu --frames 4 --movie avi --out o", ("--movie", "gif, mp4", "avi"),
        {"s.toml": SMALL_STUDY},
    ),
    # Other codes
    "no such code": Hostile(
        "export s.toml --to magic --out o", ("--to", "magic", "liggghts"), {"s.toml": SMALL_STUDY}
    ),
    "a bridge without a card": Hostile("bridge none.toml --engine lammps --out o", ("none.toml",)),
    # Names
    "a name of a device": Hostile("new nul", ("NAME", "device of Windows", "nul")),
    "a name with a path": Hostile("new ../rye", ("NAME", "letters", "../rye")),
    "a study that is there": Hostile(
        "new s", ("s.toml", "never overwrites", "exists"), {"s.toml": SMALL_STUDY}
    ),
}  # fmt: skip


def files_in(folder: Path) -> dict[Path, int]:
    """Files and when they were written; a lock is none, which has to be taken before a folder can be read."""
    files = (path for path in folder.rglob("*") if path.is_file() and path.name != ".lock")
    return {path: path.stat().st_mtime_ns for path in files}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_input_ends_with_2_and_writes_nothing(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    hostile = HOSTILE[name]
    monkeypatch.chdir(tmp_path)
    for file, content in hostile.files.items():
        path = tmp_path / file
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    before = files_in(tmp_path)
    code, out, err = dem_warp(*hostile.command.split())
    assert (code, out) == (2, "")
    told = " ".join(err.split())
    assert [word for word in hostile.words if word not in told] == [], told[:LONGEST_MESSAGE]
    assert len(err) < LONGEST_MESSAGE
    assert "Traceback" not in err
    assert "\x1b[2J" not in err
    assert files_in(tmp_path) == before


def test_there_are_sixty() -> None:
    assert len(HOSTILE) >= 60
