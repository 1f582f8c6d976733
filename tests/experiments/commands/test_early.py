"""Answers before the libraries load: to a wrong study, to ``--help``, to ``new``."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from experiments.io.errors import StudyError
from experiments.runs.choices import check_campaign, check_scene
from experiments.studyfile import load_study, write_template

ROOT = Path(__file__).resolve().parents[3]

HEAVY = {
    "warp", "pandas", "scipy", "statsmodels", "sklearn", "cv2", "pyvista", "vtkmodules", "plotly",
    "matplotlib", "trimesh", "jinja2",
}  # fmt: skip
"""Libraries that take from a tenth of a second to seconds to load."""

WRONG: dict[str, tuple[str, str]] = {
    "no TOML": ("[wall]", "[wall"),
    "an unknown key": ("size_sd = 0.05", "size_sdd = 0.05"),
    "a wrong unit": ('density = "700 kg/m^3"', 'density = "700 mm"'),
    "a range reversed": ('grain.static_friction"\nlow = 0.3', 'grain.static_friction"\nlow = 0.7'),
    "a clump file that is not there": ('sphere = "2 mm"', 'clump = "none.txt"'),
    "a clump that is none": ('sphere = "2 mm"', 'clump = "words.txt"'),
    "a factor that leads nowhere": (
        'parameter = "contact.grain-grain.static_friction"',
        'parameter = "contact.grain-grain.stickiness"',
    ),
    "laws that are none": ('laws = "relative"', 'laws = "liggghtz"'),
    "an engine that is none": ("[numerics]", '[engine]\nname = "nobody"\n\n[numerics]'),
    "a file of measurements without its columns": (
        'mean = "20 deg"\nsd = "0.5 deg"\nn = 5',
        'file = "words.txt"',
    ),
    "a decision on no factor": ("at_most = 3", 'at_most = 3\nkeep = ["Z"]'),
    "more grains than a case can have": ("# grain_count = 400 ", "grain_count = 1_000_000_000 "),
    "a tube that too many grains fill": ('height = "110 mm"', 'height = "10000 m"'),
    "a tube narrower than two grains": ('diameter = "35 mm"', 'diameter = "7 mm"'),
}
"""Mistakes of a study: the template's text, and its replacement."""


def wrong_study(folder: Path, kind: str) -> Path:
    """Write the template's study, wrong in one way."""
    path = folder / "study.toml"
    write_template("study", folder)
    (folder / "words.txt").write_text("no numbers here\n", encoding="utf-8")
    text = path.read_text(encoding="utf-8")
    old, new = WRONG[kind]
    assert text.count(old) == 1
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


PROGRAM = """
import contextlib, io, json, sys
from experiments.cli import app
found = []
for words in json.loads(sys.argv[1]):
    said = io.StringIO()
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
        code = app(words, standalone_mode=False)
    found.append((code, said.getvalue(), [*sys.modules]))
print(json.dumps(found))
"""


def run(*commands: list[str], folder: Path) -> list[tuple[int, str, set[str]]]:
    """Run commands one after another in one process; return exit codes, messages and loaded modules."""
    words = [sys.executable, "-c", PROGRAM, json.dumps(commands)]
    environment = {"PYTHONPATH": str(ROOT), "PATH": ""}
    done = subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True, check=True)
    found = [(code, said, set(loaded)) for code, said, loaded in json.loads(done.stdout)]
    assert all("experiments.cli" in loaded for *_, loaded in found)
    return found


def test_a_wrong_study_is_answered_without_simulator_statistics_or_pictures(tmp_path: Path) -> None:
    commands = []
    for number, kind in enumerate(WRONG):
        folder = tmp_path / str(number)
        folder.mkdir()
        commands.append(["calibrate", str(wrong_study(folder, kind)), "--out", "out"])
    answers = run(*commands, folder=tmp_path)
    for kind, (code, said, loaded) in zip(WRONG, answers, strict=True):
        assert (code, HEAVY & loaded) == (2, set()), kind
        assert said.startswith("Error:"), kind
    assert not (tmp_path / "out").exists()


def test_other_commands_check_a_study_and_a_heap_as_early(tmp_path: Path) -> None:
    study = wrong_study(tmp_path, "a wrong unit").rename(tmp_path / "unit.toml")
    commands = [["heap", study.name], ["discover", study.name, "measured.csv"]]
    commands.append(["calibrate", "--scale", "bench", "--engine", "nobody"])
    heaps = [kind for kind in WRONG if "grains" in kind]
    for number, kind in enumerate(heaps):
        wrong_study(tmp_path, kind).rename(tmp_path / f"{number}.toml")
        commands.append(["heap", f"{number}.toml", "--seed", "2"])
        (tmp_path / "words.txt").unlink()
    answers = run(*commands, folder=tmp_path)
    wanted = [["unit of density"]] * 2 + [["liggghts, lammps, yade"]] + [["grains", "scene"]] * len(heaps)
    for words, texts, (code, said, loaded) in zip(commands, wanted, answers, strict=True):
        assert (code, HEAVY & loaded) == (2, set()), words
        assert all(text in said for text in texts), said


def test_settings_may_make_a_heap_of_fewer_grains(tmp_path: Path) -> None:
    path = wrong_study(tmp_path, "a tube that too many grains fill")
    text = path.read_text(encoding="utf-8").replace('height = "10000 m"\n', "")
    factor = """
[[factor]]
name = "h"
label = "height"
parameter = "scene.lifted-cylinder.height"
low = "40 mm"
high = "20000 m"
"""
    path.write_text(text + factor, encoding="utf-8")
    check_scene(load_study(path))
    with pytest.raises(StudyError, match="at most"):
        check_campaign(load_study(path))


def test_help_and_a_new_study_read_no_study(tmp_path: Path) -> None:
    for code, _, loaded in run(["--help"], ["calibrate", "--help"], ["new", "mygrain"], folder=tmp_path):
        assert not code
        assert (HEAVY | {"numpy"}) & loaded == set()
