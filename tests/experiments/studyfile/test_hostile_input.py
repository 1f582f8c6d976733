"""Inputs that no command can use: each ends with 2, prints rule, value and place, and writes nothing."""

import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from commandline import refused
from small_study import ANGLE, TUBE

SMALL_STUDY = (Path(__file__).parents[1] / "small.toml").read_text(encoding="utf-8")
HOPPER = '[scene.hopper]\ndiameter = "28 mm"\nfill_depth = "16 mm"\noutlet = "20 mm"\n'
HEAPS = Path(__file__).parents[1] / "grains" / "spheres" / "data"
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


def small(command: str, *words: str, add: str = "") -> Hostile:
    """Give a command the small study, with some text added."""
    return Hostile(command, words, {"s.toml": SMALL_STUDY + add})


def content(text: str | bytes, *words: str) -> Hostile:
    """Make a study file of something else."""
    return Hostile("heap s.toml --device cpu --out o", words, {"s.toml": text})


def picture(option: str, *words: str) -> Hostile:
    """Measure a picture with an option that is wrong."""
    return Hostile(f"angle p.jpg {option}", words, {"p.jpg": "x"})


def study(command: str, old: str, new: str, *words: str) -> Hostile:
    """Make a study file with one thing wrong."""
    assert SMALL_STUDY.count(old) == 1, old
    return Hostile(f"{command} s.toml --device cpu --out o", words, {"s.toml": SMALL_STUDY.replace(old, new)})


def measured(text: str | bytes, *words: str) -> Hostile:
    """Make a file of measured heaps with one thing wrong."""
    files = {"s.toml": SMALL_STUDY + CONDITIONS, "m.csv": text}
    return Hostile("discover s.toml m.csv --device cpu --out o", words, files)


def clump(text: str | bytes, *words: str, options: str = "", name: str = "g.txt") -> Hostile:
    """Make a file of a grain with one thing wrong."""
    return Hostile(f"clump {name} {options} --out o.txt", words, {name: text})


HOSTILE = {
    # Study files
    "no study": Hostile("heap none.toml --device cpu --out o", ("none.toml", "no such file")),
    "a folder": Hostile("heap . --device cpu --out o", ("regular file", "folder")),
    "empty study": content("", "s.toml", "required", "nothing"),
    "no TOML": content("hello\n", "s.toml:1", "valid TOML", "hello"),
    "UTF-16": content(SMALL_STUDY.encode("utf-16"), "s.toml", "UTF-8", "UTF-16"),
    "Latin-1": content(b"name = 'K\xfcrbis'\n", "s.toml, line 1", "UTF-8", "0xfc"),
    "a picture as study": content(bytes(range(256)) * 40, "s.toml", "UTF-8", "binary"),
    "decimal comma": study("heap", '"28 mm"\nheight', '"28,5 mm"\nheight', "s.toml:25", "28.5 mm", "comma"),
    "no unit": study("heap", '"28 mm"\nheight', "28\nheight", "s.toml:25: scene", "unit of length", "28"),
    "true for a count": study("heap", "= 30", "= true", "grain_count", "not true or false", "True"),
    "NaN": study("heap", "restitution = 0.2", "restitution = nan", "restitution", "finite", "nan"),
    "narrow tube": study("heap", '"28 mm"\nheight', '"7 mm"\nheight', "scene", "2 grains wide", "7 mm"),
    "a long text": study(
        "heap", 'name = "Small"', f'nome = "{"x" * 400_000}"', "nome", "unknown key"
    ),
    "two megabytes": study(
        "heap", 'name = "Small"', f'name = "{"x" * 2_000_000}"', "s.toml", "at most 500,000 bytes"
    ),
    "escape sequences": study("heap", 'name = "Small"', 'nome = "\\u001b[2J"', "nome", "unknown key"),
    "an unknown key": study("heap", "n = 5", "n = 5\nm = 6", "s.toml:41: target.m", "unknown key"),
    "a negative length": study(
        "heap", 'sphere = "2 mm"', 'sphere = "-2 mm"', "grain.sphere", "greater than 0"
    ),
    "a range reversed": study("calibrate", "low = 0.2", "low = 0.8", "low must be below high"),
    "no target": study("calibrate", ANGLE, "", "[target]"),
    "an angle that no heap has": study(
        "calibrate", TUBE, HOPPER, "this test leaves no heap whose angle could be the target"
    ),
    "a start beyond a limit": small(
        "calibrate s.toml --device cpu", "campaign.surface.center",
        add="[campaign.surface]\ncenter = { E = -0.5 }\n"
    ),
    "no room for the rain": study(
        "calibrate --dry-run", "3000 1/s", "1e12 1/s", "no free place"
    ),
    # Options
    "unknown scale": small("heap s.toml --scale huge --device cpu", "scale", "huge"),
    "no such device": small("heap s.toml --device tpu", "--device", "tpu", "one of"),
    "a setting without value": small("heap s.toml --device cpu --set E", "--set", "NAME=VALUE", "E"),
    "a setting of no factor": small("heap s.toml --device cpu --set Q=1", "--set: Q", "factor", "1"),
    "a used folder": small("heap s.toml --device cpu --out .", ".", "folder is not empty", "--resume"),
    "a bank of nothing": Hostile(
        "discover s.toml m.csv --bank b.npz --device cpu --out o",
        ("b.npz", "must be a bank", "an archive without space, observables, theta"),
        {"s.toml": SMALL_STUDY + CONDITIONS, "m.csv": HEAD, "b.npz": b"PK\x05\x06" + bytes(18)},
    ),
    "nothing to resume": Hostile(
        "calibrate s.toml --device cpu --resume --out in", ("in/study.json", "resume", "cannot be read"),
        {"s.toml": SMALL_STUDY, "in/x": "x"},
    ),
    "a scale of the paper's study": Hostile("heap --scale bnch", ("did you mean 'bench'",)),
    "a setting without its unit": Hostile("heap --scale bench --set B=34", ("unit of pressure",)),
    "a setting that is not physical": Hostile(
        "heap --scale bench --set E=-1", ("greater than or equal to 0",)
    ),
    "no such GPU": Hostile("doctor --device cuda:7", ("--device",)),
    "no address": small(
        "calibrate s.toml --scheduler foo --out o",
        "--scheduler: must be the address of a Dask scheduler, got foo. An example is tcp://HOST:8786.",
    ),
    "no engine": small("calibrate s.toml --engine rocky --out o", "engine: must be one of"),
    "no program": small(
        "discover s.toml --out o", "must begin with a program on the PATH",
        add='[engine]\ncommand = "no-such-solver"\n'
    ),
    "no folder to watch": Hostile("watch none", ("no such folder",)),
    "no folder to start in": Hostile("ui s.txt", ("s.txt", "must be a folder"), {"s.txt": "x"}),
    "a used folder for a campaign": small("calibrate s.toml --device cpu --out .", "folder is not empty"),
    "a used folder for a search": Hostile(
        "discover s.toml m.csv --device cpu --out .", ("folder is not empty. Add --resume",),
        {"s.toml": SMALL_STUDY + CONDITIONS, "m.csv": HEAD + "base,1,height,9,mm\nbase,2,height,9.5,mm\n"},
    ),
    # Measured heaps
    "no such condition": measured(
        HEAD + "slow,1,height,9,mm\n", "m.csv:2", "must be a condition of the study"
    ),
    "an impossible height": measured(HEAD + "base,1,height,40,m\n", "m.csv:2", "Check the unit"),
    "no photographs": Hostile(
        "discover s.toml m.csv --photographs-only --device cpu --out o --dry-run",
        ("m.csv: --photographs-only needs an observable that photographs show", "got t75"),
        {"s.toml": SMALL_STUDY + CONDITIONS, "m.csv": HEAD + "base,1,t75,400,ms\n"},
    ),
    "a plan without its data": small("discover s.toml none.csv --device cpu --dry-run", "none.csv"),
    "no measurement": measured(HEAD, "m.csv", "has no rows"),
    "wrong column": measured(HEAD.replace("unit", "units"), "m.csv:1", "known column", "units"),
    "one unit wrong in every row": measured(
        HEAD + "".join(f"base,{n},flank_angle,30,mm\n" for n in range(1, 40)),
        "m.csv:2: ", "and 36 more", "angle",
    ),
    # Grains
    "no such file": Hostile("clump g.stl --spheres 3", ("g.stl: no such file",)),
    "a solid and no number": Hostile("clump sphere:2", ("--spheres", "needs one of the two", "neither")),
    "number and tolerance": Hostile(
        "clump sphere:2 --spheres 2 --tolerance 5%", ("--tolerance", "or", "both")
    ),
    "comma for the protrusion": Hostile(
        "clump sphere:2 --spheres 1 --protrusion 0,1mm", ("--protrusion", "comma", "0,1mm")
    ),
    "a negative density": Hostile(
        "clump sphere:2 --spheres 1 --density -3kg/m3", ("--density", "greater than 0", "-3kg/m3")
    ),
    "two bodies": clump(
        TWO_BODIES, "g.stl", "one closed body", "2 bodies", options="--spheres 3", name="g.stl"
    ),
    "a mesh in metres": clump(
        ONE_BODY.replace("1", "5600"), "g.stl", "--unit", "5600 mm", options="--spheres 3",
        name="g.stl",
    ),
    "an open mesh": clump(
        "solid o\nfacet normal 0 0 1\nouter loop\n"
        "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
        "endsolid o\n", "g.stl", "surface is open", "3 open edges", options="--spheres 3", name="g.stl",
    ),
    "a mesh without heights": clump(
        PLY.replace("binary_little_endian", "ascii") + "end_header\n0\n",
        "g.ply", "not a readable mesh: it has no 'y'",
        options="--spheres 3", name="g.ply",
    ),
    "spheres in metres": clump("x,y,z,r\n0,0,0,0.002\n", "g.txt", "--unit", "0.004 mm"),
    "spheres apart": clump("0 0 0 1\n9 0 0 1\n", "g.txt", "must touch", "2 separate parts"),
    "binary spheres": clump(bytes(range(256)), "g.txt", "UTF-8", "binary"),
    "no unit of length": clump("0 0 0 1\n", "--unit", "unit of length", "kg", options="--unit kg"),
    # Pictures and heaps
    "no crop": picture("--crop 1,2,3", "--crop"),
    "a crop reversed": picture("--crop 10,10,5,20", "left < right"),
    "no plate": picture("--plate a,b,c,d", "--plate"),
    "no heap of a picture": picture("--heap 0", "must be 1 or more"),
    "a view from above": picture("--elevation 70", "elevation"),
    "no grouping": picture("--by name", "--by"),
    "a file for the overlays": picture("--overlay p.jpg", "--overlay"),
    "a heap without radii": Hostile(f"angle {HEAPS}/liggghts_boundingBox_20000.vtk", ("an array radius",)),
    "no such solid": Hostile("clump cube:2 --spheres 3", ("cube",)),
    "no picture": Hostile("angle p.jpg", ("p.jpg: no such file",)),
    "text as a picture": Hostile("angle p.jpg", ("p.jpg", "is text", "neither a picture"),
                                 {"p.jpg": "hello\n"}),
    "unknown fit": picture("--fit wide", "fit", "flank, trimmed, middle", "wide"),
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
    "one frame": small("heap s.toml --device cpu --frames 1 --out o", "greater than or equal to 2"),
    "frames of another engine": small(
        "heap s.toml --device cpu --frames 4 --out o", "--frames: must run on dem-warp's own engine",
        add=f"[engine]\ncommand = '{sys.executable}'\n",
    ),
    "a film of no frames": small(
        "heap s.toml --device cpu --movie gif --out o", "--movie", "--frames N", "gif"
    ),
    "an unknown film": small(
        "heap s.toml --device cpu --frames 4 --movie avi --out o", "--movie", "gif, mp4", "avi"
    ),
    # Other codes
    "no such code": small("export s.toml --to magic --out o", "--to", "magic", "liggghts"),
    "a bridge without a card": Hostile("bridge none.toml --engine lammps --out o", ("none.toml",)),
    "a card without its test": Hostile(
        "bridge c.toml --engine lammps", ("lacks the test that it was fitted to",), {"c.toml": "format = 1\n"}
    ),
    "no card": Hostile(
        "bridge c.toml --engine lammps", ("is not a material card",),
        {"c.toml": "[fitted.test.hopper]\noutlet = 1\n"}
    ),
    # Names
    "a name of a device": Hostile("new nul", ("NAME", "device of Windows", "nul")),
    "a name that leads away": Hostile("new ../rye", ("rye",)),
    "a study that is there": Hostile(
        "new s", ("s.toml", "never overwrites", "exists"), {"s.toml": SMALL_STUDY}
    ),
}  # fmt: skip


def files_in(folder: Path) -> dict[Path, int]:
    """Return files and their times; a lock does not count, it is taken before a folder is read."""
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
    printed = refused(*hostile.command.split())
    assert [word for word in hostile.words if word not in printed] == [], printed[:LONGEST_MESSAGE]
    assert len(printed) < LONGEST_MESSAGE
    assert "Traceback" not in printed
    assert "\x1b[2J" not in printed
    assert files_in(tmp_path) == before
